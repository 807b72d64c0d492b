use tower_http::{
    CompressionLevel,
    compression::{
        CompressionLayer,
        predicate::{And, NotForContentType, Predicate, SizeAbove},
    },
};

/// Shorter answers fit into one packet of the network either way.
const SHORTEST: u64 = 1024;

/// Which answers are compressed.
pub type Compressible = And<And<SizeAbove, NotForContentType>, NotForContentType>;

/// Compresses answers as `Accept-Encoding` asks: not the short ones, nor pictures, which are compressed, nor events,
/// which must not wait for more. The quickest level: answers are long lists of numbers, which the next levels make
/// little shorter in several times the time.
pub fn layer() -> CompressionLayer<Compressible> {
    let worth = SizeAbove::new(SHORTEST).and(NotForContentType::IMAGES).and(NotForContentType::SSE);
    CompressionLayer::new().quality(CompressionLevel::Fastest).compress_when(worth)
}

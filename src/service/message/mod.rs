//! The protobuf form of requests and results, shared by gRPC and by HTTP answers in protobuf.

mod fit;
mod hint;
mod parameters;
mod pieces;
mod region;
mod relation;
mod result;

/// The code generated from `proto/conicoid/v1/conicoid.proto`.
#[expect(missing_docs, clippy::all, reason = "generated")]
pub mod v1 {
    tonic::include_proto!("conicoid.v1");
}

/// The contract's descriptor, for server reflection.
pub const DESCRIPTOR: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/descriptor.bin"));

pub use fit::fit_from_message;
pub use parameters::{format_from_message, request_from_message};
pub use pieces::Pieces;

fn count(n: usize) -> u64 {
    n as u64
}

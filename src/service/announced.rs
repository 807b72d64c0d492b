/// What the head of a cloud says of its size, before anything is unpacked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Announced {
    /// How many points there will be at most.
    pub points: u64,
    /// Bytes that they take in memory beside the upload.
    pub decoded: u64,
}

/// How the gRPC interface takes messages.
#[derive(Clone, Copy, Debug)]
pub struct GrpcConfig {
    /// Longest message taken.
    pub max_message_bytes: usize,
}

/// What ends a command: its text is told, and it is gone.
pub(super) type AnyError = Box<dyn std::error::Error + Send + Sync>;

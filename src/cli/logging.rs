use std::io::{self, IsTerminal};

use tracing_subscriber::EnvFilter;

use super::{AnyError, LogFormat, Settings};

/// Sends the log to standard error, in the form the settings ask for.
pub fn start(settings: &Settings) -> Result<(), AnyError> {
    let filter = EnvFilter::try_new(&settings.log)
        .map_err(|e| format!("log = '{}' is not a filter: {e}", settings.log))?;
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(io::stderr);
    let log = log.with_ansi(io::stderr().is_terminal());
    match settings.log_format {
        LogFormat::Text => log.try_init(),
        LogFormat::Json => log.json().flatten_event(true).try_init(),
    }
}

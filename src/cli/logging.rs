use std::{
    fmt::{self, Write},
    io::{self, IsTerminal},
};

use opentelemetry::trace::TracerProvider;
use tracing_subscriber::{
    EnvFilter, Layer, Registry,
    field::RecordFields,
    filter::{FilterExt, filter_fn},
    fmt::{
        FormatFields,
        format::{DefaultFields, Writer},
    },
    layer::SubscriberExt,
    util::SubscriberInitExt,
};

use super::{
    error::AnyError,
    settings::{LogFormat, Settings},
    traces::Traces,
};
use crate::jobs::trace;

/// Sends the log to standard error, in the form the settings ask for, and spans to `traces`.
pub fn start(settings: &Settings, traces: Option<&Traces>) -> Result<(), AnyError> {
    let filter = EnvFilter::try_new(&settings.log)
        .map_err(|e| format!("log = '{}' is not a filter: {e}", settings.log))?;
    let lines = filter.and(filter_fn(|of| of.target() != trace::TARGET));
    let log = tracing_subscriber::fmt::layer().with_writer(io::stderr);
    let log = log.with_ansi(io::stderr().is_terminal());
    let mut layers: Vec<Box<dyn Layer<Registry> + Send + Sync>> = vec![match settings.log_format {
        LogFormat::Text => log.fmt_fields(OneLine).with_filter(lines).boxed(),
        LogFormat::Json => log.json().flatten_event(true).with_filter(lines).boxed(),
    }];
    layers.extend(traces.map(|traces| {
        let layer = tracing_opentelemetry::layer()
            .with_tracer(traces.provider().tracer("conicoid"))
            .with_location(false)
            .with_threads(false)
            .with_target(false)
            .with_tracked_inactivity(false);
        layer.with_filter(filter_fn(|of| of.target() == trace::TARGET)).boxed()
    }));
    Ok(tracing_subscriber::registry().with(layers).try_init()?)
}

/// Writes what lines of the text log tell, span by span and event by event, so that it stays on its line
/// and looks like what it is: names out of requests are in it.
struct OneLine;

impl<'w> FormatFields<'w> for OneLine {
    fn format_fields<R: RecordFields>(&self, mut writer: Writer<'w>, fields: R) -> fmt::Result {
        let mut text = String::new();
        DefaultFields::new().format_fields(Writer::new(&mut text), fields)?;
        text.chars().try_for_each(|c| tell(&mut writer, c))
    }
}

/// `text` for a terminal, in lines of its own but without anything that would steer the terminal.
pub fn shown(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        // writing into memory does not fail
        let _ = if c == '\n' { shown.write_char(c) } else { tell(&mut shown, c) };
    }
    shown
}

/// Writes `c`, or its escape where it would break the line, steer a terminal or turn the text around.
fn tell(writer: &mut impl Write, c: char) -> fmt::Result {
    let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{61c}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    if c.is_control() || turns || matches!(c, '\u{2028}' | '\u{2029}') {
        write!(writer, "{}", c.escape_default())
    } else {
        writer.write_char(c)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex, PoisonError};

    use super::*;

    #[derive(Clone, Default)]
    struct Lines(Arc<Mutex<Vec<u8>>>);

    impl io::Write for Lines {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap_or_else(PoisonError::into_inner).extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn no_name_in_a_request_makes_a_line_or_steers_a_terminal() {
        let lines = Lines::default();
        let writer = lines.clone();
        let log = tracing_subscriber::fmt::layer().with_ansi(false).fmt_fields(OneLine);
        let log = log.with_writer(move || writer.clone());
        let name = "a\n2026 INFO forged\r\u{1b}[2J\u{9b}2J\u{202e}\u{2028}\u{7}\t\u{7f}b";
        tracing::subscriber::with_default(tracing_subscriber::registry().with(log), || {
            let span = tracing::info_span!("http", shown = %name, quoted = name, asked = ?name);
            span.in_scope(|| tracing::info!(shown = %name, quoted = name, asked = ?name, "{name}"));
        });
        let text = lines.0.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let text = String::from_utf8(text).unwrap();
        let line = text.strip_suffix('\n').unwrap();
        assert!(
            !line.contains(|c: char| c.is_control() || "\u{202e}\u{2028}".contains(c)),
            "{line:?}"
        );
        assert_eq!(line.matches("forged").count(), 7, "{line}");
    }

    #[test]
    fn a_message_keeps_its_lines_and_nothing_else_that_steers_a_terminal() {
        assert_eq!(shown("a\nb \u{1b}[31m'\u{f6}'"), "a\nb \\u{1b}[31m'\u{f6}'");
    }
}

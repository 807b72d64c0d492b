//! Spans for traces, apart from those of the log: they have the names of OpenTelemetry's conventions,
//! and cost nothing where no collector is set.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use opentelemetry::{
    Key, Value,
    propagation::TextMapPropagator,
    trace::{Status, TraceContextExt},
};
use opentelemetry_sdk::propagation::TraceContextPropagator;
use tracing::{Instrument, Span};
use tracing_opentelemetry::OpenTelemetrySpanExt;

/// The target of every span that goes into traces and of nothing else.
pub const TARGET: &str = "conicoid::trace";

/// The W3C headers that carry a trace from its caller.
pub const HEADERS: [&str; 2] = ["traceparent", "tracestate"];

tokio::task_local! {
    static SCOPE: Scope;
}

/// What a request or a job is about, for its line in the log and its span: who sent it, and how much it
/// was. No secret and no coordinate is in it. What is not known is absent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// Who sent it.
    pub caller: Option<String>,
    /// The cloud's format.
    pub format: Option<&'static str>,
    /// The cloud's bytes.
    pub bytes: Option<usize>,
    /// The points in it.
    pub points: Option<usize>,
    /// The surfaces found.
    pub regions: Option<usize>,
    /// The job it became.
    pub job: Option<String>,
}

impl Facts {
    fn describe(&self, span: &Span) {
        let texts = [
            ("enduser.id", self.caller.as_deref()),
            ("conicoid.format", self.format),
            ("conicoid.job.id", self.job.as_deref()),
        ];
        for (name, text) in texts {
            text.into_iter().for_each(|text| set(span, name, text.to_owned()));
        }
        let numbers = [
            ("conicoid.bytes", self.bytes),
            ("conicoid.points", self.points),
            ("conicoid.regions", self.regions),
        ];
        for (name, number) in numbers {
            number.into_iter().for_each(|number| set(span, name, number as i64));
        }
    }
}

/// The spans of a request or a job: the log's, and the trace's; and what is known of it.
#[derive(Clone, Debug)]
pub struct Scope {
    log: Span,
    trace: Span,
    facts: Arc<Mutex<Facts>>,
    /// What is told where nobody waits for the end.
    given_up: &'static str,
}

/// Adds to what is known of the request or job that is worked on.
pub fn note(add: impl FnOnce(&mut Facts)) {
    let _ = SCOPE.try_with(|scope| add(&mut scope.lock()));
}

impl Scope {
    /// The two spans of one request or job.
    pub fn new(log: Span, trace: Span) -> Self {
        let given_up = "given up: the caller went away";
        Self { log, trace, facts: Arc::default(), given_up }
    }

    /// The two spans of a job, which nobody but the service gives up: when it ends.
    pub fn of_job(log: Span, trace: Span) -> Self {
        let given_up =
            "given up: the service ends; a job that is kept on disk is done after its restart";
        Self { given_up, ..Self::new(log, trace) }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Facts> {
        self.facts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What is known by now, told to the trace as well.
    pub fn facts(&self) -> Facts {
        let facts = self.lock().clone();
        facts.describe(&self.trace);
        facts
    }

    /// The scope that the current task works in.
    pub fn current() -> Self {
        SCOPE.try_with(Self::clone).unwrap_or_else(|_| Self::new(Span::none(), Span::none()))
    }

    /// Does `work` within both spans, on whichever thread this is.
    pub fn enter<T>(&self, work: impl FnOnce() -> T) -> T {
        SCOPE.sync_scope(self.clone(), || self.log.in_scope(|| self.trace.in_scope(work)))
    }

    /// Lets `work` be done within both spans; says so where nobody waits for its end.
    pub async fn cover<T>(self, work: impl Future<Output = T>) -> T {
        let (log, trace) = (self.log.clone(), self.trace.clone());
        let mut waiting = Waiting(Some(self.clone()));
        let done = SCOPE.scope(self, work).instrument(trace).instrument(log).await;
        waiting.0 = None;
        done
    }
}

/// Somebody waits for work within these spans, or has waited until it was done.
struct Waiting(Option<Scope>);

impl Drop for Waiting {
    fn drop(&mut self) {
        if let Some(scope) = &self.0 {
            fail(&scope.trace, "cancelled".to_owned());
            let Facts { caller, format, bytes, .. } = scope.facts();
            scope.log.in_scope(|| {
                tracing::info!(caller, format, bytes, "{}", scope.given_up);
            });
        }
    }
}

/// A span around a request, within the trace its caller's headers name.
pub fn server(log: &Span, name: &str, header: impl Fn(&str) -> Option<String>) -> Span {
    let span = tracing::info_span!(target: TARGET, parent: log, "request", otel.name = name, otel.kind = "server");
    if !span.is_disabled() {
        let carried = HEADERS.into_iter().filter_map(|name| Some((name.to_owned(), header(name)?)));
        let carried: HashMap<_, _> = carried.collect();
        // where there is nothing to follow the span begins a trace
        let _ = span.set_parent(TraceContextPropagator::new().extract(&carried));
    }
    span
}

/// A span around a job, which outlives the request it came by and is linked to it.
pub fn job(log: &Span) -> Span {
    let caller = Span::current();
    let span = tracing::info_span!(target: TARGET, parent: log, "job", otel.kind = "consumer");
    if !span.is_disabled() {
        span.add_link(caller.context().span().span_context().clone());
    }
    span
}

/// A span around a step of the work.
pub fn step(name: &str) -> Span {
    tracing::info_span!(target: TARGET, "step", otel.name = name)
}

/// Says something of a span in its trace.
pub fn set(span: &Span, name: impl Into<Key>, value: impl Into<Value>) {
    if !span.is_disabled() {
        span.set_attribute(name, value);
    }
}

/// Marks a span as failed, with the kind of error.
pub fn fail(span: &Span, error_type: String) {
    if !span.is_disabled() {
        span.set_attribute("error.type", error_type);
        span.set_status(Status::error(""));
    }
}

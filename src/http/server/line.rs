use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use bytes::Bytes;
use tokio_util::sync::CancellationToken;

use super::patience::Patience;

/// A body that comes in as fast as this, in bytes a second, does not keep the service waiting: it is the
/// slower ones that make room for newcomers.
const STEADY: f64 = 16384.0;

/// One connection, as the service sees it: who has to act, and since when.
#[derive(Debug)]
pub struct Line {
    end: CancellationToken,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    /// When it was accepted, or when its last request ended.
    idle: Instant,
    /// Whether a request has come on it.
    used: bool,
    next: u64,
    requests: HashMap<u64, Exchange>,
}

/// One request and its answer.
#[derive(Debug)]
struct Exchange {
    /// Whether bytes of the request are wanted and not there.
    wanting: bool,
    /// Whether its answer has begun.
    answering: bool,
    /// The last byte of it, in or out.
    moved: Instant,
    /// The same, for a body coming in, as if each byte were worth its part of a second.
    credited: Instant,
    /// When a part of the answer was last taken, or asked for in vain.
    taken: Instant,
}

impl Exchange {
    /// Since when the caller has had to act; `None` while the service has.
    fn waits_since(&self) -> Option<Instant> {
        if self.answering { Some(self.moved) } else { self.wanting.then_some(self.credited) }
    }

    /// By when the caller must have acted.
    fn deadline(&self, patience: &Patience) -> Option<Instant> {
        let byte = self.wanting.then(|| self.moved + patience.idle);
        let part = self.answering.then(|| self.taken + patience.write);
        byte.into_iter().chain(part).min()
    }
}

impl Line {
    /// A connection accepted at `now`.
    pub fn new(now: Instant) -> Self {
        let state = State { idle: now, used: false, next: 0, requests: HashMap::new() };
        Self { end: CancellationToken::new(), state: Mutex::new(state) }
    }

    /// Tells the connection to end.
    pub fn end(&self) {
        self.end.cancel();
    }

    /// Since when the caller has had to act; `None` while a request is being worked on.
    pub fn waits_since(&self) -> Option<Instant> {
        let state = self.state();
        let mut since = state.requests.is_empty().then_some(state.idle);
        for exchange in state.requests.values() {
            since = since.max(Some(exchange.waits_since()?));
        }
        since
    }

    /// Ends when the connection has to: it was told to, or the caller has not acted in time.
    pub async fn overdue(&self, patience: &Patience) {
        // whatever the caller is to do next, it has at least this long
        let shortest = patience.head.min(patience.idle).min(patience.write);
        let late = async {
            loop {
                let (now, deadline) = (Instant::now(), self.deadline(patience));
                if deadline.is_some_and(|deadline| deadline <= now) {
                    break;
                }
                let next = deadline.unwrap_or(now + shortest).min(now + shortest);
                tokio::time::sleep_until(next.into()).await;
            }
            metrics::counter!("conicoid_connections_ended_total", "cause" => "late").increment(1);
        };
        tokio::select! {
            () = self.end.cancelled() => {}
            () = late => {}
        }
    }

    fn deadline(&self, patience: &Patience) -> Option<Instant> {
        let state = self.state();
        if state.requests.is_empty() {
            return Some(state.idle + if state.used { patience.idle } else { patience.head });
        }
        state.requests.values().filter_map(|exchange| exchange.deadline(patience)).min()
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// One request under way on a line. It ends with the last handle: when the answer has been sent, or when
/// caller or service gave it up.
#[derive(Clone, Debug)]
pub struct Ticket(Arc<Entry>);

#[derive(Debug)]
struct Entry {
    line: Arc<Line>,
    id: u64,
}

impl Ticket {
    /// A request whose head has come on `line`.
    pub fn new(line: &Arc<Line>) -> Self {
        let now = Instant::now();
        let exchange =
            Exchange { wanting: false, answering: false, moved: now, credited: now, taken: now };
        let mut state = line.state();
        (state.used, state.next) = (true, state.next + 1);
        let id = state.next;
        state.requests.insert(id, exchange);
        drop(state);
        Self(Arc::new(Entry { line: Arc::clone(line), id }))
    }

    /// More of the body is wanted and not there, or that is over.
    pub fn wants(&self, wanting: bool) {
        self.change(|exchange, _| exchange.wanting = wanting);
    }

    /// `bytes` of the body have come.
    pub fn came(&self, bytes: usize) {
        self.change(|exchange, now| {
            let worth = Duration::from_secs_f64(bytes as f64 / STEADY);
            exchange.credited = (exchange.credited + worth).min(now);
            (exchange.wanting, exchange.moved) = (false, now);
        });
    }

    /// The answer begins.
    pub fn answers(&self) {
        self.change(|exchange, now| {
            (exchange.answering, exchange.moved, exchange.taken) = (true, now, now);
        });
    }

    /// The connection has room for a part of the answer.
    pub fn asked(&self) {
        self.change(|exchange, now| exchange.taken = now);
    }

    /// `bytes` of the answer, which tell when they are sent.
    pub fn carried(&self, bytes: Bytes) -> Bytes {
        Bytes::from_owner(Part { bytes, ticket: self.clone() })
    }

    fn change(&self, change: impl FnOnce(&mut Exchange, Instant)) {
        if let Some(exchange) = self.0.line.state().requests.get_mut(&self.0.id) {
            change(exchange, Instant::now());
        }
    }
}

impl Drop for Entry {
    fn drop(&mut self) {
        let mut state = self.line.state();
        state.requests.remove(&self.id);
        state.idle = Instant::now();
    }
}

/// A part of an answer.
struct Part {
    bytes: Bytes,
    ticket: Ticket,
}

impl AsRef<[u8]> for Part {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        self.ticket.change(|exchange, now| (exchange.moved, exchange.taken) = (now, now));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENCE: Patience = Patience {
        head: Duration::from_secs(1),
        idle: Duration::from_secs(10),
        write: Duration::from_secs(5),
    };

    fn line() -> (Arc<Line>, Instant) {
        let now = Instant::now();
        (Arc::new(Line::new(now)), now)
    }

    #[test]
    fn a_connection_without_a_request_waits_for_its_caller() {
        let (line, accepted) = line();
        assert_eq!(line.waits_since(), Some(accepted));
        assert_eq!(line.deadline(&PATIENCE), Some(accepted + PATIENCE.head));
        drop(Ticket::new(&line));
        let idle = line.waits_since().unwrap();
        assert_eq!(line.deadline(&PATIENCE), Some(idle + PATIENCE.idle));
    }

    #[test]
    fn a_request_at_work_is_waited_for() {
        let (line, _) = line();
        let (one, two) = (Ticket::new(&line), Ticket::new(&line));
        two.wants(true);
        assert_eq!(line.waits_since(), None);
        assert!(line.deadline(&PATIENCE).is_some());
        drop(two);
        assert_eq!(line.deadline(&PATIENCE), None);
        drop(one);
        assert!(line.waits_since().is_some());
    }

    #[test]
    fn a_body_waits_the_longer_the_slower_it_comes() {
        let (slow, _) = line();
        let slow = (Ticket::new(&slow), slow);
        std::thread::sleep(Duration::from_millis(20));
        let (fast, _) = line();
        let fast = (Ticket::new(&fast), fast);
        std::thread::sleep(Duration::from_millis(20));
        for (ticket, bytes) in [(&slow.0, 1), (&fast.0, 1 << 20)] {
            ticket.came(bytes);
            ticket.wants(true);
        }
        assert!(slow.1.waits_since() < fast.1.waits_since());
        // the time of what is sent is never in the future
        assert!(fast.1.waits_since() <= Some(Instant::now()));
        // the next byte has its time from the last one
        assert!(
            slow.1.deadline(&PATIENCE) > slow.1.waits_since().map(|since| since + PATIENCE.idle)
        );
    }

    #[test]
    fn an_answer_is_under_way_until_its_last_part_is_sent() {
        let (line, _) = line();
        let ticket = Ticket::new(&line);
        ticket.answers();
        let part = ticket.carried(Bytes::from_static(b"answer"));
        drop(ticket);
        let since = line.waits_since().unwrap();
        assert_eq!(line.deadline(&PATIENCE), Some(since + PATIENCE.write));
        drop(part);
        assert!(line.waits_since() > Some(since));
        assert_eq!(line.state().requests.len(), 0);
    }
}

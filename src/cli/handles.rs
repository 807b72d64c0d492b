//! How many file handles there are, and how many connections they allow.

use std::num::NonZeroUsize;

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// Connections that the operators' listener serves at one time.
pub const OPERATORS: NonZeroUsize = NonZeroUsize::new(64).unwrap();
/// Handles for everything else: listeners, those accepted that wait, files, the collector, and some that
/// are only used for a moment.
const OTHERS: usize = 64;

/// The connections of callers that may be served at one time: those `wanted`, or as many as file handles
/// allow beside the operators' and the service's own. Raises the limit of handles as far as it may be.
pub fn connections(wanted: NonZeroUsize) -> NonZeroUsize {
    let limit = raise();
    let most = limit.map_or(wanted, |limit| allowed(wanted, limit));
    if most < wanted {
        let limit = limit.unwrap_or_default();
        tracing::warn!(
            "{wanted} connections (max_connections) need more file handles than the {limit} there may \
             be: {most} are served at one time; raise the limit (ulimit -n) or lower max_connections"
        );
    }
    most
}

/// Raises the limit of file handles to the highest that is allowed; the limit then, `None` for any
/// number.
fn raise() -> Option<usize> {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    // where it cannot be raised it stays as it is
    let raised = setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum });
    let limit = if raised.is_ok() { maximum } else { current };
    limit.map(|limit| usize::try_from(limit).unwrap_or(usize::MAX))
}

/// The connections that `limit` handles allow; one at least, and a third where there are very few.
fn allowed(wanted: NonZeroUsize, limit: usize) -> NonZeroUsize {
    let most = limit.saturating_sub(OPERATORS.get() + OTHERS).max(limit / 3);
    NonZeroUsize::new(most).map_or(NonZeroUsize::MIN, |most| most.min(wanted))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn connections_leave_handles_for_the_operators_and_the_service() {
        let allowed = |wanted: usize, limit| allowed(wanted.try_into().unwrap(), limit).get();
        assert_eq!(allowed(1000, 1128), 1000);
        assert_eq!(allowed(1000, 1127), 999);
        assert_eq!(allowed(1000, 256), 128);
        assert_eq!(allowed(1000, 60), 20);
        assert_eq!(allowed(1000, 2), 1);
        assert_eq!(allowed(10, usize::MAX), 10);
    }
}

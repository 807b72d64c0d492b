use crate::segment::Monitor;

/// Points looked at between two looks at whether the work was cancelled.
const WATCHED: usize = 1024;

/// What `items` gives, until `monitor` cancels: then it ends early, and what is made of it is worth nothing.
pub(super) fn watched<'a, T>(
    items: impl Iterator<Item = T> + Clone + 'a,
    monitor: &'a dyn Monitor,
) -> impl Iterator<Item = T> + Clone + 'a {
    let goes_on = move |(k, _): &(usize, T)| k % WATCHED != 0 || !monitor.cancelled();
    items.enumerate().take_while(goes_on).map(|(_, item)| item)
}

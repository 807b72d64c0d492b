use super::Needs;
use crate::formats::{self, BYTES_PER_POINT, Hints};

/// What the head of a cloud says of its size, before anything is unpacked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Announced {
    /// How many points there will be at most.
    pub points: u64,
    /// Bytes that they take in memory beside the upload.
    pub decoded: u64,
}

/// Bytes that a cloud of at most `points` takes in memory beside the upload, for an answer that `needs` so much of it.
pub(super) fn decoded(bytes: &[u8], hints: Hints, points: u64, needs: Needs) -> u64 {
    let read = formats::bytes_read(bytes, hints, points);
    // those that thinning left out are read again, beside the kept ones
    let again = hints.thin.is_some() && needs == Needs::EachPoint;
    read.saturating_add(if again { points.saturating_mul(BYTES_PER_POINT) } else { 0 })
}

/// What a caller may do about a cloud that is too large.
pub(super) fn advice(thin: Option<f64>) -> &'static str {
    match thin {
        Some(_) => "take a larger thin",
        None => "give thin=LENGTH, or thin it out before",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_cloud_takes_what_is_kept_and_all_points_where_each_is_told_of() {
        let line = |k: u32| format!("{} {} 0\n", k % 100, k / 100);
        let text: String = (0..10_000).map(line).collect();
        let taken = |thin, needs| {
            decoded(text.as_bytes(), Hints { thin, ..Hints::default() }, 10_000, needs)
        };
        assert_eq!(taken(None, Needs::Nothing), 240_000);
        assert_eq!(taken(None, Needs::EachPoint), 240_000);
        let kept = |length| {
            let hints = Hints { thin: Some(length), ..Hints::default() };
            formats::read(text.as_bytes(), hints, &formats::Limits::default()).unwrap().points.len()
                as u64
        };
        let few = kept(9.5);
        assert!((20..200).contains(&few), "{few}");
        assert_eq!(taken(Some(9.5), Needs::Nothing), 80_000 + 24 * few);
        assert_eq!(taken(Some(9.5), Needs::EachPoint), 320_000 + 24 * few);
        // a form that is read whole before
        let off = format!("OFF\n10000 0 0\n{text}");
        let hints = Hints { thin: Some(9.5), ..Hints::default() };
        assert_eq!(decoded(off.as_bytes(), hints, 10_000, Needs::Cloud), 320_000);
    }
}

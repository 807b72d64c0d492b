//! How the cloud was sampled, and where that limits the answer.

use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::prepare::sampling::{Pattern, Sampled};
use crate::segment::prepare::steps::rounding;
use crate::segment::{Sampling, SamplingKind, Warning};

constants! {
    /// Share of the noise that rounding of the coordinates makes up, from which on it is told.
    ROUNDED: f64 = 0.5, Trial(0.5, 0.5);
    /// Spacing across rows over that along them from which on faces between the rows are told of.
    FAR_APART: f64 = 3.0, Derived("16 neighbours no longer span three rows");
}

/// The sampling in the contract's terms.
pub fn told(sampled: &Sampled) -> Sampling {
    let kind = match sampled.pattern {
        Pattern::Scattered => SamplingKind::Scattered,
        Pattern::ScanLines => SamplingKind::ScanLines,
        Pattern::Grid => SamplingKind::Grid,
        Pattern::Lattice => SamplingKind::Lattice,
    };
    let Sampled { along, across, steps, .. } = *sampled;
    Sampling { kind, along, across, steps }
}

/// What of the input limits the answer. `noise` is that of the points.
pub fn warnings(sampled: &Sampled, noise: f64) -> Vec<Warning> {
    let Sampled { along, across, steps, .. } = *sampled;
    let mut out = Vec::new();
    let mut warn = |code: &str, message: String| {
        out.push(Warning { code: code.to_owned(), message });
    };
    let far_apart = FAR_APART.get() * along;
    let are_rows_apart = sampled.pattern == Pattern::ScanLines && across > far_apart;
    if are_rows_apart {
        warn(
            "rows_apart",
            format!(
                "points lie on rows {across:.3e} apart, {along:.3e} from each other along them: faces narrower \
                 than three rows are not found"
            ),
        );
    }
    let diagonal = Vec3::repeat(1.0).normalize();
    // a step so much longer than points of a row are apart is that from row to row, and rounds nothing
    let steps = steps.map(|step| if are_rows_apart && step > far_apart { 0.0 } else { step });
    if noise > 0.0 && rounding(&steps, &diagonal) > ROUNDED.get() * noise {
        let [x, y, z] = steps;
        warn(
            "coordinate_steps",
            format!(
                "coordinates come in steps of {x:.3e}, {y:.3e}, {z:.3e}, as coarse as the noise {noise:.3e}: write them \
                 with more digits (double precision, or near the origin)"
            ),
        );
    }
    if along > 0.0 && noise > across.max(along) {
        warn(
            "noise_above_spacing",
            format!("the noise {noise:.3e} is more than the spacing {along:.3e} of the points"),
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_limits_the_answer_is_told() {
        let even =
            Sampled { pattern: Pattern::Scattered, along: 1.0, across: 1.5, steps: [0.0; 3] };
        let codes = |s: &Sampled, noise: f64| -> Vec<String> {
            warnings(s, noise).into_iter().map(|w| w.code).collect()
        };
        assert!(codes(&even, 0.1).is_empty());
        assert_eq!(codes(&even, 2.0), ["noise_above_spacing"]);
        let rows = Sampled { pattern: Pattern::ScanLines, across: 8.0, ..even };
        assert_eq!(codes(&rows, 0.1), ["rows_apart"]);
        let steps = Sampled { steps: [0.25; 3], ..even };
        assert_eq!(codes(&steps, 0.1), ["coordinate_steps"]);
        // rings about z
        let rings = Sampled { steps: [1e-4, 1e-4, 8.0], ..rows };
        assert_eq!(codes(&rings, 0.1), ["rows_apart"]);
        let rounded = Sampled { steps: [0.25, 0.25, 8.0], ..rows };
        assert_eq!(codes(&rounded, 0.1), ["rows_apart", "coordinate_steps"]);
        assert_eq!(told(&rows).kind, SamplingKind::ScanLines);
    }
}

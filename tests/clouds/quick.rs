//! A small set of clouds, a second in all, on which every mechanism of the engine works.

use super::{Cloud, cad, score::Score, smooth};

/// Machined parts: name, points, noise, whether posed at random.
const PARTS: [(&str, usize, f64, bool); 7] = [
    ("bracket", 30_000, 0.01, true),
    ("pockets", 15_000, 0.01, false),
    ("flange", 30_000, 0.02, true),
    ("tee", 15_000, 0.05, true),
    ("lever", 15_000, 0.01, true),
    ("mould", 15_000, 0.0, false),
    ("clevis", 15_000, 0.02, true),
];

/// The clouds.
pub fn clouds() -> Vec<Cloud> {
    let smooth =
        ["chain3_outliers", "wave5_poor", "noise_box", "torus"].map(|n| smooth::make(n, 1));
    let sized = [("scene", 20_000), ("part", 15_000)].map(|(kind, n)| smooth::sized(kind, n, 1));
    let parts = PARTS.map(|(name, n, sigma, posed)| cad::make(name, 1, n, sigma, posed));
    smooth.into_iter().chain(sized).chain(parts).flatten().collect()
}

/// Whether a result reaches what docs/accuracy.md says of nearly all clouds: a ratio of 0.97, 95 % of the types or all but one,
/// and nothing where there is no quadric.
pub fn is_good(score: &Score) -> bool {
    if score.surfaces == 0 {
        return score.regions == 0;
    }
    let types = 0.95_f64.min(1.0 - 1.0 / score.surfaces as f64);
    score.ratio >= 0.97 && score.type_ok > types - 1e-9
}

//! How exactly a part was made.

use super::directions::weight;
use super::face::Face;
use crate::fit::constant::constants;

constants! {
    /// Scatters that a part may have been made to, in its size, from the first on, each so many times the one before.
    FIRST: f64 = 1e-5, Derived("a micrometre on a decimetre: finer than parts are made");
    /// See there.
    STEP: f64 = 3.0, Effort("scatters tried");
    /// The largest.
    LAST: f64 = 5e-3, Derived("half a millimetre on a decimetre: coarser than castings, and no relation is exact to such");
    /// Natural logarithm of by how much more likely the directions have to be with a scatter than without.
    CLEAR: f64 = 10.0, Trial(5.0, 20.0);
}

/// By how much, in the scene's frame, the faces stand off from where their relations would have them, beyond what the
/// uncertainty of their measurement explains; 0 where that explains all.
///
/// A part that was made and measured is nowhere exactly square. Where its measurement is finer than its making, no relation
/// is compatible with the uncertainties, and yet it is plain which ones are meant: the scatter of the making counts as part of
/// every surface's uncertainty. It is the one under which the directions of all faces, with all that they have in common,
/// are the most likely (empirical Bayes): a larger one lets more relations hold, and makes each a smaller surprise.
pub fn scatter(faces: &[Face], size: f64) -> f64 {
    let with = |scatter: f64| {
        let all: Vec<Face> = faces.iter().map(|f| f.scattered(scatter)).collect();
        weight(&all)
    };
    let mut best = (weight(faces) + CLEAR.get(), 0.0);
    let mut share = FIRST.get();
    while share <= LAST.get() {
        let weight = with(share * size);
        if weight > best.0 {
            best = (weight, share * size);
        }
        share *= STEP.get();
    }
    best.1
}

//! The table of the numbers that the engine decides with.

use crate::fit::constant::{Adjustable, Table};
use crate::segment::{
    discover, family, finish, grow, judge, label, moves, objective, prepare, rcond, report, sample,
};

/// Those of each file, in the order of the rooms.
static FILES: &[Table] = &[
    objective::CONSTANTS,
    sample::CONSTANTS,
    prepare::noise::CONSTANTS,
    prepare::normals::CONSTANTS,
    prepare::residuals::CONSTANTS,
    family::CONSTANTS,
    family::screening::CONSTANTS,
    family::starts::CONSTANTS,
    grow::hypothesis::CONSTANTS,
    grow::search::CONSTANTS,
    grow::start::CONSTANTS,
    label::changes::CONSTANTS,
    label::energy::CONSTANTS,
    label::shares::CONSTANTS,
    moves::CONSTANTS,
    moves::directions::CONSTANTS,
    moves::joint::CONSTANTS,
    moves::merge::CONSTANTS,
    moves::pieces::CONSTANTS,
    moves::planes::CONSTANTS,
    moves::remove::CONSTANTS,
    moves::retype::CONSTANTS,
    moves::rings::CONSTANTS,
    moves::settle::CONSTANTS,
    moves::step::CONSTANTS,
    moves::swap::CONSTANTS,
    moves::trial::CONSTANTS,
    judge::breadth::CONSTANTS,
    judge::form::CONSTANTS,
    judge::one_quadric::CONSTANTS,
    judge::parabola::CONSTANTS,
    judge::stability::CONSTANTS,
    judge::strays::CONSTANTS,
    judge::whiteness::CONSTANTS,
    discover::CONSTANTS,
    discover::further::CONSTANTS,
    discover::noise::CONSTANTS,
    finish::CONSTANTS,
    finish::others::CONSTANTS,
    finish::simplest::CONSTANTS,
    report::constraints::CONSTANTS,
    report::evidence::CONSTANTS,
    report::joints::CONSTANTS,
    report::reasons::CONSTANTS,
    report::uncertainty::CONSTANTS,
    rcond::CONSTANTS,
    rcond::candidate::CONSTANTS,
    rcond::extract::CONSTANTS,
    rcond::grow::growth::CONSTANTS,
    rcond::grow::near_marker::CONSTANTS,
    rcond::grow::neighbours::CONSTANTS,
    rcond::grow::region::CONSTANTS,
    rcond::merge::CONSTANTS,
    rcond::refine::CONSTANTS,
    rcond::surface::CONSTANTS,
    crate::fit::covariance::CONSTANTS,
    crate::fit::general::CONSTANTS,
    crate::fit::least_squares::CONSTANTS,
    crate::fit::retraction::CONSTANTS,
];

/// Every number that the engine decides with.
pub fn constants() -> impl Iterator<Item = &'static dyn Adjustable> {
    FILES.iter().copied().flatten().copied()
}

use crate::fit::Condition;

/// Points a region takes without a test: with nine or fewer S is singular whatever they are.
pub const UNTESTED: usize = 9;

/// The seed's criterion: a point joins while rcond(S) with it stays below a threshold.
///
/// rcond is the 1-norm one of raw coordinates, so the threshold depends on the unit and on the
/// distance from the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RcondBelow(pub f64);

impl RcondBelow {
    /// Whether the set that makes `condition` is near enough to one quadric.
    pub fn accepts(&self, condition: &Condition) -> bool {
        condition.scatter().count() <= UNTESTED as f64 || condition.rcond() < self.0
    }
}

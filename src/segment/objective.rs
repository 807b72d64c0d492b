//! What things cost, and what counts as chance, few and most: the numbers that several rooms decide with.

use crate::fit::constant::constants;

constants! {
    /// A point further than this many sigmas from every candidate stays unassigned.
    pub ACCEPT: f64 = 4.0, Trial(4.0, 4.0);
    /// Energy of one more surface beside its parameters.
    pub SURFACE: f64 = 120.0, Trial(120.0, 120.0);
    /// What an explained point is worth before its residual.
    pub POINT_GAIN: f64 = 6.0, Trial(6.0, 6.0);
    /// What a few points leaked from neighbours may cost or save: they bend a strip.
    pub DOUBT: f64 = 30.0, Trial(30.0, 30.0);
    /// What an edge of the graph between two regions costs. Labels choose the surface that the noise is nearer to: two
    /// surfaces less than the noise apart share a sheet's points between them along a border that winds all over it,
    /// and each fits better than one does.
    pub BORDER: f64 = 0.15, Trial(0.1, 0.2);
    /// Standard deviations that chance does not explain.
    pub SURE: f64 = 3.0, Derived("chance exceeds three standard deviations once in 370");
    /// Standard deviations that chance seldom exceeds.
    pub CHANCE: f64 = 1.5, Trial(1.5, 1.5);
    /// Reduced chi2 up to which a surface explains its points, all but a few leaked ones.
    pub GOOD: f64 = 1.35, Trial(1.35, 1.35);
    /// Mean truncated chi2 above which a surface does not describe a set of points.
    pub SOUND: f64 = 3.0, Trial(3.0, 3.0);
    /// Points that tell a surface where others have told the rest: of a start, of a piece, of what is left.
    pub FEW: usize = 24, Trial(24.0, 24.0);
    /// Points that a surface worth a region has at least, unless regions may have fewer.
    pub ENOUGH: usize = 40, Trial(40.0, 40.0);
    /// Points of each of two surfaces that one was taken for, at least.
    pub ONE_OF_TWO: usize = 100, Trial(100.0, 100.0);
    /// Share of a whole that is but a little of it.
    pub LITTLE: f64 = 0.1, Trial(0.1, 0.1);
    /// Share of a whole that is a good part of it.
    pub PART: f64 = 0.25, Trial(0.25, 0.25);
    /// Share of a whole that is the better part of it.
    pub HALF: f64 = 0.5, Derived("a majority");
    /// Share of a whole that is nearly all of it.
    pub MOST: f64 = 0.8, Trial(0.8, 0.8);
    /// Points further apart than this many spacings do not hang together.
    pub APART: f64 = 3.0, Trial(3.0, 3.0);
    /// Sigmas that a deviation must exceed to show at all.
    pub SLIGHT: f64 = 0.3, Trial(0.3, 0.3);
    /// Correlation of neighbouring residuals beyond chance from which on they go together.
    pub CORRELATED: f64 = 0.05, Trial(0.05, 0.05);
}

/// Energy of a point without a surface: that of one just within reach of it.
#[inline]
pub fn unassigned() -> f64 {
    ACCEPT.get() * ACCEPT.get()
}

/// Cost of one more surface beside its parameters, in units of chi2 / 2.
#[inline]
pub fn surface_cost() -> f64 {
    SURFACE.get() / 2.0
}

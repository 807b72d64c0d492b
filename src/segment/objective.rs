//! What things cost: every price of a description in one place.

use crate::fit::constant::constants;

constants! {
    /// A point further than this many sigmas from every candidate stays unassigned.
    pub ACCEPT: f64 = 4.0, Trial(4.0, 4.0);
    /// Energy of one more surface beside its parameters.
    pub SURFACE: f64 = 120.0, Trial(120.0, 120.0);
    /// Cost of one more surface beside its parameters, in units of chi2 / 2.
    pub SURFACE_COST: f64 = 60.0, Derived("SURFACE in units of chi2 / 2");
    /// What an explained point is worth before its residual.
    pub POINT_GAIN: f64 = 6.0, Trial(6.0, 6.0);
    /// How much worse in BIC a plane may do on one piece where planes do better on all together: a few leaked
    /// points bend a strip.
    pub DOUBT: f64 = 30.0, Trial(30.0, 30.0);
    /// What an edge of the graph between two regions costs. Labels choose the surface that the noise is nearer to: two
    /// surfaces less than the noise apart share a sheet's points between them along a border that winds all over it,
    /// and each fits better than one does.
    pub BORDER: f64 = 0.05, Trial(0.05, 0.05);
}

/// Energy of a point without a surface: that of one just within reach of it.
#[inline]
pub fn unassigned() -> f64 {
    ACCEPT.get() * ACCEPT.get()
}

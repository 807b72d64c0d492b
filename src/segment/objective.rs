//! What things cost: every price of a description in one place.

/// A point further than this many sigmas from every candidate stays unassigned.
pub const ACCEPT: f64 = 4.0;

/// Energy of a point without a surface.
pub const UNASSIGNED: f64 = ACCEPT * ACCEPT;

/// Energy of one more surface beside its parameters.
pub const SURFACE: f64 = 120.0;

/// Cost of one more surface beside its parameters, in units of chi2 / 2.
pub const SURFACE_COST: f64 = 60.0;

/// What an explained point is worth before its residual.
pub const POINT_GAIN: f64 = 6.0;

/// How much worse in BIC a plane may do on one piece where planes do better on all together: a few leaked
/// points bend a strip.
pub const DOUBT: f64 = 30.0;

/// What an edge of the graph between two regions costs. Labels choose the surface that the noise is nearer to: two
/// surfaces less than the noise apart share a sheet's points between them along a border that winds all over it,
/// and each fits better than one does.
pub const BORDER: f64 = 0.05;

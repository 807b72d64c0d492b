//! Chi-squared and normal densities.

use std::f64::consts::{PI, TAU};

/// Probability that the square of a normal vector of `freedom` components, in units of its covariance, is above `x`.
///
/// Abramowitz and Stegun 26.4.4 and 26.4.5; 1 for no components.
pub fn survival(x: f64, freedom: usize) -> f64 {
    if x.is_nan() || x <= 0.0 || freedom == 0 {
        return if x.is_nan() { 0.0 } else { 1.0 };
    }
    let half = x / 2.0;
    let (first, mut term, from) = if freedom % 2 == 0 {
        ((-half).exp(), (-half).exp(), 2)
    } else {
        (libm::erfc(half.sqrt()), (2.0 * x / PI).sqrt() * (-half).exp(), 3)
    };
    let mut sum = first;
    for k in (from..freedom).step_by(2) {
        if freedom % 2 == 0 {
            term *= x / k as f64;
            sum += term;
        } else {
            sum += term;
            term *= x / k as f64;
        }
    }
    if freedom % 2 == 1 && freedom > 1 {
        sum += term;
    }
    sum.min(1.0)
}

/// Logarithm of the normal density of `components` at a squared distance `chi2` from its middle; the last is half the
/// logarithm of its covariance's determinant.
pub fn ln_density(chi2: f64, components: usize, half_ln_det: f64) -> f64 {
    -0.5 * (chi2 + components as f64 * TAU.ln()) - half_ln_det
}

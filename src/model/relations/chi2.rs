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
    let even = freedom.is_multiple_of(2);
    let (first, mut term, from) = if even {
        ((-half).exp(), (-half).exp(), 2)
    } else {
        (libm::erfc(half.sqrt()), (2.0 * x / PI).sqrt() * (-half).exp(), 3)
    };
    let mut sum = first;
    for k in (from..freedom).step_by(2) {
        if even {
            term *= x / k as f64;
            sum += term;
        } else {
            sum += term;
            term *= x / k as f64;
        }
    }
    if !even && freedom > 1 {
        sum += term;
    }
    sum.min(1.0)
}

/// Logarithm of the normal density of `components` at a squared distance `chi2` from its middle; the last is half the
/// logarithm of its covariance's determinant.
pub fn ln_density(chi2: f64, components: usize, half_ln_det: f64) -> f64 {
    -0.5 * (chi2 + components as f64 * TAU.ln()) - half_ln_det
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_survival_is_that_of_tables() {
        // 5 % and 0.1 % points, Abramowitz and Stegun table 26.8
        for (freedom, at_5, at_01) in [
            (1, 3.84146, 10.8276),
            (2, 5.99146, 13.8155),
            (3, 7.81473, 16.2662),
            (10, 18.3070, 29.5883),
            (31, 44.9853, 61.0983),
        ] {
            assert!((survival(at_5, freedom) - 0.05).abs() < 1e-5, "{freedom}");
            assert!((survival(at_01, freedom) - 0.001).abs() < 1e-6, "{freedom}");
        }
        assert_eq!((survival(0.0, 3), survival(5.0, 0), survival(f64::NAN, 2)), (1.0, 1.0, 0.0));
        assert!(survival(1e4, 7) < 1e-300 && survival(900.0, 1000) > 0.98);
    }

    #[test]
    fn the_density_is_that_of_a_normal_vector() {
        let two = ln_density(1.0, 2, 0.5_f64.ln() + 2_f64.ln());
        assert!((two.exp() - (-0.5_f64).exp() / (2.0 * PI)).abs() < 1e-15);
    }
}

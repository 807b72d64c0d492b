//! Student's t.

/// The k for which t with `freedom` degrees of freedom lies within -k..k with probability `coverage`, in 0..1.
pub fn coverage_factor(coverage: f64, freedom: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while within(high, freedom) < coverage && high < 1e12 {
        high *= 2.0;
    }
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if within(middle, freedom) < coverage { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The k for which two independent t of one and the same deviation with `freedom` degrees of freedom lie within a circle of radius k with
/// probability `coverage`, in 0..1: half its square is F with 2 and `freedom` degrees of freedom, whose tail is (1 + k2 / v)^(-v/2).
pub fn planar_factor(coverage: f64, freedom: f64) -> f64 {
    let tail = (-2.0 / freedom * (1.0 - coverage).ln()).exp_m1();
    (freedom * tail).sqrt()
}

/// Probability of |t| < k: 1 - I_x(v/2, 1/2) with x = v / (v + k2).
fn within(k: f64, v: f64) -> f64 {
    1.0 - incomplete_beta(0.5 * v, 0.5, v / (v + k * k), k * k / (v + k * k))
}

/// I_x(a, b), `y` = 1 - x, by Lentz's continued fraction (*Digital Library of Mathematical Functions*, 8.17.22).
fn incomplete_beta(a: f64, b: f64, x: f64, y: f64) -> f64 {
    if x <= 0.0 || y <= 0.0 {
        return if x <= 0.0 { 0.0 } else { 1.0 };
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, y, x);
    }
    let log = libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * x.ln() + b * y.ln();
    let tiny = 1e-300;
    let (mut c, mut d) = (1.0, 1.0 - (a + b) * x / (a + 1.0));
    d = 1.0 / if f64::abs(d) < tiny { tiny } else { d };
    let mut f = d;
    for m in 1..500 {
        let m = f64::from(m);
        for term in [
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        ] {
            d = 1.0 + term * d;
            d = 1.0 / if d.abs() < tiny { tiny } else { d };
            c = 1.0 + term / c;
            c = if f64::abs(c) < tiny { tiny } else { c };
            f *= c * d;
        }
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    log.exp() * f / a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_the_plane_it_is_that_of_many_draws_and_of_rayleigh() {
        // for many degrees of freedom exp(-k2 / 2) is left outside
        let k = planar_factor(0.95, 1e9);
        assert!((k - (-2.0 * 0.05_f64.ln()).sqrt()).abs() < 1e-6, "{k}");
        let mut random = crate::fit::fits::Random::new(2);
        let (freedom, rounds, mut within) = (5, 20_000, 0);
        let k = planar_factor(0.9, 5.0);
        for _ in 0..rounds {
            let sq: f64 = (0..freedom).map(|_| random.normal().powi(2)).sum();
            let deviation = (sq / f64::from(freedom)).sqrt();
            within += usize::from(random.normal().hypot(random.normal()) < k * deviation);
        }
        let share = within as f64 / f64::from(rounds);
        assert!((share - 0.9).abs() < 0.01, "{share}");
    }

    #[test]
    fn it_is_that_of_printed_tables() {
        // ISO/IEC Guide 98-3 (GUM), Table G.2
        for (coverage, freedom, k) in [
            (0.95, 1.0, 12.71),
            (0.9545, 1.0, 13.97),
            (0.95, 5.0, 2.57),
            (0.9545, 10.0, 2.28),
            (0.99, 20.0, 2.85),
            (0.6827, 50.0, 1.01),
        ] {
            let found = coverage_factor(coverage, freedom);
            assert!((found - k).abs() < 0.006, "{coverage} {freedom}: {found}");
        }
        assert!((coverage_factor(0.954_499_736, 1e9) - 2.0).abs() < 1e-6);
    }
}

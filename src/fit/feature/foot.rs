//! The nearest point of an ellipse or an ellipsoid, to machine accuracy.

/// Signed distance from an ellipse (D = 2) or ellipsoid (D = 3) with semi-axes `a`, and the unit normal at the nearest
/// point, `q` being in its frame.
///
/// The nearest point is a_i2 q_i / (a_i2 + t) for the largest root t of sum (a_i q_i / (a_i2 + t))2 = 1 (D. Eberly,
/// *Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid*, 2013). The sum falls and is convex to the right
/// of the last pole, so Newton's steps rise to the root from the left of it. Where several points are nearest
/// it is any of them.
pub fn foot<const D: usize>(a: &[f64; D], q: [f64; D]) -> (f64, [f64; D]) {
    let sq = a.map(|v| v * v);
    let least = (0..D).map(|i| a[i] * q[i].abs() - sq[i]).fold(f64::NEG_INFINITY, f64::max);
    let pole = sq.iter().fold(f64::INFINITY, |m, v| m.min(*v));
    // Near the surface the root is near zero, and Newton's first step from there leads to the left of it.
    let mut t = 0.0_f64.max(least);
    let mut value = 0.0;
    for _ in 0..MOST {
        let mut slope = 0.0;
        value = -1.0;
        for i in 0..D {
            let u = 1.0 / (sq[i] + t).max(f64::MIN_POSITIVE);
            let s = a[i] * q[i] * u;
            value += s * s;
            slope += s * s * u;
        }
        let next = if slope > 0.0 { (t + 0.5 * value / slope).max(least) } else { least };
        let step = (next - t).abs();
        t = next;
        // The next step would be of the square of this one, in units of how far off the pole is.
        if step <= 1e-8 * (pole + t) {
            break;
        }
    }
    if t <= -pole && value < -1e-12 {
        return medial(a, q);
    }
    let v: [f64; D] = std::array::from_fn(|i| q[i] / (sq[i] + t).max(f64::MIN_POSITIVE));
    let norm = v.iter().map(|v| v * v).sum::<f64>().sqrt();
    (t * norm, v.map(|v| v / norm))
}

/// [`foot`] of a place in the plane across the shortest axis that is so near to the centre that two points are as near.
fn medial<const D: usize>(a: &[f64; D], q: [f64; D]) -> (f64, [f64; D]) {
    let shortest = (0..D).min_by(|&i, &j| a[i].total_cmp(&a[j])).unwrap_or(0);
    let mut f: [f64; D] = std::array::from_fn(|i| {
        let apart = a[i] * a[i] - a[shortest] * a[shortest];
        if apart > 0.0 { a[i] * a[i] * q[i] / apart } else { 0.0 }
    });
    let rest: f64 = (0..D).map(|i| (f[i] / a[i]).powi(2)).sum();
    f[shortest] = a[shortest] * (1.0 - rest).max(0.0).sqrt();
    let distance = (0..D).map(|i| (q[i] - f[i]).powi(2)).sum::<f64>().sqrt();
    let n: [f64; D] = std::array::from_fn(|i| f[i] / (a[i] * a[i]));
    let norm = n.iter().map(|v| v * v).sum::<f64>().sqrt();
    (-distance, n.map(|v| v / norm))
}

/// More steps than Newton's iteration takes from anywhere but a pole.
const MOST: usize = 60;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;

    #[test]
    fn no_other_point_is_nearer_and_the_line_to_it_is_the_normal() {
        let mut random = Random::new(5);
        for _ in 0..300 {
            let a = [random.uniform(0.2, 3.0), random.uniform(0.2, 3.0), random.uniform(0.2, 3.0)];
            let q: [f64; 3] = std::array::from_fn(|_| random.uniform(-3.0, 3.0));
            let (d, n) = foot(&a, q);
            let f: [f64; 3] = std::array::from_fn(|i| q[i] - d * n[i]);
            let on: f64 = (0..3).map(|i| (f[i] / a[i]).powi(2)).sum();
            assert!((on - 1.0).abs() < 1e-10, "{a:?} {q:?} {on}");
            for _ in 0..200 {
                let u: [f64; 3] = std::array::from_fn(|_| random.normal());
                let s = (0..3).map(|i| (u[i] / a[i]).powi(2)).sum::<f64>().sqrt();
                let other = (0..3).map(|i| (q[i] - u[i] / s).powi(2)).sum::<f64>().sqrt();
                assert!(other >= d.abs() - 1e-10, "{a:?} {q:?}: {other} {d}");
            }
        }
    }

    #[test]
    fn at_the_centre_it_is_the_end_of_the_shortest_axis() {
        assert_eq!(foot(&[3.0, 2.0], [0.0, 0.0]), (-2.0, [0.0, 1.0]));
        // 9 * 0.5 / 5 = 0.9 along, 2 sqrt(1 - 0.09) across
        let (d, _) = foot(&[3.0, 2.0], [0.5, 0.0]);
        assert!((d + (0.16_f64 + 3.64).sqrt()).abs() < 1e-12, "{d}");
    }
}

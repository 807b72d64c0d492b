//! Steps of a fit along the implicit equation of its surface.
//!
//! A short arc of an ellipse says little about the centre and the semi-axes one by one, but much about how they go
//! together: fits move along a valley that bends in those parameters, and a straight step must be short to stay in
//! it. Hundreds are needed. Distances are F / |grad F| to first order, so in the coefficients of F = 0, scaled such
//! that the gradients keep their size at the points (Taubin's norm), they are nearly linear and the valley nearly
//! straight. A step is the same to first order in either: it is taken in the coefficients, and the surface read
//! off them again (a retraction, in the terms of Absil, Mahony and Sepulchre, *Optimization Algorithms on Matrix
//! Manifolds*, 4.1).

use super::constant::constants;
use super::shape::{Family, Shape};
use crate::geometry::{Mat3, Vec3};

constants! {
    /// The least factor by which one step may scale an equation.
    LEAST_SCALE: f64 = 0.1, Effort("length of one step");
    /// Distance of the points' mean from a cone's axis, over its radius, beyond which they lie to one side of it.
    ONE_SIDE: f64 = 0.5, Trial(0.5, 0.5);
}

/// How the points of a fit, whose mean is zero, are spread.
#[derive(Clone, Copy, Debug)]
pub struct Moments(pub Mat3);

impl Moments {
    /// Means of q and of q q', q the points in the frame of a shape.
    fn about(&self, shape: &Shape) -> (Vec3, Mat3) {
        let mean = -shape.frame.tr_mul(&shape.origin);
        (mean, shape.frame.tr_mul(&(self.0 * shape.frame)) + mean * mean.transpose())
    }
}

/// The shape after a step `delta` of its degrees of freedom, in the order of [`Shape::stepped`], taken in the
/// coefficients of its equation where that is of second degree; that of a cone seen from one side in how it touches its
/// points. `None` where what comes out is not of the family.
pub fn retracted(shape: &Shape, delta: &[f64], moments: &Moments) -> Option<Shape> {
    let three = |from: usize| Vec3::new(delta[from], delta[from + 1], delta[from + 2]);
    match shape.family {
        Family::Plane | Family::Torus => shape.stepped(delta),
        Family::Sphere => round(shape, three(0), delta[3], Vec3::repeat(1.0), moments),
        Family::Cone if is_seen_from_one_side(shape) => touching(shape, delta),
        // Of a cone it is the circle about its origin that moves so.
        Family::Cylinder | Family::Cone => {
            let across = Vec3::new(delta[0], delta[1], 0.0);
            let moved = round(shape, across, delta[4], Vec3::new(1.0, 1.0, 0.0), moments)?;
            let mut rest = [0.0; 6];
            rest[2..4].copy_from_slice(&delta[2..4]);
            rest[5..delta.len().max(5)].copy_from_slice(&delta[5..]);
            moved.stepped(&rest[..delta.len()])
        }
        Family::EllipticCylinder => {
            let across = Vec3::new(delta[0], delta[1], 0.0);
            let spin = Vec3::new(0.0, 0.0, delta[4]);
            let logs = Vec3::new(delta[5], delta[6], 0.0);
            let moved = elliptic::<2>(shape, across, spin, logs, moments)?;
            let tilt = shape.frame * Vec3::new(delta[2], delta[3], 0.0);
            let tilt = moved.frame.tr_mul(&tilt);
            moved.stepped(&[0.0, 0.0, tilt.x, tilt.y, 0.0, 0.0, 0.0])
        }
        Family::Ellipsoid => elliptic::<3>(shape, three(0), three(3), three(6), moments),
    }
}

/// Whether the points of a fit, whose mean is zero, lie to one side of the axis of a cone with its origin beside it.
fn is_seen_from_one_side(cone: &Shape) -> bool {
    cone.origin.norm() > ONE_SIDE.get() * cone.size[0].abs() && cone.size[0] > 0.0
}

/// A cone whose points lie to one side of it.
///
/// They tell where it touches the plane at their middle, how its ruling lies in that plane and how it curves across
/// the ruling: k = cos(angle) / radius; but hardly how fast that curvature falls along the ruling,
/// g = sin(angle) / radius, the inverse of the distance to the apex. In these the valley is straight. In radius, angle
/// and axis it bends, as all of them change along it.
fn touching(shape: &Shape, delta: &[f64]) -> Option<Shape> {
    let [radius, angle, _] = shape.size;
    let axis = shape.w();
    let (out, along) = {
        let spoke = -(shape.origin - axis * shape.origin.dot(&axis));
        let out = spoke.normalize();
        (out, axis.cross(&out))
    };
    let (sin, cos) = angle.sin_cos();
    let (normal, ruling) = (out * cos - axis * sin, out * sin + axis * cos);
    let shift = shape.frame * Vec3::new(delta[0], delta[1], 0.0);
    let tilt = shape.frame * Vec3::new(delta[2], delta[3], 0.0);
    // At the point that touches: how far it rises, how the surface there turns and how its radius changes.
    let rise = (shift.dot(&out) + delta[4]) * cos + radius * tilt.dot(&along) * sin;
    let turn = tilt + along * delta[5] - axis * (shift.dot(&along) / radius);
    let growth = (rise * cos - shift.dot(&out)) / radius;
    let k = (cos - sin * delta[5] - cos * growth) / radius;
    let g = (sin + cos * delta[5] - sin * growth) / radius;
    if k <= 0.0 {
        return None;
    }
    let point = shape.origin + out * radius + normal * rise;
    let rotation = nalgebra::Rotation3::new(turn);
    let [normal, ruling] = [normal, ruling].map(|v| rotation * v);
    let (radius, angle) = (1.0 / k.hypot(g), g.atan2(k));
    let (sin, cos) = angle.sin_cos();
    let (out, axis) = (normal * cos + ruling * sin, ruling * cos - normal * sin);
    let size = [radius, angle, 0.0];
    let moved = Shape::with_axis(Family::Cone, point - out * radius, axis, size);
    moved.is_proper().then_some(moved)
}

/// A sphere, or the circle of a section across an axis: q.q - R2 = 0 over the `axes` that count, moved by `t` and
/// `growth` of the radius.
fn round(shape: &Shape, t: Vec3, growth: f64, axes: Vec3, moments: &Moments) -> Option<Shape> {
    let radius = shape.size[0];
    let (mean, products) = moments.about(shape);
    // Gradients are 2 q, and change by -2 t.
    let scale = 1.0 + t.dot(&mean) / products.diagonal().dot(&axes);
    if !scale.is_finite() || scale < LEAST_SCALE.get() {
        return None;
    }
    let centre = t / scale;
    let sq = radius * radius + 2.0 * radius * growth / scale + centre.norm_squared();
    let mut moved = *shape;
    moved.origin += shape.frame * centre;
    moved.size[0] = sq.sqrt().copysign(radius);
    moved.is_proper().then_some(moved)
}

/// An ellipsoid (D = 3), or the ellipse of a section across an axis (D = 2): q'Sq - 1 = 0 with S the inverse squares
/// of the semi-axes, moved by `t`, turned by `r` and its semi-axes multiplied by the exponentials of `logs`.
fn elliptic<const D: usize>(
    shape: &Shape,
    t: Vec3,
    r: Vec3,
    logs: Vec3,
    moments: &Moments,
) -> Option<Shape> {
    let inverse_sq = |i: usize| if i < D { shape.size[i].powi(-2) } else { 0.0 };
    let s = Mat3::from_diagonal(&Vec3::from_fn(|i, _| inverse_sq(i)));
    let turn = r.cross_matrix();
    let quadratic = turn * s - s * turn - 2.0 * Mat3::from_diagonal(&logs) * s;
    let linear = -2.0 * (s * t);
    let (mean, products) = moments.about(shape);
    let (at, gradient) = (s * mean, s * products);
    let change = 4.0 * (gradient * quadratic).trace() + 2.0 * linear.dot(&at);
    let scale = 1.0 - change / (4.0 * (gradient * s).trace());
    if !scale.is_finite() || scale < LEAST_SCALE.get() {
        return None;
    }
    let (values, axes) = principal::<D>(&(s * scale + quadratic));
    let slopes = axes.tr_mul(&linear);
    let mut centre = Vec3::zeros();
    let mut constant = scale;
    for i in 0..D {
        centre[i] = -0.5 * slopes[i] / values[i];
        constant -= 0.5 * slopes[i] * centre[i];
    }
    let mut moved = *shape;
    moved.origin += shape.frame * (axes * centre);
    moved.frame = shape.frame * axes;
    for i in 0..D {
        moved.size[i] = (constant / values[i]).sqrt();
    }
    moved.is_proper().then_some(moved)
}

/// Eigenvalues and a right-handed frame of eigenvectors; with D = 2 those across the third axis, which stays.
fn principal<const D: usize>(m: &Mat3) -> (Vec3, Mat3) {
    if D == 3 {
        let eigen = m.symmetric_eigen();
        let mut axes = eigen.eigenvectors;
        if axes.determinant() < 0.0 {
            axes.column_mut(2).neg_mut();
        }
        return (eigen.eigenvalues, axes);
    }
    let (mid, half, off) =
        (0.5 * (m[(0, 0)] + m[(1, 1)]), 0.5 * (m[(0, 0)] - m[(1, 1)]), m[(0, 1)]);
    let (sin, cos) = (0.5 * off.atan2(half)).sin_cos();
    let apart = half.hypot(off);
    let axes = Mat3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    (Vec3::new(mid + apart, mid - apart, 0.0), axes)
}

#[cfg(test)]
mod tests {
    use super::super::fits::{Random, shapes};
    use super::super::least_squares::{Options, fit};
    use super::*;

    const SPREAD: Moments = Moments(Mat3::new(2.0, 0.3, 0.1, 0.3, 1.0, 0.2, 0.1, 0.2, 0.5));

    #[test]
    fn to_first_order_it_is_the_straight_step() {
        let mut random = Random::new(7);
        for s in shapes() {
            for _ in 0..20 {
                let direction: Vec<f64> =
                    (0..s.family.dof()).map(|_| random.uniform(-1.0, 1.0)).collect();
                let x = s.origin + Vec3::new(4.0, 3.0, 1.0);
                let foot = x - s.offset(&x).normal * s.offset(&x).distance;
                let apart = |h: f64| {
                    let delta: Vec<f64> = direction.iter().map(|d| d * h).collect();
                    let [a, b] = [retracted(&s, &delta, &SPREAD), s.stepped(&delta)];
                    (a.unwrap().distance(&foot) - b.unwrap().distance(&foot)).abs()
                };
                // What is of second order falls a hundredfold with the step.
                assert!(apart(1e-3) < 1e-4, "{s:?} {}", apart(1e-3));
                assert!(apart(1e-4) < 1e-6, "{s:?} {}", apart(1e-4));
            }
        }
    }

    #[test]
    fn a_step_out_of_the_family_is_none() {
        let ellipse = shapes()[4];
        // The long axis would shrink through zero curvature to that of a hyperbola.
        let delta = [0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0];
        assert!(retracted(&ellipse, &delta, &SPREAD).is_none());
    }

    #[test]
    fn a_short_arc_of_an_ellipse_is_fitted_in_few_steps_from_far_along_its_valley() {
        const SIGMA: f64 = 0.02;
        let mut random = Random::new(5);
        let truth = Shape {
            family: Family::EllipticCylinder,
            origin: Vec3::zeros(),
            frame: Mat3::identity(),
            size: [10.0, 5.5, 0.0],
        };
        let points: Vec<Vec3> = (0..4000)
            .map(|_| {
                let t = random.uniform(0.55, 2.05);
                let on = Vec3::new(10.0 * t.cos(), 5.5 * t.sin(), random.uniform(-20.0, 20.0));
                on + truth.offset(&on).normal * (SIGMA * random.normal())
            })
            .collect();
        let fitted = |start: &Shape, steps: usize| {
            let options = Options { cauchy: None, steps, tolerance: 0.0 };
            fit(start, &points, None, &options).unwrap()
        };
        let best = fitted(&truth, 100);
        // Fits of fixed semi-axes lie in the valley: those of a longer ellipse hardly fit worse.
        let far = Shape { origin: Vec3::new(0.0, -4.1, 0.0), size: [17.0, 9.6, 0.0], ..truth };
        let chi2 = |mean_sq: f64| 4000.0 * mean_sq / (SIGMA * SIGMA);
        assert!(chi2(fitted(&far, 2).mean_sq) > chi2(best.mean_sq) + 100.0);
        let found = fitted(&far, 20);
        assert!(chi2(found.mean_sq) < chi2(best.mean_sq) + 1e-3, "{found:?} {best:?}");
        assert!((found.shape.size[0] - best.shape.size[0]).abs() < 0.01, "{found:?} {best:?}");
    }

    #[test]
    fn a_small_patch_of_a_cone_is_fitted_in_few_steps_from_a_cylinder() {
        let mut random = Random::new(6);
        let truth = Shape::with_axis(Family::Cone, Vec3::zeros(), Vec3::z(), [23.0, 0.4, 0.0]);
        for side in [1.0, 3.0, 10.0] {
            let points: Vec<Vec3> = (0..100)
                .map(|_| {
                    let (t, z) =
                        (random.uniform(-0.5, 0.5) * side / 23.0, random.uniform(-0.5, 0.5));
                    let radius = 23.0 + side * z * 0.4_f64.tan();
                    Vec3::new(radius * t.cos(), radius * t.sin(), side * z)
                })
                .collect();
            // The cylinder that touches in the middle; the other sign has the apex on its other side.
            let radius = 23.0 / 0.4_f64.cos();
            let ruling = Vec3::new(0.4_f64.sin(), 0.0, 0.4_f64.cos());
            let normal = Vec3::new(0.4_f64.cos(), 0.0, -0.4_f64.sin());
            let axis = Vec3::new(23.0, 0.0, 0.0) - normal * radius;
            for angle in [0.05, -0.05] {
                let start = Shape::with_axis(Family::Cone, axis, ruling, [radius, angle, 0.0]);
                let options = Options { cauchy: None, steps: 20, tolerance: 0.0 };
                let found = fit(&start, &points, None, &options).unwrap().shape;
                assert!((found.size[1].abs() - 0.4).abs() < 1e-6, "{side} {angle}: {found:?}");
                let worst =
                    |s: &Shape| points.iter().map(|p| s.distance(p).abs()).fold(0.0, f64::max);
                assert!(worst(&found) < 1e-9 && worst(&truth) < 1e-9, "{side} {angle}: {found:?}");
            }
        }
    }
}

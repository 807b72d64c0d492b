//! Starts from points alone: no normals, no neighbours, as few points as determine a feature.

use std::f64::consts::{PI, TAU};

use super::fixed::Fixed;
use super::kasa::{cylinder, kasa};
use super::kind::FeatureType;
use super::pose::Pose;
use super::rows::Gauge;
use super::tori::tori;
use crate::fit::local_quadric::LocalQuadrics;
use crate::fit::{Shape, starts};
use crate::geometry::{Mat3, Vec3, perpendicular_frame};

/// Directions that are looked along: neighbours are about 0.2 rad apart, and fits find their way over half of that.
const DIRECTIONS: usize = 120;
/// Starts that are kept, and the least angle between the axes of two.
const KEPT: (usize, f64) = (8, 0.3);

/// Points that each of many directions is judged on.
const FEW: usize = 24;

/// Starts of a feature of `points`, which are centred and of about unit size, the most promising first.
pub fn starts_of(kind: FeatureType, points: &[Vec3], fixed: &Fixed) -> Vec<Pose> {
    let principal = principal(points);
    let few = thinned(points, FEW);
    let axes = || -> Vec<Vec3> {
        match fixed.axis {
            Some(axis) => vec![axis],
            None => principal.iter().copied().chain(directions(DIRECTIONS)).collect(),
        }
    };
    let found: Vec<Pose> = match kind {
        FeatureType::Plane => {
            let w = fixed.axis.unwrap_or(principal[0]);
            vec![Pose::with_axis(kind, Vec3::zeros(), w, [0.0; 3])]
        }
        FeatureType::Line => {
            let w = fixed.axis.unwrap_or(principal[2]);
            vec![Pose::with_axis(kind, Vec3::zeros(), w, [0.0; 3])]
        }
        FeatureType::Circle => {
            let normals = fixed.axis.map_or(principal.to_vec(), |axis| vec![axis]);
            normals.iter().filter_map(|w| circle(points, w)).collect()
        }
        FeatureType::Sphere => sphere(points).into_iter().collect(),
        FeatureType::Cylinder => axes().iter().filter_map(|w| cylinder(&few, w)).collect(),
        FeatureType::Cone => axes().iter().flat_map(|w| cones(&few, w)).collect(),
        FeatureType::EllipticCylinder => {
            axes().iter().flat_map(|w| elliptic_cylinders(&few, w)).collect()
        }
        FeatureType::Torus => tori(&few, &axes()),
        FeatureType::Ellipsoid => ellipsoids(points, &principal),
    };
    let found = found.into_iter().map(|pose| fixed.applied(&pose)).filter(Pose::is_proper);
    apart(found, &few)
}

/// Some of the points, evenly.
pub fn thinned(points: &[Vec3], most: usize) -> Vec<Vec3> {
    let n = points.len();
    if n <= most {
        return points.to_vec();
    }
    // A stride that has no common factor with rows of a grid: steps of the golden section.
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    (0..most).map(|k| points[((k as f64 * golden).fract() * n as f64) as usize]).collect()
}

/// The most promising starts whose axes are apart.
fn apart(starts: impl Iterator<Item = Pose>, points: &[Vec3]) -> Vec<Pose> {
    let mut scored: Vec<(f64, Pose)> = starts
        .map(|pose| {
            let squares = match pose.shape() {
                // An exact distance from an ellipse takes long, and here one of second order will do.
                Some(shape) => points.iter().map(|x| shape.distance(x).powi(2)).sum::<f64>(),
                None => {
                    let gauge = Gauge::of(&pose);
                    points.iter().map(|x| gauge.distance(x).powi(2)).sum()
                }
            };
            (squares, pose)
        })
        .filter(|(cost, _)| cost.is_finite())
        .collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut kept: Vec<Pose> = Vec::new();
    for (_, pose) in scored {
        let is_near = |other: &Pose| match pose.kind {
            FeatureType::Sphere | FeatureType::Ellipsoid => false,
            _ => other.w().cross(&pose.w()).norm() < KEPT.1,
        };
        // Two of one direction may be of different sizes.
        if kept.iter().filter(|other| is_near(other)).count() < 2 {
            kept.push(pose);
        }
        if kept.len() == KEPT.0 {
            break;
        }
    }
    kept
}

/// Unit directions spread evenly over half of the sphere (Fibonacci's lattice).
pub fn directions(count: usize) -> impl Iterator<Item = Vec3> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |k| {
        let z = (k as f64 + 0.5) / count as f64;
        let (sin, cos) = (golden * k as f64).rem_euclid(TAU).sin_cos();
        let rho = (1.0 - z * z).sqrt();
        Vec3::new(rho * cos, rho * sin, z)
    })
}

/// Directions in which the points are spread, the least spread first.
pub fn principal(points: &[Vec3]) -> [Vec3; 3] {
    let mean = points.iter().sum::<Vec3>() / points.len() as f64;
    let m = points.iter().fold(Mat3::zeros(), |m, p| m + (p - mean) * (p - mean).transpose());
    let e = m.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| e.eigenvalues[a].total_cmp(&e.eigenvalues[b]));
    order.map(|i| e.eigenvectors.column(i).into_owned())
}

fn circle(points: &[Vec3], w: &Vec3) -> Option<Pose> {
    let (u, v) = perpendicular_frame(w);
    let (c, r) = kasa(points.iter().map(|p| [p.dot(&u), p.dot(&v)]))?;
    let mean = points.iter().sum::<Vec3>() / points.len() as f64;
    let origin = u * c[0] + v * c[1] + w * mean.dot(w);
    Some(Pose::with_axis(FeatureType::Circle, origin, *w, [r, 0.0, 0.0]))
}

/// The sphere q.q = 2 c.q + k of least squares, and Taubin's.
fn sphere(points: &[Vec3]) -> Vec<Pose> {
    let mut found: Vec<Pose> = starts::sphere(points).iter().map(Pose::of).collect();
    let n = points.len() as f64;
    let mean = points.iter().sum::<Vec3>() / n;
    let sq = points.iter().map(|p| (p - mean).norm_squared()).sum::<f64>() / n;
    let (mut m, mut b) = (Mat3::zeros(), Vec3::zeros());
    for p in points {
        let q = p - mean;
        m += q * q.transpose();
        b += q * (q.norm_squared() - sq);
    }
    if let Some(c) = m.try_inverse().map(|inverse| 0.5 * inverse * b) {
        let size = [(sq + c.norm_squared()).sqrt(), 0.0, 0.0];
        found.push(Pose::with_axis(FeatureType::Sphere, mean + c, Vec3::z(), size));
    }
    found
}

/// Cones about `w`: x2 + y2 = 2 a x + 2 b y + A z2 + B z + C with A = t2, B = 2 r t, C = r2 - a2 - b2, t the tangent of
/// the half angle and r the radius at z = 0, is linear; what A and B say of t may differ.
fn cones(points: &[Vec3], w: &Vec3) -> Vec<Pose> {
    let (u, v) = perpendicular_frame(w);
    let mut m = nalgebra::SMatrix::<f64, 5, 5>::zeros();
    let mut b = nalgebra::SVector::<f64, 5>::zeros();
    for p in points {
        let (x, y, z) = (p.dot(&u), p.dot(&v), p.dot(w));
        let row = [2.0 * x, 2.0 * y, z * z, z, 1.0];
        for k in 0..5 {
            b[k] += row[k] * (x * x + y * y);
            for l in 0..=k {
                m[(k, l)] += row[k] * row[l];
            }
        }
    }
    m.fill_upper_triangle_with_lower_triangle();
    let Some(s) = m.lu().solve(&b) else { return Vec::new() };
    let (x, y) = (s[0], s[1]);
    let radius = (s[4] + x * x + y * y).max(0.0).sqrt();
    let slope = s[2].max(0.0).sqrt().copysign(s[3]);
    let other = if radius > 0.0 { 0.5 * s[3] / radius } else { slope };
    // A cone whose apex lies beside the points has its radius there from A and B.
    let wide = if slope.abs() > 0.1 { Some((0.5 * s[3] / slope, slope)) } else { None };
    let pairs = [Some((radius, slope)), Some((radius, other)), wide];
    let cone = |(r, t): (f64, f64)| {
        let size = [r, t.atan(), 0.0];
        Pose::with_axis(FeatureType::Cone, u * x + v * y, *w, size)
    };
    pairs.into_iter().flatten().map(cone).collect()
}

/// Ellipses across `w`: the direct one, and a circle that is nearly one.
fn elliptic_cylinders(points: &[Vec3], w: &Vec3) -> Vec<Pose> {
    let direct = starts::elliptic_cylinder(points, w).map(|s: Shape| Pose::of(&s));
    let round = cylinder(points, w).map(|pose| {
        let r = pose.size[0];
        Pose { kind: FeatureType::EllipticCylinder, size: [1.1 * r, 0.9 * r, 0.0], ..pose }
    });
    direct.into_iter().chain(round).collect()
}

/// Taubin's and Li and Griffiths' ellipsoids, and a sphere that is nearly one.
fn ellipsoids(points: &[Vec3], principal: &[Vec3; 3]) -> Vec<Pose> {
    let quadrics = LocalQuadrics::of(points);
    let taubin = quadrics.taubin().and_then(|q| q.ellipsoid());
    let specific = quadrics.specific().and_then(|q| q.ellipsoid());
    let mut found: Vec<Pose> = taubin.iter().chain(&specific).map(Pose::of).collect();
    let mut frame = Mat3::from_columns(principal);
    if frame.determinant() < 0.0 {
        frame.column_mut(0).neg_mut();
    }
    for ball in sphere(points) {
        let r = ball.size[0];
        for by in [[0.8, 1.0, 1.2], [1.2, 1.0, 0.8]] {
            let size = by.map(|k| k * r);
            found.push(Pose { kind: FeatureType::Ellipsoid, frame, size, ..ball });
        }
    }
    found
}

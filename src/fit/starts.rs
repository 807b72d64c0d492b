//! Starts for the orthogonal fits: every family from points and unsigned normals, without iteration.
//!
//! Sources: Taubin's circle, sphere and quadric, Fitzgibbon's ellipse in Halir's reduced form, Li and
//! Griffiths' ellipsoid (k = 4), the linear complex of the normals for a surface of revolution.

use nalgebra::{Matrix2, SMatrix, SVector, SymmetricEigen, Vector2};

use super::constrained::constrained_minimiser;
use super::eigen::smallest;
use super::local_quadric::LocalQuadric;
use super::scaled::Scaled;
use super::shape::{Family, Shape};
use crate::geometry::{Mat3, Vec3, perpendicular_frame};

/// Points and their unsigned unit normals.
#[derive(Clone, Copy, Debug)]
pub struct Patch<'a> {
    /// The points.
    pub points: &'a [Vec3],
    /// A unit normal for each point; its sign means nothing.
    pub normals: &'a [Vec3],
}

/// Eigenvectors of a symmetric 3 x 3 matrix as columns, by rising eigenvalue.
fn eigen3(m: &Mat3) -> ([f64; 3], [Vec3; 3]) {
    let e = SymmetricEigen::new(*m);
    let mut k = [0, 1, 2];
    k.sort_by(|&a, &b| e.eigenvalues[a].total_cmp(&e.eigenvalues[b]));
    (k.map(|i| e.eigenvalues[i]), k.map(|i| e.eigenvectors.column(i).into_owned()))
}

fn covariance(points: impl Iterator<Item = Vec3> + Clone) -> (Vec3, Mat3) {
    let n = points.clone().count() as f64;
    let mean = points.clone().sum::<Vec3>() / n;
    let m = points.fold(Mat3::zeros(), |m, p| m + (p - mean) * (p - mean).transpose());
    (mean, m / n)
}

/// The total least-squares plane.
pub fn plane(points: &[Vec3]) -> Option<Shape> {
    let (mean, m) = covariance(points.iter().copied());
    let (_, v) = eigen3(&m);
    Some(Shape::with_axis(Family::Plane, mean, v[0], [0.0; 3]))
}

/// Taubin's algebraic sphere; Kasa's closes a shallow cap whose noise comes to a good part of its height.
pub fn sphere(points: &[Vec3]) -> Option<Shape> {
    let s = Scaled::of(points);
    let (c, r) = round::<3, 4>(points.iter().map(|p| s.to(p)))?;
    let origin = s.centroid + c * s.scale;
    let shape = Shape::with_axis(Family::Sphere, origin, Vec3::z(), [r * s.scale, 0.0, 0.0]);
    shape.is_proper().then_some(shape)
}

/// Centre and radius of the circle (D = 2) or sphere (D = 3) a |q|2 + b.q + c = 0 that minimises the sum of squares
/// over that of its gradients' squares (Taubin 1991); E = D + 1.
fn round<const D: usize, const E: usize>(
    points: impl Iterator<Item = SVector<f64, D>> + Clone,
) -> Option<(SVector<f64, D>, f64)> {
    let n = points.clone().count() as f64;
    let mean = points.clone().sum::<SVector<f64, D>>() / n;
    let sq_mean = points.clone().map(|q| (q - mean).norm_squared()).sum::<f64>() / n;
    let unit = 2.0 * sq_mean.sqrt();
    // Points of one place have none: of a line, seen along it.
    if !unit.is_normal() {
        return None;
    }
    let mut m = SMatrix::<f64, E, E>::zeros();
    for q in points {
        let q = q - mean;
        let f = SVector::<f64, E>::from_fn(|i, _| {
            if i < D { q[i] } else { (q.norm_squared() - sq_mean) / unit }
        });
        m += f * f.transpose();
    }
    let least = smallest(&m)?;
    let a = least[D] / unit;
    let centre = SVector::<f64, D>::from_fn(|i, _| -0.5 * least[i] / a);
    let radius = (sq_mean + centre.norm_squared()).sqrt();
    radius.is_finite().then(|| (mean + centre, radius))
}

/// The direct ellipse: centre, unit directions, semi-axes.
fn ellipse(points: &[Vector2<f64>]) -> Option<(Vector2<f64>, Matrix2<f64>, [f64; 2])> {
    let mut s1 = Mat3::zeros();
    let mut s2 = Mat3::zeros();
    let mut s3 = Mat3::zeros();
    for q in points {
        let d1 = Vec3::new(q.x * q.x, q.x * q.y, q.y * q.y);
        let d2 = Vec3::new(q.x, q.y, 1.0);
        s1 += d1 * d1.transpose();
        s2 += d1 * d2.transpose();
        s3 += d2 * d2.transpose();
    }
    let t = s3.cholesky()?.inverse() * s2.transpose();
    let m = s1 - s2 * t;
    let c = Mat3::new(0.0, 0.0, 2.0, 0.0, -1.0, 0.0, 2.0, 0.0, 0.0);
    let a1 = constrained_minimiser(&m, &c)?;
    let a2 = -t * a1;
    let q = Matrix2::new(a1[0], a1[1] / 2.0, a1[1] / 2.0, a1[2]);
    let centre = -q.try_inverse()? * Vector2::new(a2[0], a2[1]) / 2.0;
    let value = (q * centre).dot(&centre) + a2[0] * centre.x + a2[1] * centre.y + a2[2];
    let e = SymmetricEigen::new(q / -value);
    let sizes = [e.eigenvalues[0], e.eigenvalues[1]].map(|l| 1.0 / l.sqrt());
    sizes.iter().all(|s| s.is_finite() && *s > 0.0).then_some((centre, e.eigenvectors, sizes))
}

/// Directions that could be the axis of a cylinder through the patch.
pub fn cylinder_axes(patch: &Patch<'_>, quadric: Option<&LocalQuadric>) -> Vec<Vec3> {
    let m = patch.normals.iter().fold(Mat3::zeros(), |m, n| m + n * n.transpose());
    let mut axes = vec![eigen3(&m).1[0]];
    // A strip has no normals to speak of, but lies along its axis.
    let (spread, directions) = eigen3(&covariance(patch.points.iter().copied()).1);
    if spread[2] > 9.0 * spread[1] {
        axes.push(directions[2]);
    }
    if let Some(q) = quadric {
        let e = SymmetricEigen::new(q.e);
        let k = e.eigenvalues.iamin();
        axes.push(e.eigenvectors.column(k).into_owned());
    }
    axes
}

/// Circular cylinder about the direction `w`.
pub fn cylinder(points: &[Vec3], w: &Vec3) -> Option<Shape> {
    let s = Scaled::of(points);
    let (u, v) = perpendicular_frame(w);
    let flat: Vec<_> =
        points.iter().map(|p| s.to(p)).map(|q| Vector2::new(q.dot(&u), q.dot(&v))).collect();
    let (c, r) = round::<2, 3>(flat.iter().copied())?;
    let origin = s.centroid + (u * c.x + v * c.y) * s.scale;
    Some(Shape::with_axis(Family::Cylinder, origin, *w, [r * s.scale, 0.0, 0.0]))
        .filter(Shape::is_proper)
}

/// Elliptic cylinder about the direction `w`.
pub fn elliptic_cylinder(points: &[Vec3], w: &Vec3) -> Option<Shape> {
    let s = Scaled::of(points);
    let (u, v) = perpendicular_frame(w);
    let flat: Vec<_> =
        points.iter().map(|p| s.to(p)).map(|q| Vector2::new(q.dot(&u), q.dot(&v))).collect();
    let (c, d, size) = ellipse(&flat)?;
    let origin = s.centroid + (u * c.x + v * c.y) * s.scale;
    let du = u * d[(0, 0)] + v * d[(1, 0)];
    Some(Shape {
        family: Family::EllipticCylinder,
        origin,
        frame: Mat3::from_columns(&[du, w.cross(&du), *w]),
        size: [size[0] * s.scale, size[1] * s.scale, 0.0],
    })
    .filter(Shape::is_proper)
}

/// Cone from n.(x - apex) = 0 and the constant angle of the rulings to the axis.
pub fn cone(patch: &Patch<'_>) -> Option<Shape> {
    let s = Scaled::of(patch.points);
    let (mut a, mut b) = (Mat3::zeros(), Vec3::zeros());
    for (p, n) in patch.points.iter().zip(patch.normals) {
        let nn = n * n.transpose();
        a += nn;
        b += nn * s.to(p);
    }
    let apex = a.cholesky()?.solve(&b);
    if apex.norm() > 1e3 {
        return None;
    }
    let rulings = patch.points.iter().map(|p| (s.to(p) - apex).normalize());
    let (mean, m) = covariance(rulings);
    let mut w = eigen3(&m).1[0];
    if w.dot(&mean) < 0.0 {
        w = -w;
    }
    let half = w.dot(&mean).clamp(-1.0, 1.0).acos();
    let height = -apex.dot(&w);
    let shape = Shape::with_axis(
        Family::Cone,
        s.centroid + (apex + w * height) * s.scale,
        w,
        [height * half.tan() * s.scale, half, 0.0],
    );
    (shape.is_proper() && half > 0.01 && half < 1.54).then_some(shape)
}

/// Torus: axis from the linear complex of the normals (every normal line meets the axis), then the
/// circle of the points in the half-plane through it.
pub fn torus(patch: &Patch<'_>) -> Option<Shape> {
    let s = Scaled::of(patch.points);
    let mut m = SMatrix::<f64, 6, 6>::zeros();
    for (p, n) in patch.points.iter().zip(patch.normals) {
        let moment = s.to(p).cross(n);
        let v = SVector::<f64, 6>::new(moment.x, moment.y, moment.z, n.x, n.y, n.z);
        m += v * v.transpose();
    }
    let e = SymmetricEigen::new(m);
    let mut order: Vec<usize> = (0..6).collect();
    order.sort_by(|&a, &b| e.eigenvalues[a].total_cmp(&e.eigenvalues[b]));
    order
        .iter()
        .take(2)
        .filter_map(|&k| torus_about(&s, patch.points, &e.eigenvectors.column(k).into_owned()))
        .min_by(|a, b| spread(a, patch.points).total_cmp(&spread(b, patch.points)))
}

fn spread(shape: &Shape, points: &[Vec3]) -> f64 {
    points.iter().map(|p| shape.distance(p).powi(2)).sum()
}

fn torus_about(s: &Scaled, points: &[Vec3], complex: &SVector<f64, 6>) -> Option<Shape> {
    let w = Vec3::new(complex[0], complex[1], complex[2]);
    let mu = Vec3::new(complex[3], complex[4], complex[5]);
    let sq = w.norm_squared();
    if sq < 1e-6 {
        return None;
    }
    let foot = w.cross(&mu) / sq;
    let w = w / sq.sqrt();
    let flat: Vec<_> = points
        .iter()
        .map(|p| s.to(p) - foot)
        .map(|q| {
            let h = q.dot(&w);
            Vector2::new((q - h * w).norm(), h)
        })
        .collect();
    let (c, r) = round::<2, 3>(flat.iter().copied())?;
    let origin = s.centroid + (foot + w * c.y) * s.scale;
    let shape = Shape::with_axis(Family::Torus, origin, w, [c.x * s.scale, r * s.scale, 0.0]);
    (shape.is_proper() && c.x < 1e3 && r < 1e3).then_some(shape)
}

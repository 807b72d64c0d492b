//! General quadrics of a patch without iteration: starts of ellipsoids, directions of cylinders.
//!
//! Sources: Taubin 1991; Li and Griffiths 2004 for the ellipsoid (k = 4).

use std::cell::OnceCell;

use multiversion::multiversion;
use nalgebra::{SMatrix, SVector, SymmetricEigen};

use super::columns::LANES;
use super::constrained::constrained_minimiser;
use super::scaled::Scaled;
use super::shape::{Family, Shape};
use crate::geometry::{Mat3, Vec3};

/// A general quadric in the patch's centred and scaled frame.
pub struct LocalQuadric {
    /// Quadratic part.
    pub e: Mat3,
    linear: Vec3,
    constant: f64,
    scaled: Scaled,
}

impl LocalQuadric {
    /// The ellipsoid it is; `None` where its quadratic part is not definite.
    pub fn ellipsoid(&self) -> Option<Shape> {
        let centre = -self.e.try_inverse()? * self.linear / 2.0;
        let value = (self.e * centre + self.linear).dot(&centre) + self.constant;
        let eig = SymmetricEigen::new(self.e / -value);
        let size: [f64; 3] = [0, 1, 2].map(|i| 1.0 / eig.eigenvalues[i].sqrt() * self.scaled.scale);
        if !size.iter().all(|s| s.is_finite() && *s > 0.0) {
            return None;
        }
        let mut frame = eig.eigenvectors;
        if frame.determinant() < 0.0 {
            frame.column_mut(0).neg_mut();
        }
        let origin = self.scaled.centroid + centre * self.scaled.scale;
        Some(Shape { family: Family::Ellipsoid, origin, frame, size })
    }
}

/// Features of a point: x2 y2 z2 xy yz xz x y z.
const FEATURES: usize = 9;

/// Quadrics of some points, each worked out when it is first asked for.
pub struct LocalQuadrics<'a> {
    points: &'a [Vec3],
    sums: OnceCell<Sums>,
    taubin: OnceCell<Option<LocalQuadric>>,
}

impl<'a> LocalQuadrics<'a> {
    /// Those of `points`.
    pub fn of(points: &'a [Vec3]) -> Self {
        Self { points, sums: OnceCell::new(), taubin: OnceCell::new() }
    }

    fn sums(&self) -> &Sums {
        self.sums.get_or_init(|| Sums::of(self.points))
    }

    /// Taubin's: the least sum of squares over that of its gradients' squares.
    pub fn taubin(&self) -> Option<&LocalQuadric> {
        let sums = self.sums();
        let found = || sums.quadric(&constrained_minimiser(&sums.scatter, &sums.gradient())?);
        self.taubin.get_or_init(found).as_ref()
    }

    /// Li and Griffiths' ellipsoid-specific one.
    pub fn specific(&self) -> Option<LocalQuadric> {
        let sums = self.sums();
        let a = sums.scatter.fixed_view::<6, 6>(0, 0).into_owned();
        let b = sums.scatter.fixed_view::<6, 3>(0, 6).into_owned();
        let c = sums.scatter.fixed_view::<3, 3>(6, 6).into_owned();
        let t = c.cholesky()?.inverse() * b.transpose();
        let m = a - b * t;
        // 4 J - I2 in terms of (a, b, c, and twice the mixed terms)
        let k = 4.0;
        let o = k / 2.0 - 1.0;
        let mut con = SMatrix::<f64, 6, 6>::zeros();
        for i in 0..3 {
            for j in 0..3 {
                con[(i, j)] = if i == j { -1.0 } else { o };
            }
            con[(3 + i, 3 + i)] = -k / 4.0;
        }
        let q = constrained_minimiser(&m, &con)?;
        let l = -t * q;
        sums.quadric(&SVector::from_fn(|i, _| if i < 6 { q[i] } else { l[i - 6] }))
    }
}

/// Sums over points in their scaled frame.
pub(super) struct Sums {
    scaled: Scaled,
    n: f64,
    mean: SVector<f64, FEATURES>,
    /// Scatter of the features about their mean.
    pub(super) scatter: SMatrix<f64, FEATURES, FEATURES>,
}

impl Sums {
    fn of(points: &[Vec3]) -> Self {
        Self::within(Scaled::of(points), points)
    }

    /// Those in a given frame.
    pub(super) fn within(scaled: Scaled, points: &[Vec3]) -> Self {
        let (sum, products) = feature_sums(&scaled, points);
        let n = points.len() as f64;
        let mean = SVector::from(sum) / n;
        let about = |i: usize, j: usize| products[i.max(j)][i.min(j)] - n * mean[i] * mean[j];
        Self { scaled, n, mean, scatter: SMatrix::from_fn(about) }
    }

    /// The sum of g_d g_d' over the points and the axes d, g_d the derivatives of the features.
    pub(super) fn gradient(&self) -> SMatrix<f64, FEATURES, FEATURES> {
        let second = &self.mean;
        let (x, y, z) = (second[6], second[7], second[8]);
        let (xx, yy, zz, xy, yz, xz) =
            (second[0], second[1], second[2], second[3], second[4], second[5]);
        let mut g = SMatrix::<f64, FEATURES, FEATURES>::zeros();
        for (i, j, v) in [
            (0, 0, 4.0 * xx),
            (1, 1, 4.0 * yy),
            (2, 2, 4.0 * zz),
            (3, 0, 2.0 * xy),
            (3, 1, 2.0 * xy),
            (4, 1, 2.0 * yz),
            (4, 2, 2.0 * yz),
            (5, 0, 2.0 * xz),
            (5, 2, 2.0 * xz),
            (3, 3, xx + yy),
            (4, 4, yy + zz),
            (5, 5, xx + zz),
            (4, 3, xz),
            (5, 3, yz),
            (5, 4, xy),
            (6, 0, 2.0 * x),
            (7, 1, 2.0 * y),
            (8, 2, 2.0 * z),
            (6, 3, y),
            (7, 3, x),
            (7, 4, z),
            (8, 4, y),
            (6, 5, z),
            (8, 5, x),
            (6, 6, 1.0),
            (7, 7, 1.0),
            (8, 8, 1.0),
        ] {
            (g[(i, j)], g[(j, i)]) = (v * self.n, v * self.n);
        }
        g
    }

    /// The features of a point about their mean.
    pub(super) fn features(&self, p: &Vec3) -> SVector<f64, FEATURES> {
        let Vec3 { data, .. } = self.scaled.to(p);
        let [[x, y, z]] = data.0;
        SVector::from([x * x, y * y, z * z, x * y, y * z, x * z, x, y, z]) - self.mean
    }

    /// The quadric of some coefficients of the features, through the features' mean.
    fn quadric(&self, a: &SVector<f64, FEATURES>) -> Option<LocalQuadric> {
        let half = |i: usize| 0.5 * a[i];
        let e = Mat3::new(a[0], half(3), half(5), half(3), a[1], half(4), half(5), half(4), a[2]);
        let (linear, constant) = (Vec3::new(a[6], a[7], a[8]), -self.mean.dot(a));
        let scaled = self.scaled;
        a.iter().all(|v| v.is_finite()).then_some(LocalQuadric { e, linear, constant, scaled })
    }
}

/// Sums of the features of scaled points and of their products, the lower triangle; several points at a time.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn feature_sums(s: &Scaled, points: &[Vec3]) -> ([f64; FEATURES], [[f64; FEATURES]; FEATURES]) {
    let inverse = 1.0 / s.scale;
    let mut sums = [[0.0; LANES]; FEATURES];
    let mut products = [[[0.0; LANES]; FEATURES]; FEATURES];
    for some in points.chunks(LANES) {
        // What fills up stands at the centroid, where all features are 0.
        let [mut x, mut y, mut z] = [[0.0; LANES]; 3];
        for (k, p) in some.iter().enumerate() {
            x[k] = (p.x - s.centroid.x) * inverse;
            y[k] = (p.y - s.centroid.y) * inverse;
            z[k] = (p.z - s.centroid.z) * inverse;
        }
        let mut f = [[0.0; LANES]; FEATURES];
        for l in 0..LANES {
            f[0][l] = x[l] * x[l];
            f[1][l] = y[l] * y[l];
            f[2][l] = z[l] * z[l];
            f[3][l] = x[l] * y[l];
            f[4][l] = y[l] * z[l];
            f[5][l] = x[l] * z[l];
        }
        (f[6], f[7], f[8]) = (x, y, z);
        for i in 0..FEATURES {
            for l in 0..LANES {
                sums[i][l] += f[i][l];
            }
            for j in 0..=i {
                for l in 0..LANES {
                    products[i][j][l] += f[i][l] * f[j][l];
                }
            }
        }
    }
    let whole = |lanes: &[f64; LANES]| lanes.iter().sum::<f64>();
    (sums.map(|s| whole(&s)), products.map(|row| row.map(|s| whole(&s))))
}

#[cfg(test)]
mod tests {
    use super::super::fits::Random;
    use super::*;

    #[test]
    fn sums_of_several_points_at_once_are_those_of_one_after_the_other() {
        let mut random = Random::new(6);
        for n in [1, 7, 8, 30, 161] {
            let mut side = || random.uniform(-5.0, 9.0);
            let points: Vec<Vec3> = (0..n).map(|_| Vec3::new(side(), side(), side())).collect();
            let found = Sums::of(&points);
            let s = Scaled::of(&points);
            let (mut sum, mut scatter) =
                (SVector::<f64, 9>::zeros(), SMatrix::<f64, 9, 9>::zeros());
            let mut gradient = SMatrix::<f64, 9, 9>::zeros();
            for p in &points {
                let q = s.to(p);
                let f = SVector::<f64, 9>::from([
                    q.x * q.x,
                    q.y * q.y,
                    q.z * q.z,
                    q.x * q.y,
                    q.y * q.z,
                    q.x * q.z,
                    q.x,
                    q.y,
                    q.z,
                ]);
                sum += f;
                scatter += f * f.transpose();
                for d in 0..3 {
                    let mut g = SVector::<f64, 9>::zeros();
                    g[d] = 2.0 * q[d];
                    g[3] = [q.y, q.x, 0.0][d];
                    g[4] = [0.0, q.z, q.y][d];
                    g[5] = [q.z, 0.0, q.x][d];
                    g[6 + d] = 1.0;
                    gradient += g * g.transpose();
                }
            }
            let scatter = scatter - sum * sum.transpose() / n as f64;
            assert!((found.scatter - scatter).norm() < 1e-11 * (1.0 + scatter.norm()));
            assert!((found.gradient() - gradient).norm() < 1e-11 * gradient.norm());
        }
    }
}

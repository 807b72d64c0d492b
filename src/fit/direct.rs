//! The seed's direct least squares fit (3, 6), solved without inverting a singular matrix.

use nalgebra::{Matrix3, Matrix4, Matrix6, Matrix6x4, SymmetricEigen, Vector6};

use super::section::{ellipse_constraint, section_conic};
use super::{Scatter, section_normals};
use crate::geometry::{Quadric, Vec3};

/// Below this share of the largest eigenvalue the scatter matrix is singular to working precision.
const SINGULAR: f64 = 1e-13;

/// The scatter matrix with the linear part of the quadric eliminated.
struct Reduced {
    /// Eigenvalues and eigenvectors of A - B C^-1 B', the 6 x 6 matrix left for a1..a6.
    eigen: SymmetricEigen<f64, nalgebra::U6>,
    /// -B C^-1: a7..a10 follow from a1..a6 by its transpose.
    linear: Matrix6x4<f64>,
}

impl Reduced {
    /// `None` where the points lie in a plane (C singular).
    fn of(scatter: &Scatter) -> Option<Self> {
        let a: Matrix6<f64> = scatter.0.fixed_view::<6, 6>(0, 0).into_owned();
        let b: Matrix6x4<f64> = scatter.0.fixed_view::<6, 4>(0, 6).into_owned();
        let c: Matrix4<f64> = scatter.0.fixed_view::<4, 4>(6, 6).into_owned();
        let linear = -b * c.cholesky()?.inverse();
        let rest = a + linear * b.transpose();
        let eigen = ((rest + rest.transpose()) / 2.0).symmetric_eigen();
        Some(Self { eigen, linear })
    }

    fn smallest(&self) -> usize {
        self.eigen.eigenvalues.imin()
    }

    fn is_singular(&self) -> bool {
        self.eigen.eigenvalues[self.smallest()] <= SINGULAR * self.eigen.eigenvalues.max()
    }

    fn inverse(&self) -> Matrix6<f64> {
        let v = &self.eigen.eigenvectors;
        v * Matrix6::from_diagonal(&self.eigen.eigenvalues.map(|l| 1.0 / l)) * v.transpose()
    }

    fn quadric(&self, a: &Vector6<f64>) -> Quadric {
        let l = self.linear.transpose() * a;
        Quadric([a[0], a[1], a[2], a[3], a[4], a[5], l[0], l[1], l[2], l[3]])
    }
}

/// Minimises |Da|^2 subject to a'Ma = 1 (3) for the section plane with unit normal `normal`.
///
/// `scatter` must be in a frame near its points. M has rank 3: with C = (A, B, C) = W a the section's
/// conic, M = W'KW, so that among all a with the same conic the best one is known, and
/// S a = lambda M a (6) becomes G K c = (1/lambda) c with G = W S^-1 W', a 3 x 3 problem. Its
/// matrix R'KR (G = RR') has one positive eigenvalue, as K has.
///
/// Exact data make S singular: then its null vector, the smallest eigenvector, is the surface.
/// `None` for points in one plane, or fewer than ten.
pub fn direct_fit(scatter: &Scatter, normal: &Vec3) -> Option<Quadric> {
    let reduced = Reduced::of(scatter)?;
    if reduced.is_singular() {
        let null = reduced.eigen.eigenvectors.column(reduced.smallest()).into_owned();
        return Some(reduced.quadric(&null));
    }
    let w = section_conic(normal);
    let inverse_wt = reduced.inverse() * w.transpose();
    let r: Matrix3<f64> = (w * inverse_wt).cholesky()?.l();
    let eigen = (r.transpose() * ellipse_constraint() * r).symmetric_eigen();
    let y = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let multiplier = r.transpose().solve_upper_triangular(&y)?; // G^-1 c for c = R y
    let quadric = reduced.quadric(&(inverse_wt * multiplier));
    quadric.0.iter().all(|a| a.is_finite()).then_some(quadric)
}

/// The direct fit with the section plane of (9) or of (10), whichever leaves the points nearer.
///
/// A plane that cuts a cylinder along its axis cuts it in no ellipse; the other one then does.
/// `first` and `second` are the region's first two points, in any frame with the same directions.
pub fn direct_fit_through(scatter: &Scatter, first: &Vec3, second: &Vec3) -> Option<Quadric> {
    section_normals(first, second)
        .iter()
        .filter_map(|normal| direct_fit(scatter, normal))
        .map(|quadric| (scatter.mean_sq_distance(&quadric), quadric))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, quadric)| quadric)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::section::tests::printed_m;
    use crate::fit::{Matrix10, Vector10};
    use crate::geometry::{Frame, perpendicular_frame};

    /// Points on a patch of an elliptic cylinder, pushed off it by up to `noise`.
    fn patch(noise: f64) -> Vec<Vec3> {
        let axis = Vec3::new(0.3, 0.9, -0.2).normalize();
        let (u, v) = perpendicular_frame(&axis);
        (0..400)
            .map(|i| {
                let (s, t) = ((f64::from(i) * 0.618).fract(), (f64::from(i) * 0.414).fract());
                let angle = 0.4 + 2.0 * s;
                let wobble = 1.0 + noise * (f64::from(i) * 12.9898).sin();
                (u * angle.cos() * 9.0 + v * angle.sin() * 6.0) * wobble
                    + axis * (20.0 * t)
                    + Vec3::new(3.0, -2.0, 5.0)
            })
            .collect()
    }

    fn parallel(a: &Quadric, b: &Quadric, tolerance: f64) -> bool {
        let (a, b) = (Vector10::from(a.0).normalize(), Vector10::from(b.0).normalize());
        (a - b).norm().min((a + b).norm()) < tolerance
    }

    /// S a = lambda M a in full: Schur form of S^-1 M, then the null vector of S^-1 M - I/lambda.
    fn generalised_eigenproblem(scatter: &Scatter, alpha: f64, beta: f64) -> Quadric {
        let mut m = Matrix10::zeros();
        m.fixed_view_mut::<6, 6>(0, 0).copy_from(&printed_m(alpha, beta));
        let product = scatter.0.lu().solve(&m).unwrap();
        let values = product.complex_eigenvalues();
        let positive = values.iter().map(|l| l.re).fold(f64::MIN, f64::max);
        let svd = (product - Matrix10::identity() * positive).svd(false, true);
        let null = svd.v_t.unwrap().row(svd.singular_values.imin()).transpose();
        Quadric(null.into())
    }

    #[test]
    fn the_fit_solves_the_full_generalised_eigenproblem() {
        let points = patch(0.01);
        let frame = Frame::of(points.iter().copied());
        let scatter = Scatter::of(points.into_iter(), &frame);
        for (alpha, beta) in [(0.7, -1.3), (0.0, 0.0), (-4.0, 0.2)] {
            let normal = Vec3::new(-alpha, -beta, 1.0).normalize();
            let fitted = direct_fit(&scatter, &normal).unwrap();
            let expected = generalised_eigenproblem(&scatter, alpha, beta);
            assert!(parallel(&fitted, &expected, 1e-7), "{alpha} {beta}: {fitted:?} {expected:?}");
        }
    }

    #[test]
    fn exact_data_give_the_exact_surface() {
        let points = patch(0.0);
        let frame = Frame::of(points.iter().copied());
        let scatter = Scatter::of(points.iter().copied(), &frame);
        let fitted = direct_fit_through(&scatter, &points[0], &points[1]).unwrap();
        let gradient = fitted.gradient(&frame.local_from_world(&points[0])).norm();
        for p in &points {
            assert!(fitted.value(&frame.local_from_world(p)).abs() < 1e-10 * gradient);
        }
    }

    #[test]
    fn a_vertical_section_plane_is_as_good_as_any_other() {
        let points = patch(0.001);
        let frame = Frame::of(points.iter().copied());
        let scatter = Scatter::of(points.into_iter(), &frame);
        let vertical = direct_fit(&scatter, &Vec3::new(0.6, 0.8, 0.0)).unwrap();
        let slanted = direct_fit(&scatter, &Vec3::new(0.0, 1.0, 0.0)).unwrap();
        assert!(parallel(&vertical, &slanted, 1e-2));
        assert!(scatter.mean_sq_distance(&vertical) < 1e-6);
    }

    #[test]
    fn a_plane_along_the_axis_is_passed_over() {
        let axis = Vec3::new(1.0, 1.0, 1.0).normalize();
        let (u, v) = perpendicular_frame(&axis);
        let points: Vec<_> = (0..300)
            .map(f64::from)
            .map(|i| {
                let angle = 2.0 * (i * 0.618).fract();
                let radius = 5.0 + 0.003 * (i * 7.7).sin();
                (u * angle.cos() + v * angle.sin()) * radius + axis * 9.0 * (i * 0.414).fract()
            })
            .collect();
        let frame = Frame::of(points.iter().copied());
        let scatter = Scatter::of(points.iter().copied(), &frame);
        // (9) crosses with the axis itself, so its plane cuts the cylinder in parallel lines.
        let fitted = direct_fit_through(&scatter, &u, &v).unwrap();
        assert!(scatter.mean_sq_distance(&fitted).sqrt() * frame.scale < 0.004);
    }

    #[test]
    fn coplanar_and_too_few_points_have_no_fit() {
        let flat = (0..50).map(f64::from).map(|i| Vec3::new(i.sin(), (1.7 * i).cos(), 0.0));
        let world = Frame { origin: Vec3::zeros(), scale: 1.0 };
        assert_eq!(direct_fit(&Scatter::of(flat, &world), &Vec3::z()), None);
        assert_eq!(direct_fit(&Scatter::default(), &Vec3::z()), None);
    }
}

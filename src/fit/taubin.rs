use nalgebra::{Matrix3x4, Matrix4, SMatrix, SVector};

use super::scatter::{Matrix10, Scatter};
use crate::geometry::{Quadric, Vec3};

/// Taubin's fit: the quadric of least sum of squared residuals over sum of squared gradients (Taubin,
/// *IEEE PAMI* 13, 1991). It is nearly free of bias on short arcs, and of any type.
///
/// `scatter` must be in a frame near its points. The constant has no gradient and is eliminated;
/// what is left is a symmetric 9 x 9 eigenproblem. `None` for points in one plane, or too few.
pub fn taubin_fit(scatter: &Scatter) -> Option<Quadric> {
    let s = &scatter.0;
    let column: SVector<f64, 9> = s.fixed_view::<9, 1>(0, 9).into_owned();
    let rest = s.fixed_view::<9, 9>(0, 0) - column * column.transpose() / scatter.count();
    let gradients: SMatrix<f64, 9, 9> = gradient_matrix(s).fixed_view::<9, 9>(0, 0).into_owned();
    let l = gradients.cholesky()?.l();
    let half = l.solve_lower_triangular(&rest)?;
    let reduced = l.solve_lower_triangular(&half.transpose())?;
    let eigen = ((reduced + reduced.transpose()) / 2.0).symmetric_eigen();
    let smallest = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let a = l.transpose().solve_upper_triangular(&smallest)?;
    let mut quadric = [0.0; 10];
    quadric[..9].copy_from_slice(a.as_slice());
    quadric[9] = -column.dot(&a) / scatter.count();
    quadric.iter().all(|v| v.is_finite()).then_some(Quadric(quadric))
}

/// G with a'Ga the sum of squared gradients: the gradient of each feature is linear in (x, 1), so
/// G needs no more than the second moments, which S holds.
fn gradient_matrix(s: &Matrix10) -> Matrix10 {
    let m = Matrix4::new(
        s[(0, 9)],
        s[(3, 9)],
        s[(5, 9)],
        s[(6, 9)], //
        s[(3, 9)],
        s[(1, 9)],
        s[(4, 9)],
        s[(7, 9)], //
        s[(5, 9)],
        s[(4, 9)],
        s[(2, 9)],
        s[(8, 9)], //
        s[(6, 9)],
        s[(7, 9)],
        s[(8, 9)],
        s[(9, 9)],
    );
    let gradients: [Matrix3x4<f64>; 10] = std::array::from_fn(|j| {
        let mut unit = Quadric([0.0; 10]);
        unit.0[j] = 1.0;
        let (e, p): (_, Vec3) = (unit.e() * 2.0, unit.linear());
        Matrix3x4::from_columns(&[e.column(0), e.column(1), e.column(2), p.column(0)])
    });
    Matrix10::from_fn(|i, j| (gradients[i] * m).dot(&gradients[j]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{CanonicalForm, Frame};

    /// A short arc of a cylinder of radius 10 about z, with errors of a few hundredths.
    fn arc() -> Vec<Vec3> {
        (0..3000)
            .map(f64::from)
            .map(|i| {
                let (angle, r) = ((i * 0.618).fract(), 10.0 + 0.02 * (i * 78.233).sin());
                Vec3::new(r * angle.cos(), r * angle.sin(), 30.0 * (i * 0.414).fract())
            })
            .collect()
    }

    #[test]
    fn its_gradient_matrix_sums_squared_gradients() {
        let frame = Frame::of(arc().into_iter());
        let scatter = Scatter::of(arc().into_iter(), &frame);
        let q = Quadric([1.0, 2.0, 3.0, 0.4, -0.5, 0.6, 7.0, -8.0, 9.0, 10.0]);
        let a = super::super::Vector10::from(q.0);
        let ours = a.dot(&(gradient_matrix(&scatter.0) * a));
        assert!((ours / scatter.sq_gradient(&q) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn no_small_change_of_the_coefficients_brings_the_points_nearer() {
        let frame = Frame::of(arc().into_iter());
        let scatter = Scatter::of(arc().into_iter(), &frame);
        let fitted = taubin_fit(&scatter).unwrap();
        let best = scatter.mean_sq_distance(&fitted);
        for j in 0..10 {
            for step in [1e-3, -1e-3] {
                let mut other = fitted;
                other.0[j] += step;
                assert!(scatter.mean_sq_distance(&other) > best);
            }
        }
    }

    #[test]
    fn it_finds_the_radius_of_a_short_arc() {
        let frame = Frame::of(arc().into_iter());
        let fitted = taubin_fit(&Scatter::of(arc().into_iter(), &frame)).unwrap();
        let form = CanonicalForm::of(&fitted, 0.01).unwrap();
        let radius = frame.scale * (-form.constant / form.curvatures[0]).sqrt();
        assert!((radius - 10.0).abs() < 0.5, "{radius}");
    }

    #[test]
    fn coplanar_points_have_no_fit() {
        let flat = (0..50).map(f64::from).map(|i| Vec3::new(i.sin(), (1.7 * i).cos(), 0.0));
        let world = Frame { origin: Vec3::zeros(), scale: 1.0 };
        assert_eq!(taubin_fit(&Scatter::of(flat, &world)), None);
    }
}

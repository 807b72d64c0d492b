use crate::geometry::{Quadric, Vec3, perpendicular_frame};

/// Normals of the plane that cuts the surface in an ellipse, from the region's first two points:
/// those of (9) and of (10), unit length.
///
/// The seed divides by n3 next, so both fail for it where dx = dy; the constraint is here written
/// with n itself and n3 = 0 is a normal like any other. A normal is left out where its cross product
/// vanishes (the points coincide, or differ along the fixed vector).
pub fn section_normals(first: &Vec3, second: &Vec3) -> Vec<Vec3> {
    let d = first - second;
    [
        d.cross(&Vec3::new(1.0, 1.0, 1.0)), // (9)
        d.cross(&Vec3::new(1.0, 1.0, 0.5)), // (10)
    ]
    .into_iter()
    .filter(|n| n.norm() > 1e-9 * d.norm())
    .map(|n| n.normalize())
    .collect()
}

/// The 3 x 6 matrix from a1..a6 to the conic (A, B, C) in which a plane cuts the quadric:
/// A s2 + B st + C t2 + ... = 0 in the plane's own coordinates.
pub fn section_conic(normal: &Vec3) -> nalgebra::Matrix3x6<f64> {
    let (u, v) = perpendicular_frame(normal);
    let mut conic = nalgebra::Matrix3x6::zeros();
    for j in 0..6 {
        let mut unit = [0.0; 10];
        unit[j] = 1.0;
        let e = Quadric(unit).e();
        conic[(0, j)] = (e * u).dot(&u);
        conic[(1, j)] = 2.0 * (e * u).dot(&v);
        conic[(2, j)] = (e * v).dot(&v);
    }
    conic
}

/// The matrix K with c'Kc = 4AC - B2 for a conic c = (A, B, C): positive for ellipses.
pub fn ellipse_constraint() -> nalgebra::Matrix3<f64> {
    nalgebra::Matrix3::new(0.0, 0.0, 2.0, 0.0, -1.0, 0.0, 2.0, 0.0, 0.0)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// M as the seed prints it below (4), its upper left 6 x 6 part; the rest is zero.
    pub fn printed_m(alpha: f64, beta: f64) -> nalgebra::Matrix6<f64> {
        let mut m = nalgebra::Matrix6::zeros();
        let mut set = |i: usize, j: usize, v: f64| {
            m[(i - 1, j - 1)] = v;
            m[(j - 1, i - 1)] = v;
        };
        set(1, 2, 2.0);
        set(1, 3, 2.0 * beta * beta);
        set(2, 3, 2.0 * alpha * alpha);
        set(1, 5, 2.0 * beta);
        set(2, 6, 2.0 * alpha);
        set(3, 4, -2.0 * alpha * beta);
        set(4, 4, -1.0);
        set(5, 4, -alpha);
        set(5, 5, -alpha * alpha);
        set(6, 4, -beta);
        set(6, 6, -beta * beta);
        set(5, 6, alpha * beta);
        m
    }

    #[test]
    fn the_constraint_is_the_printed_matrix_up_to_the_length_of_the_normal() {
        let (alpha, beta) = (0.7, -1.3);
        let n = Vec3::new(-alpha, -beta, 1.0);
        let w = section_conic(&n.normalize());
        let ours = w.transpose() * ellipse_constraint() * w * n.norm_squared();
        assert!((ours - printed_m(alpha, beta)).abs().max() < 1e-12);
    }

    #[test]
    fn equations_9_and_10_give_the_two_normals() {
        let normals = section_normals(&Vec3::new(1.0, 0.0, 0.0), &Vec3::zeros());
        let root_half = 0.5_f64.sqrt();
        assert!((normals[0] - Vec3::new(0.0, -root_half, root_half)).norm() < 1e-12);
        assert!((normals[1] - Vec3::new(0.0, -0.5, 1.0).normalize()).norm() < 1e-12);
    }

    #[test]
    fn normals_without_a_third_component_are_kept_and_vanishing_ones_left_out() {
        let normals = section_normals(&Vec3::new(1.0, 1.0, 3.0), &Vec3::zeros());
        assert_eq!((normals.len(), normals[0].z), (2, 0.0));
        assert_eq!(section_normals(&Vec3::new(2.0, 2.0, 2.0), &Vec3::zeros()).len(), 1);
        assert!(section_normals(&Vec3::x(), &Vec3::x()).is_empty());
    }
}

//! The type of a quadric by the ranks and the eigenvalue signs of e and E (11), as in Zwillinger,
//! *CRC Standard Mathematical Tables and Formulae*, 31st edition, section 4.18.

use super::{Quadric, Vec3};

/// The seventeen types of quadric.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "each name is the definition")]
pub enum QuadricType {
    RealEllipsoid,
    ImaginaryEllipsoid,
    HyperboloidOneSheet,
    HyperboloidTwoSheets,
    RealCone,
    ImaginaryCone,
    EllipticParaboloid,
    HyperbolicParaboloid,
    RealEllipticCylinder,
    ImaginaryEllipticCylinder,
    HyperbolicCylinder,
    RealIntersectingPlanes,
    ImaginaryIntersectingPlanes,
    ParabolicCylinder,
    RealParallelPlanes,
    ImaginaryParallelPlanes,
    CoincidentPlanes,
}

/// A quadric turned into its principal directions and moved to its centre, as far as it has one:
/// sum of `curvatures[i]` t_i^2 + `slope` t_2 + `constant` = 0, t_i = `directions[i]` . (x - `center`).
///
/// Both steps are congruences of E, so ranks and signs can be read off (Sylvester's law of inertia).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CanonicalForm {
    /// Eigenvalues of e, by falling size; those taken as zero are exactly zero.
    pub curvatures: [f64; 3],
    /// Unit eigenvectors of e in that order; the last one takes the slope where there is one.
    pub directions: [Vec3; 3],
    /// Where the linear part along every curved direction vanishes.
    pub center: Vec3,
    /// Linear coefficient along the last direction; zero where rank e = 3.
    pub slope: f64,
    /// Constant left at the centre; of no meaning where `slope` is not zero.
    pub constant: f64,
}

impl CanonicalForm {
    /// Reduces `quadric`, which must be given in a frame centred on its points and about their size.
    ///
    /// `tolerance` is relative to the largest eigenvalue of e: smaller eigenvalues, slopes and
    /// constants are taken as zero. `None` where e itself vanishes against the linear part.
    pub fn of(quadric: &Quadric, tolerance: f64) -> Option<Self> {
        let eigen = quadric.e().symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| eigen.eigenvalues[j].abs().total_cmp(&eigen.eigenvalues[i].abs()));
        let largest = eigen.eigenvalues[order[0]].abs();
        let linear = quadric.linear();
        if largest <= tolerance * linear.norm() || largest == 0.0 {
            return None;
        }
        let kept = |v: f64| if v.abs() > tolerance * largest { v } else { 0.0 };
        let curvatures = order.map(|i| kept(eigen.eigenvalues[i]));
        let mut directions = order.map(|i| Vec3::from(eigen.eigenvectors.column(i)));
        let mut center = Vec3::zeros();
        let mut rest = linear;
        for (curvature, direction) in curvatures.iter().zip(&directions) {
            if *curvature != 0.0 {
                let along = linear.dot(direction);
                center -= direction * (along / (2.0 * curvature));
                rest -= direction * along;
            }
        }
        let slope = kept(rest.norm());
        let constant = kept(quadric.0[9] + linear.dot(&center) / 2.0);
        if slope > 0.0 {
            directions[2] = rest.normalize();
            if curvatures[1] == 0.0 {
                directions[1] = directions[2].cross(&directions[0]);
            }
        }
        Some(Self { curvatures, directions, center, slope, constant })
    }

    /// The type, by how many eigenvalues of e and of E are positive and negative.
    pub fn quadric_type(&self) -> QuadricType {
        use QuadricType::*;
        let mut e = signs(&self.curvatures);
        let mut e4 = if self.slope > 0.0 {
            (e.0 + 1, e.1 + 1)
        } else {
            let last = signs(&[self.constant]);
            (e.0 + last.0, e.1 + last.1)
        };
        if e.1 > e.0 {
            (e, e4) = ((e.1, e.0), (e4.1, e4.0));
        }
        match (e, e4) {
            ((3, 0), (3, 1)) => RealEllipsoid,
            ((3, 0), (3, 0)) => ImaginaryCone,
            ((3, 0), _) => ImaginaryEllipsoid,
            ((2, 1), (2, 2)) => HyperboloidOneSheet,
            ((2, 1), (2, 1)) => RealCone,
            ((2, 1), _) => HyperboloidTwoSheets,
            ((2, 0), (3, 1)) => EllipticParaboloid,
            ((2, 0), (2, 1)) => RealEllipticCylinder,
            ((2, 0), (2, 0)) => ImaginaryIntersectingPlanes,
            ((2, 0), _) => ImaginaryEllipticCylinder,
            ((1, 1), (2, 2)) => HyperbolicParaboloid,
            ((1, 1), (1, 1)) => RealIntersectingPlanes,
            ((1, 1), _) => HyperbolicCylinder,
            (_, (2, 1)) => ParabolicCylinder,
            (_, (1, 1)) => RealParallelPlanes,
            (_, (2, 0)) => ImaginaryParallelPlanes,
            _ => CoincidentPlanes,
        }
    }
}

/// How many values are positive, and how many negative.
fn signs(values: &[f64]) -> (usize, usize) {
    let count = |f: fn(&f64) -> bool| values.iter().filter(|v| f(v)).count();
    (count(|v| *v > 0.0), count(|v| *v < 0.0))
}

/// The type of `quadric`; see [`CanonicalForm::of`] for the frame and the tolerance.
/// `None` where the equation is of first degree.
pub fn classify(quadric: &Quadric, tolerance: f64) -> Option<QuadricType> {
    CanonicalForm::of(quadric, tolerance).map(|form| form.quadric_type())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Frame, Mat3};
    use QuadricType::*;

    /// x2, y2, z2, z, 1.
    const CASES: [([f64; 5], QuadricType); 17] = [
        ([1.0, 0.5, 0.3, 0.0, -1.0], RealEllipsoid),
        ([1.0, 0.5, 0.3, 0.0, 1.0], ImaginaryEllipsoid),
        ([1.0, 0.5, -0.3, 0.0, -1.0], HyperboloidOneSheet),
        ([1.0, 0.5, -0.3, 0.0, 1.0], HyperboloidTwoSheets),
        ([1.0, 0.5, -0.3, 0.0, 0.0], RealCone),
        ([1.0, 0.5, 0.3, 0.0, 0.0], ImaginaryCone),
        ([1.0, 0.5, 0.0, -1.0, 0.0], EllipticParaboloid),
        ([1.0, -0.5, 0.0, -1.0, 0.0], HyperbolicParaboloid),
        ([1.0, 0.5, 0.0, 0.0, -1.0], RealEllipticCylinder),
        ([1.0, 0.5, 0.0, 0.0, 1.0], ImaginaryEllipticCylinder),
        ([1.0, -0.5, 0.0, 0.0, 1.0], HyperbolicCylinder),
        ([1.0, -0.5, 0.0, 0.0, 0.0], RealIntersectingPlanes),
        ([1.0, 0.5, 0.0, 0.0, 0.0], ImaginaryIntersectingPlanes),
        ([1.0, 0.0, 0.0, -1.0, 0.0], ParabolicCylinder),
        ([1.0, 0.0, 0.0, 0.0, -1.0], RealParallelPlanes),
        ([1.0, 0.0, 0.0, 0.0, 1.0], ImaginaryParallelPlanes),
        ([1.0, 0.0, 0.0, 0.0, 0.0], CoincidentPlanes),
    ];

    fn turned(case: &[f64; 5], sign: f64) -> Quadric {
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -1.1, 2.0).into_inner();
        let e =
            turn * Mat3::from_diagonal(&Vec3::new(case[0], case[1], case[2])) * turn.transpose();
        let p = turn * Vec3::new(0.0, 0.0, case[3]);
        let frame = Frame { origin: Vec3::new(0.4, -0.7, 0.2), scale: 1.3 };
        frame.local_quadric(&Quadric::from_parts(&(e * sign), &(p * sign), case[4] * sign))
    }

    #[test]
    fn all_seventeen_types_are_told_apart_turned_moved_scaled_and_negated() {
        for (case, expected) in CASES {
            for sign in [1.0, -1.0] {
                assert_eq!(classify(&turned(&case, sign), 1e-9), Some(expected), "{case:?} {sign}");
            }
        }
    }

    #[test]
    fn noise_below_the_tolerance_does_not_change_the_type() {
        for (case, expected) in CASES {
            let mut q = turned(&case, 1.0);
            q.0.iter_mut()
                .zip([3e-5, -2e-5, 1e-5, 2e-5, -1e-5].iter().cycle())
                .for_each(|(a, n)| *a += n);
            assert_eq!(classify(&q, 1e-3), Some(expected), "{case:?}");
        }
    }

    #[test]
    fn a_first_degree_equation_has_no_quadric_type() {
        assert_eq!(
            classify(&Quadric([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0]), 1e-9),
            None
        );
        assert_eq!(classify(&Quadric([0.0; 10]), 1e-9), None);
    }
}

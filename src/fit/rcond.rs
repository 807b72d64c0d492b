//! The reciprocal condition number of the scatter matrix in raw coordinates, point by point.

use super::scatter::{Matrix10, Scatter, Vector10, features};
use crate::geometry::{Frame, Quadric, Vec3};

/// A pivot of the equilibrated matrix below this is zero to working precision.
const SINGULAR: f64 = 1e-13;
/// A point that changes S more than this in some direction calls for a new factorisation: the
/// update would lose that many digits.
const LARGEST_LEVERAGE: f64 = 1e4;

/// S of a growing set of points together with its inverse, so that rcond(S) = 1 / (|S|_1 |S^-1|_1)
/// costs one rank-one update a point and never a pass over the points.
///
/// S of raw coordinates is singular to f64 long before the seed's thresholds (near 1e-20), so
/// what LU makes of it is rounding. Here S and its inverse are kept in a local frame, where they
/// are well conditioned, and the inverse is carried along in raw coordinates through the exact change
/// of frame: the value is that of exact arithmetic.
#[derive(Clone, Copy, Debug)]
pub struct Condition {
    frame: Frame,
    local: Scatter,
    world: Scatter,
    inverse: Option<Inverse>,
    /// The count at which the inverse is next computed anew, to shed rounding.
    refresh_at: f64,
}

/// S^-1 in both frames.
#[derive(Clone, Copy, Debug)]
struct Inverse {
    local: Matrix10,
    world: Matrix10,
}

impl Condition {
    /// Of no points; `frame` must lie near the points to come.
    pub fn new(frame: Frame) -> Self {
        let (local, world) = (Scatter::default(), Scatter::default());
        Self { frame, local, world, inverse: None, refresh_at: 10.0 }
    }

    /// The frame of [`Self::scatter`].
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// S of the points so far, in the local frame.
    pub fn scatter(&self) -> &Scatter {
        &self.local
    }

    /// The set with `point` (world coordinates) taken in.
    pub fn with(&self, point: &Vec3) -> Self {
        let mut next = *self;
        next.add(point);
        next
    }

    /// 1-norm reciprocal condition number of the raw S; zero where S is singular to working
    /// precision, as it is up to nine points and for exact data.
    pub fn rcond(&self) -> f64 {
        match &self.inverse {
            Some(inverse) => 1.0 / (one_norm(&self.world.0) * one_norm(&inverse.world)),
            None => 0.0,
        }
    }

    fn add(&mut self, point: &Vec3) {
        let f = features(&self.frame.local_from_world(point));
        self.local.add_point(&f);
        self.world.add_point(&features(point));
        let updated = match &mut self.inverse {
            Some(inverse) if self.local.count() < self.refresh_at => inverse.add(&f, &self.frame),
            _ => false,
        };
        if !updated && self.local.count() >= 10.0 {
            self.inverse = Inverse::of(&self.local, &self.frame);
            self.refresh_at = 2.0 * self.local.count();
        }
    }
}

impl Inverse {
    fn of(scatter: &Scatter, frame: &Frame) -> Option<Self> {
        let local = equilibrated_inverse(&scatter.0)?;
        let mut half = Matrix10::zeros();
        for (from, mut to) in local.column_iter().zip(half.column_iter_mut()) {
            to.copy_from(&world_coefficients(&from.into_owned(), frame));
        }
        let mut world = Matrix10::zeros();
        for (from, mut to) in half.row_iter().zip(world.column_iter_mut()) {
            to.copy_from(&world_coefficients(&from.transpose(), frame));
        }
        Some(Self { local, world })
    }

    /// (S + ff')^-1 = S^-1 - ww' / (1 + f'w) with w = S^-1 f (Sherman and Morrison). False, and
    /// nothing done, where the step would lose too many digits.
    fn add(&mut self, f: &Vector10, frame: &Frame) -> bool {
        let w = self.local * f;
        let leverage = f.dot(&w);
        if !(0.0..LARGEST_LEVERAGE).contains(&leverage) {
            return false;
        }
        subtract_square(&mut self.local, &w, 1.0 / (1.0 + leverage));
        subtract_square(&mut self.world, &world_coefficients(&w, frame), 1.0 / (1.0 + leverage));
        true
    }
}

/// S^-1 maps features to coefficients, so its columns change frame as coefficients do.
fn world_coefficients(local: &Vector10, frame: &Frame) -> Vector10 {
    Vector10::from(frame.world_quadric(&Quadric((*local).into())).0)
}

fn subtract_square(matrix: &mut Matrix10, w: &Vector10, factor: f64) {
    for (mut column, wj) in matrix.column_iter_mut().zip(w.iter()) {
        column.axpy(-factor * wj, w, 1.0);
    }
}

/// The inverse by Cholesky after scaling the diagonal to one; `None` where singular.
fn equilibrated_inverse(s: &Matrix10) -> Option<Matrix10> {
    let scale = s.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 });
    let d = Matrix10::from_diagonal(&scale);
    let factor = (d * s * d).cholesky()?;
    let smallest = factor.l_dirty().diagonal().min();
    (smallest * smallest > SINGULAR).then(|| d * factor.inverse() * d)
}

/// Largest column sum of absolute values.
fn one_norm(m: &Matrix10) -> f64 {
    m.column_iter().map(|c| c.abs().sum()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Dyn, OMatrix, U10};

    /// A cylinder of radius 10 and length 30 with errors of a few micrometres, at `center`.
    fn cylinder(center: Vec3) -> Vec<Vec3> {
        (0..900)
            .map(f64::from)
            .map(|i| {
                let (angle, r) = (
                    std::f64::consts::TAU * (i * 0.618).fract(),
                    10.0 + 0.004 * (i * 78.233).sin(),
                );
                center + Vec3::new(r * angle.cos(), r * angle.sin(), 30.0 * (i * 0.414).fract())
            })
            .collect()
    }

    /// rcond(D'D) with the inverse from a QR factorisation of D, which squares no condition.
    fn from_design_matrix(points: &[Vec3]) -> f64 {
        let rows: Vec<_> = points.iter().map(|p| features(p).transpose()).collect();
        let design = OMatrix::<f64, Dyn, U10>::from_rows(&rows);
        let r: Matrix10 = design.clone().qr().r().fixed_view::<10, 10>(0, 0).into_owned();
        let r_inverse = r.solve_upper_triangular(&Matrix10::identity()).unwrap();
        let inverse = r_inverse * r_inverse.transpose();
        1.0 / (one_norm(&(design.transpose() * design)) * one_norm(&inverse))
    }

    fn grown(points: &[Vec3]) -> Condition {
        let frame = Frame { origin: points[0], scale: 8.0 };
        points.iter().fold(Condition::new(frame), |c, p| c.with(p))
    }

    #[test]
    fn updated_point_by_point_it_equals_the_direct_computation() {
        for center in [Vec3::zeros(), Vec3::new(30.0, -20.0, 10.0), Vec3::new(100.0, 60.0, 100.0)] {
            let points = cylinder(center);
            for count in [10, 11, 19, 20, 57, 300, 900] {
                let (ours, direct) =
                    (grown(&points[..count]).rcond(), from_design_matrix(&points[..count]));
                assert!(
                    (ours / direct - 1.0).abs() < 1e-3,
                    "{center:?} {count}: {ours:e} {direct:e}"
                );
            }
        }
    }

    #[test]
    fn it_has_the_order_of_the_thresholds_only_in_raw_coordinates() {
        let at_origin = grown(&cylinder(Vec3::new(0.0, 0.0, -15.0))).rcond();
        let far = grown(&cylinder(Vec3::new(100.0, 100.0, 100.0))).rcond();
        assert!((1e-11..1e-10).contains(&at_origin), "{at_origin:e}");
        assert!((1e-21..1e-19).contains(&far), "{far:e}");
    }

    #[test]
    fn up_to_nine_points_and_for_exact_data_it_is_zero() {
        let points = cylinder(Vec3::new(100.0, 60.0, 100.0));
        assert_eq!(grown(&points[..9]).rcond(), 0.0);
        let exact: Vec<_> = (0..200)
            .map(f64::from)
            .map(|i| {
                Vec3::new(100.0 + 10.0 * i.cos(), 80.0 + 10.0 * i.sin(), (i * 0.414).fract() * 20.0)
            })
            .collect();
        assert_eq!(grown(&exact).rcond(), 0.0);
        let foreign = grown(&exact).with(&Vec3::new(100.0, 80.0, 10.0));
        assert!(foreign.rcond() > 1e-17, "{:e}", foreign.rcond());
    }
}

//! The scatter matrix S = D'D of the ten features (4, 7), kept as sums.

use std::ops::{Add, AddAssign};

use crate::geometry::{Frame, Mat3, Quadric, Vec3};

/// Ten features, or ten coefficients, in the seed's order.
pub type Vector10 = nalgebra::SVector<f64, 10>;
/// A matrix over features or coefficients.
pub type Matrix10 = nalgebra::SMatrix<f64, 10, 10>;

/// [x2 y2 z2 xy yz xz x y z 1] of a point (1).
pub fn features(x: &Vec3) -> Vector10 {
    let (x, y, z) = (x.x, x.y, x.z);
    Vector10::from([x * x, y * y, z * z, x * y, y * z, x * z, x, y, z, 1.0])
}

/// The scatter matrix of a set of points in one frame. Sets add; frames are changed exactly.
///
/// Sums of fourth powers lose their digits far from the origin: keep a set's matrix in a [`Frame`]
/// near its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter(pub Matrix10);

impl Default for Scatter {
    /// Of no points.
    fn default() -> Self {
        Self(Matrix10::zeros())
    }
}

impl Scatter {
    /// Of `points`, in `frame`.
    pub fn of(points: impl Iterator<Item = Vec3>, frame: &Frame) -> Self {
        let mut scatter = Self::default();
        points.for_each(|p| scatter.add_point(&features(&frame.local_from_world(&p))));
        scatter
    }

    /// Takes in one point by its features: S + ff'.
    pub fn add_point(&mut self, f: &Vector10) {
        for (mut column, fj) in self.0.column_iter_mut().zip(f.iter()) {
            column.axpy(*fj, f, 1.0);
        }
    }

    /// How many points it holds.
    pub fn count(&self) -> f64 {
        self.0[(9, 9)]
    }

    /// The frame centred on the points and of their size (as [`Frame::of`]), where this matrix is in
    /// `frame`.
    pub fn own_frame(&self, frame: &Frame) -> Frame {
        let (s, n) = (&self.0, self.count().max(1.0));
        let mean = Vec3::new(s[(6, 9)], s[(7, 9)], s[(8, 9)]) / n;
        let sq_size = (s[(0, 9)] + s[(1, 9)] + s[(2, 9)]) / n - mean.norm_squared();
        let size = if sq_size > 0.0 { sq_size.sqrt() } else { 1.0 };
        Frame { origin: frame.world_from_local(&mean), scale: frame.scale * size }
    }

    /// The same points' matrix in world coordinates, from that in `frame`.
    pub fn world_from_local(&self, frame: &Frame) -> Self {
        Self::transformed(self, &world_features(frame))
    }

    /// The same points' matrix in frame `to`, from that in frame `from`.
    pub fn moved(&self, from: &Frame, to: &Frame) -> Self {
        let relative =
            Frame { origin: from.local_from_world(&to.origin), scale: to.scale / from.scale };
        Self::transformed(self, &local_features(&relative))
    }

    fn transformed(&self, t: &Matrix10) -> Self {
        Self(t * self.0 * t.transpose())
    }

    /// Sum over the points of the squared left-hand side of (1): a'Sa.
    pub fn sq_residual(&self, quadric: &Quadric) -> f64 {
        let a = Vector10::from(quadric.0);
        a.dot(&(self.0 * a)).max(0.0)
    }

    /// Sum over the points of the squared gradient of (1).
    pub fn sq_gradient(&self, quadric: &Quadric) -> f64 {
        let (e, p, s) = (quadric.e(), quadric.linear(), &self.0);
        let first = Vec3::new(s[(6, 9)], s[(7, 9)], s[(8, 9)]);
        let second = Mat3::new(
            s[(0, 9)],
            s[(3, 9)],
            s[(5, 9)], //
            s[(3, 9)],
            s[(1, 9)],
            s[(4, 9)], //
            s[(5, 9)],
            s[(4, 9)],
            s[(2, 9)],
        );
        4.0 * (e * e * second).trace() + 4.0 * (e * p).dot(&first) + self.count() * p.norm_squared()
    }

    /// Mean square distance of the points from the quadric, to first order.
    pub fn mean_sq_distance(&self, quadric: &Quadric) -> f64 {
        let sq_gradient = self.sq_gradient(quadric);
        if sq_gradient > 0.0 { self.sq_residual(quadric) / sq_gradient } else { f64::INFINITY }
    }
}

impl Add for Scatter {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl AddAssign for Scatter {
    fn add_assign(&mut self, other: Self) {
        self.0 += other.0;
    }
}

/// T with world features = T local features: each world feature is a quadric, rewritten.
fn world_features(frame: &Frame) -> Matrix10 {
    rows(|unit| frame.local_quadric(unit))
}

/// T with local features = T world features.
fn local_features(frame: &Frame) -> Matrix10 {
    rows(|unit| frame.world_quadric(unit))
}

fn rows(rewritten: impl Fn(&Quadric) -> Quadric) -> Matrix10 {
    let mut t = Matrix10::zeros();
    for j in 0..10 {
        let mut unit = [0.0; 10];
        unit[j] = 1.0;
        t.row_mut(j).copy_from_slice(&rewritten(&Quadric(unit)).0);
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> Vec<Vec3> {
        (0..40)
            .map(|i| f64::from(i) * 0.37)
            .map(|t| Vec3::new(t.cos() * 5.0 + 20.0, t.sin() * 4.0 - 7.0, t))
            .collect()
    }

    fn close(a: &Matrix10, b: &Matrix10) -> bool {
        (a - b).abs().max() <= 1e-10 * b.abs().max()
    }

    #[test]
    fn the_matrix_is_the_product_of_the_design_matrix_with_itself() {
        let frame = Frame::of(points().into_iter());
        let rows: Vec<_> =
            points().iter().map(|p| features(&frame.local_from_world(p)).transpose()).collect();
        let design = nalgebra::OMatrix::<f64, nalgebra::Dyn, nalgebra::U10>::from_rows(&rows);
        let scatter = Scatter::of(points().into_iter(), &frame);
        assert!(close(&scatter.0, &(design.transpose() * design)));
        assert_eq!(scatter.count(), 40.0);
    }

    #[test]
    fn moving_frames_and_adding_sets_is_exact() {
        let here = Frame::of(points().into_iter());
        let there = Frame { origin: here.origin + Vec3::new(3.0, 1.0, -2.0), scale: 7.0 };
        let (first, second) =
            points().split_at_checked(15).map(|(a, b)| (a.to_vec(), b.to_vec())).unwrap();
        let sum = Scatter::of(first.into_iter(), &here).moved(&here, &there)
            + Scatter::of(second.into_iter(), &there);
        assert!(close(&sum.0, &Scatter::of(points().into_iter(), &there).0));
        let own = Scatter::of(points().into_iter(), &there).own_frame(&there);
        assert!((own.origin - here.origin).norm() < 1e-9 && (own.scale - here.scale).abs() < 1e-9);
        let world = Frame { origin: Vec3::zeros(), scale: 1.0 };
        let direct = Scatter::of(points().into_iter(), &world);
        assert!(close(
            &Scatter::of(points().into_iter(), &here).world_from_local(&here).0,
            &direct.0
        ));
    }

    #[test]
    fn residuals_and_gradients_are_sums_over_the_points() {
        let world = Frame { origin: Vec3::zeros(), scale: 1.0 };
        let scatter = Scatter::of(points().into_iter(), &world);
        let q = Quadric([1.0, 2.0, 3.0, 0.4, -0.5, 0.6, 7.0, -8.0, 9.0, 10.0]);
        let residual: f64 = points().iter().map(|p| q.value(p).powi(2)).sum();
        let gradient: f64 = points().iter().map(|p| q.gradient(p).norm_squared()).sum();
        assert!((scatter.sq_residual(&q) / residual - 1.0).abs() < 1e-9);
        assert!((scatter.sq_gradient(&q) / gradient - 1.0).abs() < 1e-9);
    }
}

//! So many lobes about the axis of a feature, and what they explain of its points' distances.

use nalgebra::{DMatrix, Matrix2, Vector2};

use super::descend::Freedoms;
use super::kind::FeatureType;
use super::pose::{Pose, SLOTS};
use super::rows::Gauge;
use super::together::slope;
use crate::geometry::Vec3;

/// Share of the sum of squares of lobes that is rounding where the parameters take them wholly.
const ROUNDING: f64 = 1e-16;

/// The angle about the axis that lobes are told by; of an ellipse that of the circle it is stretched from.
fn angle(pose: &Pose, x: &Vec3) -> f64 {
    let q = pose.frame.tr_mul(&(x - pose.origin));
    match pose.kind {
        FeatureType::EllipticCylinder => (q.y / pose.size[1]).atan2(q.x / pose.size[0]),
        _ => q.y.atan2(q.x),
    }
}

/// A point's row.
pub struct Row {
    /// The angle that lobes are told by.
    pub angle: f64,
    /// The distance.
    pub residual: f64,
    /// Its derivatives by the open places.
    pub slope: [f64; SLOTS],
    /// The direction it is along.
    pub normal: Vec3,
}

/// The rows of `points`.
pub fn rows(pose: &Pose, points: &[Vec3], free: &Freedoms) -> Vec<Row> {
    let gauge = Gauge::of(pose);
    points
        .iter()
        .map(|x| {
            let mut row =
                Row { angle: 0.0, residual: 0.0, slope: [0.0; SLOTS], normal: Vec3::zeros() };
            let mut is_first = true;
            gauge.rows(x, |d, slopes| {
                // of a circle the one within its plane
                if std::mem::take(&mut is_first) {
                    row.residual = d;
                    row.normal = pose.frame * -Vec3::new(slopes[0], slopes[1], slopes[2]);
                    for (a, &slot) in free.slots().iter().enumerate() {
                        row.slope[a] = slopes[slot];
                    }
                }
            });
            // At the foot: off an ellipse the noise itself would turn the angle, and go together with it.
            row.angle = angle(pose, &(x - row.normal * row.residual));
            row
        })
        .collect()
}

/// What so many lobes F explain.
pub struct Count {
    lobes: f64,
    /// F'F of what the parameters J leave of F: its eigenvalues, zero where rounding is left, and its eigenvectors.
    pub values: Vector2<f64>,
    vectors: Matrix2<f64>,
    /// F'r along these.
    pub along: Vector2<f64>,
    /// How the places move by an amplitude along each: -(J'J)^-1 J'F.
    pub moved: DMatrix<f64>,
}

impl Count {
    /// Of so many, of what the parameters leave of the `rows`.
    pub fn of(lobes: usize, rows: &[Row], inverse: &DMatrix<f64>) -> Self {
        let (p, lobes) = (inverse.nrows(), lobes as f64);
        let mut jf = DMatrix::zeros(p, 2);
        let of = |row: &Row| {
            let (sin, cos) = (lobes * row.angle).sin_cos();
            Vector2::new(cos, sin)
        };
        for row in rows {
            let f = of(row);
            (0..p).for_each(|a| (0..2).for_each(|k| jf[(a, k)] += row.slope[a] * f[k]));
        }
        let by = inverse * &jf;
        // from each row's own rest: a difference of sums would leave rounding where the parameters take nearly all
        let (mut ff, mut fr) = (Matrix2::zeros(), Vector2::zeros());
        for row in rows {
            let taken = |k: usize| (0..p).map(|a| row.slope[a] * by[(a, k)]).sum::<f64>();
            let rest = of(row) - Vector2::new(taken(0), taken(1));
            ff += rest * rest.transpose();
            fr += rest * row.residual;
        }
        let e = ff.symmetric_eigen();
        let least = ROUNDING * rows.len() as f64;
        let vectors = e.eigenvectors;
        let moved = -(by * DMatrix::from_fn(2, 2, |a, b| vectors[(a, b)]));
        let values = e.eigenvalues.map(|l| if l > least { l } else { 0.0 });
        Self { lobes, values, vectors, along: vectors.transpose() * fr, moved }
    }

    /// Amplitudes along the eigenvectors by least squares.
    fn amplitudes(&self) -> Vector2<f64> {
        let of = |j: usize| if self.values[j] > 0.0 { self.along[j] / self.values[j] } else { 0.0 };
        Vector2::new(of(0), of(1))
    }

    /// What of the sum of squares they explain.
    pub fn explained(&self) -> f64 {
        self.amplitudes().dot(&self.along)
    }

    /// How high what the parameters leave of the lobes is beside `x`.
    pub fn height(&self, pose: &Pose, free: &Freedoms, x: &Vec3) -> f64 {
        let amplitudes = self.vectors * self.amplitudes();
        let by = &self.moved * DMatrix::from_column_slice(2, 1, self.amplitudes().as_slice());
        let (sin, cos) = (self.lobes * angle(pose, x)).sin_cos();
        let slope = slope(&Gauge::of(pose), x, free, 0);
        let own: f64 = (0..by.nrows()).map(|a| slope[a] * by[(a, 0)]).sum();
        amplitudes[0] * cos + amplitudes[1] * sin + own
    }

    /// The points with what the parameters leave of the lobes taken out.
    pub fn taken_out(&self, rows: &[Row], points: &[Vec3]) -> Vec<Vec3> {
        let amplitudes = self.vectors * self.amplitudes();
        let by = &self.moved * DMatrix::from_column_slice(2, 1, self.amplitudes().as_slice());
        let one = |(row, x): (&Row, &Vec3)| {
            let (sin, cos) = (self.lobes * row.angle).sin_cos();
            let own: f64 = (0..by.nrows()).map(|a| row.slope[a] * by[(a, 0)]).sum();
            x - row.normal * (amplitudes[0] * cos + amplitudes[1] * sin + own)
        };
        rows.iter().zip(points).map(one).collect()
    }
}

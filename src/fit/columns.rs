//! Points in columns: vector units take several at once.

use crate::geometry::Vec3;

/// Columns are filled up to a multiple of this many points; sums are kept in as many parts, so that they
/// come out the same whatever the width of the machine's vector units.
pub const LANES: usize = 8;

/// Points relative to some place, coordinate by coordinate, each with a weight that is not negative.
///
/// The columns are as long as the next multiple of [`LANES`]: copies of the last point with weight 0
/// fill them up.
#[derive(Clone, Debug, Default)]
pub struct Columns {
    /// The coordinates.
    pub x: Vec<f64>,
    /// The coordinates.
    pub y: Vec<f64>,
    /// The coordinates.
    pub z: Vec<f64>,
    /// The weights.
    pub weight: Vec<f64>,
    /// Sum of the weights.
    pub total: f64,
    /// Whether every point's weight is 1.
    pub even: bool,
}

impl Columns {
    /// `points` relative to `centre`, with their weights or, without any, 1 each.
    pub fn of(points: &[Vec3], weights: Option<&[f64]>, centre: &Vec3) -> Self {
        let n = points.len();
        let room = n.next_multiple_of(LANES);
        let column = |k: usize| {
            let mut out = Vec::with_capacity(room);
            out.extend(points.iter().map(|p| p[k] - centre[k]));
            out.resize(room, out.last().copied().unwrap_or(0.0));
            out
        };
        let mut weight = Vec::with_capacity(room);
        match weights {
            Some(w) => weight.extend_from_slice(w),
            None => weight.resize(n, 1.0),
        }
        weight.resize(room, 0.0);
        let total = weights.map_or(n as f64, |w| w.iter().sum());
        Self { x: column(0), y: column(1), z: column(2), weight, total, even: weights.is_none() }
    }
}

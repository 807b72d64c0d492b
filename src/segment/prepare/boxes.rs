//! Boxes about points, and how far many of them are from one.

#![expect(clippy::needless_range_loop, reason = "lanes read best by index")]

use crate::geometry::Vec3;

/// Boxes measured at once.
pub const LANES: usize = 8;

/// A box with sides along the axes.
#[derive(Clone, Copy)]
pub struct Box {
    pub low: Vec3,
    pub high: Vec3,
}

impl Box {
    /// That of some points, at least one.
    pub fn of(points: &[Vec3]) -> Self {
        let (first, rest) = (points[0], &points[1..]);
        rest.iter()
            .fold(Self { low: first, high: first }, |b, p| b.with(&Self { low: *p, high: *p }))
    }

    /// That of both.
    pub fn with(&self, other: &Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }
}

/// A few boxes side by side.
#[derive(Clone)]
pub struct Lanes {
    low: [[f64; LANES]; 3],
    high: [[f64; LANES]; 3],
}

impl Lanes {
    /// At most `LANES` boxes; those that are missing are infinitely far.
    pub fn of(boxes: &[Box]) -> Self {
        let mut out = Self { low: [[f64::INFINITY; LANES]; 3], high: [[f64::INFINITY; LANES]; 3] };
        for (l, b) in boxes.iter().enumerate() {
            for k in 0..3 {
                (out.low[k][l], out.high[k][l]) = (b.low[k], b.high[k]);
            }
        }
        out
    }

    /// Squared distances to a box, 0 where they meet.
    #[inline(always)]
    pub fn sq_gaps(&self, other: &Box) -> [f64; LANES] {
        let mut sq = [0.0; LANES];
        for k in 0..3 {
            for l in 0..LANES {
                let (below, above) =
                    (self.low[k][l] - other.high[k], other.low[k] - self.high[k][l]);
                // f64::max looks at NaN, of which there is none.
                let gap = if below > above { below } else { above };
                let gap = if gap > 0.0 { gap } else { 0.0 };
                sq[l] += gap * gap;
            }
        }
        sq
    }
}

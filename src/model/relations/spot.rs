//! Where axes stand across their common direction.

use nalgebra::Vector2;

/// One place of a pattern: where an axis stands across the direction, how exactly that is known, and its face.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Where it stands.
    pub z: Vector2<f64>,
    /// The larger standard deviation of that.
    pub deviation: f64,
    /// The face.
    pub face: usize,
}

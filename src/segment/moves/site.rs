//! A region, and what is known around it.

use crate::fit::Shape;
use crate::segment::family::Families;
use crate::segment::moves::directions::Directions;
use crate::segment::partition::Partition;
use crate::segment::prepare::scene::Scene;

/// A region that may be split.
pub struct Site<'a> {
    /// The scene.
    pub scene: &'a Scene<'a>,
    /// Its regions as they are.
    pub model: &'a Partition,
    /// What may be fitted.
    pub families: &'a Families,
    /// Normals of the planes.
    pub directions: &'a Directions,
    /// The region.
    pub region: usize,
    /// Its points, ascending.
    pub group: &'a [u32],
}

impl Site<'_> {
    /// The region's surface.
    pub fn shape(&self) -> &Shape {
        &self.model.shapes[self.region]
    }
}

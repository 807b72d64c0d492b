//! A frame of the scene's size.

use crate::fit::{Family, Shape};
use crate::geometry::Vec3;
use crate::segment::Extent;

/// A frame about the scene's middle with its size as the unit, to the next power of two: numbers read back as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Its origin in the file's coordinates.
    pub origin: Vec3,
    /// The length of one unit.
    pub unit: f64,
    /// The longest side of the box around all regions, in units: in (1/2, 1].
    pub size: f64,
}

impl Frame {
    /// That of regions that lie within `extents`; `None` where there are none or they have no size.
    pub fn of(extents: impl Iterator<Item = Extent>) -> Option<Self> {
        let joined = |a: Extent, b: Extent| Extent {
            min: Vec3::from(a.min).inf(&b.min.into()).into(),
            max: Vec3::from(a.max).sup(&b.max.into()).into(),
        };
        let all = extents.reduce(joined)?;
        let (min, max) = (Vec3::from(all.min), Vec3::from(all.max));
        let size = (max - min).max();
        let unit = size.log2().ceil().exp2();
        (unit.is_normal() && unit >= size).then_some(Self {
            origin: min + (max - min) / 2.0,
            unit,
            size: size / unit,
        })
    }

    /// A shape of the file's coordinates in this frame.
    pub fn local(&self, shape: &Shape) -> Shape {
        let origin = (shape.origin - self.origin) / self.unit;
        Shape { origin, size: sizes(shape, 1.0 / self.unit), ..*shape }
    }

    /// A shape of this frame in the file's coordinates.
    pub fn world(&self, shape: &Shape) -> Shape {
        let origin = shape.origin * self.unit + self.origin;
        Shape { origin, size: sizes(shape, self.unit), ..*shape }
    }

    /// A point of this frame in the file's coordinates.
    pub fn world_point(&self, p: &Vec3) -> Vec3 {
        p * self.unit + self.origin
    }
}

/// The sizes of a shape drawn to scale; a cone's angle stays.
fn sizes(shape: &Shape, scale: f64) -> [f64; 3] {
    let [a, b, c] = shape.size;
    if shape.family == Family::Cone { [a * scale, b, c] } else { [a, b, c].map(|s| s * scale) }
}

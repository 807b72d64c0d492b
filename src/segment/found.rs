//! What the default method found.

use crate::fit::Shape;
use crate::geometry::Vec3;
use crate::segment::Counters;
use crate::segment::prepare::scene::Scene;

/// What the default method found.
pub struct Found<'a> {
    /// The cloud's distinct points relative to `centre`, in Morton order.
    pub points: Vec<Vec3>,
    /// The cloud's centre.
    pub centre: Vec3,
    /// Where each of the cloud's points stands in `points`.
    pub places: Vec<u32>,
    /// Each region's surface, relative to `centre`.
    pub shapes: Vec<Shape>,
    /// Each point's region, -1 = none.
    pub labels: Vec<i32>,
    /// The noise's standard deviation, as estimated or given.
    pub noise: f64,
    /// Largest distance of a point from its surface, unless one was given.
    pub reach: f64,
    /// Noise below this is that of the coordinates' digits.
    pub rounding: f64,
    /// The points that surfaces were looked for on, taken evenly from `points`: see [`place`].
    pub scene: Scene<'a>,
    /// How much work it was.
    pub counters: Counters,
}

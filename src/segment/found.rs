//! What the default method found.

use crate::fit::{Held, Shape};
use crate::geometry::Vec3;
use crate::segment::prepare::scene::Scene;
use crate::segment::{Counters, objective};

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
    /// Largest distance of a point from its surface, for each, unless one was given.
    pub reaches: Vec<f64>,
    /// The scatter that points were given to each by.
    pub sigmas: Vec<f64>,
    /// Noise below this is that of the coordinates' digits.
    pub rounding: f64,
    /// The points that surfaces were looked for on, taken evenly from `points`: see [`place`].
    pub scene: Scene<'a>,
    /// Of each region that a person told of what is known of it beforehand; none of the others.
    pub told: Vec<Option<Held>>,
    /// The material's outward normal at each point, as the file has it; zero where it has none there.
    pub normals: Option<Vec<Vec3>>,
    /// How much work it was.
    pub counters: Counters,
}

impl Found<'_> {
    /// Largest distance of any point from its surface.
    pub fn reach(&self) -> f64 {
        self.reaches.iter().fold(objective::ACCEPT.get() * self.noise, |a, b| a.max(*b))
    }
}

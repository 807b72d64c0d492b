use super::{Bounds, FormatError, memory::room_for};
use crate::geometry::{Grid, LengthUnit, PointCloud, Vec3};

/// Where the points of a file go, in their order, those that are not finite among them.
pub trait Sink: Send {
    /// There will be no more than so many points.
    ///
    /// # Errors
    /// There is no memory for them.
    fn expect(&mut self, most: u64) -> Result<(), FormatError>;

    /// The next points.
    ///
    /// # Errors
    /// They are not wanted.
    fn take(&mut self, points: &[Vec3]) -> Result<(), FormatError>;
}

/// All points are kept.
impl Sink for Vec<Vec3> {
    fn expect(&mut self, most: u64) -> Result<(), FormatError> {
        *self = room_for(most)?;
        Ok(())
    }

    fn take(&mut self, points: &[Vec3]) -> Result<(), FormatError> {
        self.extend_from_slice(points);
        Ok(())
    }
}

/// What a file says of its points, beside where they are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct About {
    /// Rows and columns.
    pub grid: Option<Grid>,
    /// The unit of its lengths.
    pub unit: Option<LengthUnit>,
    /// The step in which its numbers came before a pose was applied, as far as it is known: 0 where not.
    pub resolution: f64,
}

impl About {
    /// The cloud of these points.
    pub fn cloud(self, points: Vec<Vec3>) -> PointCloud {
        let Self { grid, unit, resolution } = self;
        PointCloud { grid, unit, resolution, ..PointCloud::from_points(points) }
    }
}

/// Points that come one at a time, handed on many at a time.
pub(super) struct Singly<'a> {
    sink: &'a mut dyn Sink,
    limits: &'a dyn Bounds,
    block: Vec<Vec3>,
    before: usize,
}

impl<'a> Singly<'a> {
    /// Points handed on at a time: as many as a look at the limits is about.
    const BLOCK: usize = 4096;

    /// Hands points on to `sink`.
    pub(super) fn new(sink: &'a mut dyn Sink, limits: &'a dyn Bounds) -> Self {
        Self { sink, limits, block: Vec::with_capacity(Self::BLOCK), before: 0 }
    }

    /// Points so far.
    pub(super) fn count(&self) -> usize {
        self.before + self.block.len()
    }

    /// The next point.
    ///
    /// # Errors
    /// There are too many, or they are not wanted.
    pub(super) fn push(&mut self, point: Vec3) -> Result<(), FormatError> {
        self.limits.check(self.count() as u64 + 1)?;
        self.block.push(point);
        if self.block.len() == Self::BLOCK { self.end() } else { Ok(()) }
    }

    /// Hands on what is left.
    ///
    /// # Errors
    /// The points are not wanted.
    pub(super) fn end(&mut self) -> Result<(), FormatError> {
        self.before += self.block.len();
        self.sink.take(&self.block)?;
        self.block.clear();
        Ok(())
    }
}

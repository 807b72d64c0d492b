use std::io;

use rayon::prelude::*;

use crate::formats::Fields;
use crate::geometry::{Grid, PointCloud, Vec3};

/// Takes some points, the next ones.
pub type TakePoints<'a> = dyn FnMut(&[Vec3]) -> io::Result<()> + Send + 'a;

/// All points of an input, in its order.
pub trait EachPoint: Sync {
    /// Hands all points on, some at a time; NaN stands for those that were left out.
    ///
    /// # Errors
    /// `take` fails, or the points cannot be read.
    fn each_point(&self, take: &mut TakePoints) -> io::Result<()>;

    /// The file's own columns of `count` points from `first` on, where they are not in [`Labelled::fields`].
    fn records(&self, first: usize, count: usize) -> Option<Vec<u8>> {
        let _ = (first, count);
        None
    }
}

impl EachPoint for PointCloud {
    fn each_point(&self, take: &mut TakePoints) -> io::Result<()> {
        self.each_block(take)
    }
}

/// A cloud and what is known about each of its points.
#[derive(Clone, Copy)]
pub struct Labelled<'a> {
    /// The points.
    pub points: &'a dyn EachPoint,
    /// How many there are.
    pub count: usize,
    /// Their rows and columns.
    pub grid: Option<Grid>,
    /// One label for each input point, in input order.
    pub labels: &'a [i32],
    /// The signed distance of a point with that label from its own surface; NaN where it has none.
    pub deviation: &'a (dyn Fn(i32, &Vec3) -> f64 + Sync),
    /// The file's own columns; their records where `points` has none.
    pub fields: &'a Fields,
}

impl std::fmt::Debug for Labelled<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Labelled").field("count", &self.count).finish_non_exhaustive()
    }
}

/// One point with what is known about it.
pub(super) struct Known {
    pub(super) point: Vec3,
    pub(super) label: i32,
    pub(super) deviation: f64,
}

impl Labelled<'_> {
    /// Hands on what is known of each point, some at a time, with the place of the first.
    ///
    /// # Errors
    /// `take` fails, or the points cannot be read.
    pub(super) fn each(
        &self,
        mut take: impl FnMut(usize, &[Known]) -> io::Result<()> + Send,
    ) -> io::Result<()> {
        /// Points worked on at a time: as many as all threads have something to do with.
        const BLOCK: usize = 1 << 16;
        let (mut first, mut known) = (0, Vec::new());
        self.points.each_point(&mut |points| {
            for points in points.chunks(BLOCK) {
                let one = |(k, &point): (usize, &Vec3)| {
                    let label = self.labels.get(first + k).copied().unwrap_or(-1);
                    Known { point, label, deviation: (self.deviation)(label, &point) }
                };
                points
                    .par_iter()
                    .with_min_len(1024)
                    .enumerate()
                    .map(one)
                    .collect_into_vec(&mut known);
                take(first, &known)?;
                first += points.len();
            }
            Ok(())
        })
    }
}

use std::num::NonZeroUsize;

use kiddo::{ImmutableKdTree, SquaredEuclidean};

use crate::geometry::Vec3;

/// Why no search tree could be built: the cloud has more points than 32-bit indices count.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no neighbour search over {points} points: {reason}")]
pub struct PoolError {
    /// Points in the cloud.
    pub points: usize,
    /// What the search tree said.
    pub reason: String,
}

/// The points that may still be taken into a region, with a search tree over them.
pub struct Pool {
    points: Vec<Vec3>,
    /// The cloud's index of each point.
    cloud_index: Vec<u32>,
    taken: Vec<bool>,
    /// Those not taken, ascending.
    available: Vec<u32>,
    tree: ImmutableKdTree<f64, 3>,
    min: Vec3,
    max: Vec3,
}

impl Pool {
    /// All of `points`.
    ///
    /// # Errors
    /// The tree cannot index them.
    pub fn new(points: &[Vec3]) -> Result<Self, PoolError> {
        Self::build(points.to_vec(), (0..points.len() as u32).collect())
    }

    fn build(points: Vec<Vec3>, cloud_index: Vec<u32>) -> Result<Self, PoolError> {
        let coordinates: Vec<[f64; 3]> = points.iter().map(|p| (*p).into()).collect();
        let tree = ImmutableKdTree::new_from_slice(&coordinates)
            .map_err(|e| PoolError { points: points.len(), reason: e.to_string() })?;
        let taken = vec![false; points.len()];
        let available = (0..points.len() as u32).collect();
        let min = points.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
        let max = points.iter().copied().reduce(|a, b| a.sup(&b)).unwrap_or_default();
        Ok(Self { points, cloud_index, taken, available, tree, min, max })
    }

    /// How many points it holds, taken ones included: indices run below this.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// The point of that index.
    pub fn point(&self, index: u32) -> &Vec3 {
        &self.points[index as usize]
    }

    /// The cloud's index of that point.
    pub fn cloud_index(&self, index: u32) -> u32 {
        self.cloud_index[index as usize]
    }

    /// The points not taken yet, ascending.
    pub fn available(&self) -> &[u32] {
        &self.available
    }

    /// Whether the point may still be taken.
    pub fn is_available(&self, index: u32) -> bool {
        !self.taken[index as usize]
    }

    /// Takes points out. Once half of the tree is taken it is built anew over the rest, so that
    /// searches never wade through more than twice the points there are; indices change then.
    ///
    /// # Errors
    /// As for [`Self::new`].
    pub fn take(&mut self, indices: &[u32]) -> Result<(), PoolError> {
        for &i in indices {
            self.taken[i as usize] = true;
        }
        self.available.retain(|&i| !self.taken[i as usize]);
        if self.available.len() * 2 < self.points.len() {
            let points = self.available.iter().map(|&i| *self.point(i)).collect();
            let cloud_index = self.available.iter().map(|&i| self.cloud_index(i)).collect();
            *self = Self::build(points, cloud_index)?;
        }
        Ok(())
    }

    /// The points within `radius` of `center` with their squared distances, in no order.
    pub fn within(&self, center: &Vec3, radius: f64) -> impl Iterator<Item = (f64, u32)> {
        let center: [f64; 3] = (*center).into();
        let sq_radius = radius * radius;
        let found = self
            .tree
            .query(&center)
            .within::<SquaredEuclidean<f64>>(sq_radius)
            .unsorted()
            .execute();
        found.into_iter().map(|n| (n.distance, n.item))
    }

    /// The distance to the `count`-th nearest point of `center`, the farthest where there are fewer.
    pub fn distance_to_nth(&self, center: &Vec3, count: usize) -> f64 {
        let Some(count) = NonZeroUsize::new(count) else { return 0.0 };
        let center: [f64; 3] = (*center).into();
        let found = self.tree.query(&center).nearest_n::<SquaredEuclidean<f64>>(count).execute();
        found.last().map_or(0.0, |n| n.distance.sqrt())
    }

    /// A distance from `center` that no point exceeds.
    pub fn farthest(&self, center: &Vec3) -> f64 {
        let reach = (self.max - center).abs().sup(&(self.min - center).abs());
        reach.norm() * (1.0 + 1e-12)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_is_rebuilt_once_half_of_it_is_taken() {
        let points: Vec<_> = (0..10).map(|i| Vec3::new(f64::from(i), 0.0, 0.0)).collect();
        let mut pool = Pool::new(&points).unwrap();
        pool.take(&[0, 2, 4]).unwrap();
        assert_eq!((pool.len(), pool.available()), (10, &[1, 3, 5, 6, 7, 8, 9][..]));
        assert!(!pool.is_available(4));
        pool.take(&[6, 7, 8]).unwrap();
        assert_eq!((pool.len(), pool.available().len()), (4, 4));
        let rest: Vec<_> = (0..4).map(|i| pool.cloud_index(i)).collect();
        assert_eq!(rest, [1, 3, 5, 9]);
    }

    #[test]
    fn many_coinciding_points_can_be_searched() {
        let pool = Pool::new(&[Vec3::new(1.0, 2.0, 3.0); 500]).unwrap();
        assert_eq!(pool.within(pool.point(0), 0.0).count(), 500);
    }
}

use super::Pool;
use crate::fit::constant::constants;
use crate::fit::{Condition, Scatter};

/// A region while it grows.
pub struct Region {
    members: Vec<u32>,
    inside: Vec<bool>,
    /// Where the points added under the current seed begin in `members`.
    current_start: usize,
    condition: Condition,
    /// S at 32, 64, 128, ... points.
    stages: Vec<Scatter>,
}

constants! {
    /// Points at the first stage.
    FIRST_STAGE: usize = 32, Effort("points of the first look");
}

impl Region {
    /// Of no points; `condition` must be empty and in a frame near the points to come.
    pub fn new(pool: &Pool, condition: Condition) -> Self {
        let inside = vec![false; pool.len()];
        Self { members: Vec::new(), inside, current_start: 0, condition, stages: Vec::new() }
    }

    /// Its points in the order they were added.
    pub fn members(&self) -> &[u32] {
        &self.members
    }

    /// The points added under the current seed point, in order.
    pub fn current(&self) -> &[u32] {
        &self.members[self.current_start..]
    }

    /// Whether the point is in it.
    pub fn contains(&self, index: u32) -> bool {
        self.inside[index as usize]
    }

    /// S of its points, and its condition.
    pub fn condition(&self) -> &Condition {
        &self.condition
    }

    /// From here on points are added under a new seed.
    pub fn begin_seed(&mut self) {
        self.current_start = self.members.len();
    }

    /// Forgets a seed under which nothing was added: the one that began at `start` is current again.
    pub fn return_to_seed(&mut self, start: usize) {
        self.current_start = start;
    }

    /// Where the current seed's points begin, for [`Self::return_to_seed`].
    pub fn seed_start(&self) -> usize {
        self.current_start
    }

    /// Adds a point whose condition with the region is `condition`.
    pub fn add(&mut self, index: u32, condition: Condition) {
        self.members.push(index);
        self.inside[index as usize] = true;
        self.condition = condition;
        if self.members.len() == FIRST_STAGE.get() << self.stages.len() {
            self.stages.push(*self.condition.scatter());
        }
    }

    /// S, in the condition's frame, of the region as it is and as it was at each doubling of its
    /// size: a region that has grown over a joint was a pure one before.
    pub fn stages(&self) -> impl Iterator<Item = &Scatter> {
        self.stages.iter().chain([self.condition.scatter()])
    }
}

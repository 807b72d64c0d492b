//! Moves on the description of a scene, until none makes it shorter.

pub mod adopt;
pub mod directions;
pub mod joint;
pub mod memo;
pub mod merge;
pub mod pieces;
pub mod planes;
pub mod remove;
pub mod retype;
pub mod rings;
pub mod settle;
pub mod step;
pub mod strips;
pub mod swap;
#[cfg(test)]
mod tests;
pub mod trial;

use crate::segment::family::Families;
use crate::segment::moves::joint::split_compounds;
use crate::segment::moves::merge::merge;
use crate::segment::moves::planes::break_bridges;
use crate::segment::moves::remove::remove_needless;
use crate::segment::moves::retype::retype;
use crate::segment::moves::settle::settle;
use crate::segment::moves::step::split_steps;
use crate::segment::moves::swap::swap_families;
use crate::segment::partition::{Partition, prune};
use crate::segment::prepare::scene::Scene;
use crate::segment::{Cancelled, Monitor};

/// Rounds of moves on the total energy after each pass.
const MOVES: usize = 3;

/// Settles labels, families and surfaces: relabelling with refits, types, merging, then moves on the
/// total energy.
pub fn converge(
    scene: &Scene,
    model: &mut Partition,
    families: &Families,
    monitor: &dyn Monitor,
) -> Result<(), Cancelled> {
    for _ in 0..2 {
        monitor.check()?;
        settle(scene, model, families.sigma, 8);
        monitor.check()?;
        let retyped = retype(scene, model, families);
        monitor.check()?;
        let merged = merge(scene, model, families);
        model.merges += merged;
        let pruned = prune(model, families.policy.least);
        if retyped + merged == 0 && !pruned {
            break;
        }
    }
    settle(scene, model, families.sigma, 8);
    for _ in 0..MOVES {
        if !families.policy.refine {
            break;
        }
        monitor.check()?;
        let gone = remove_needless(scene, model, families);
        monitor.check()?;
        let swapped = swap_families(scene, model, families);
        monitor.check()?;
        let broken = break_bridges(scene, model, families)
            + split_steps(scene, model, families)
            + split_compounds(scene, model, families);
        monitor.check()?;
        model.merges += merge(scene, model, families);
        monitor.check()?;
        settle(scene, model, families.sigma, 8);
        if gone + swapped + broken == 0 {
            break;
        }
    }
    monitor.check()?;
    prune(model, families.policy.least);
    Ok(())
}

//! Moves on the description of a scene, until none makes it shorter.

pub mod adopt;
pub mod directions;
pub mod glance;
pub mod joint;
pub mod memo;
pub mod merge;
pub mod pieces;
pub mod planes;
pub mod remove;
pub mod retype;
pub mod rings;
pub mod settle;
pub mod site;
pub mod split;
pub mod step;
pub mod strips;
pub mod swap;
#[cfg(test)]
mod tests;
pub mod trial;

use crate::fit::constant::constants;
use crate::segment::family::Families;
use crate::segment::moves::merge::merge;
use crate::segment::moves::remove::remove_needless;
use crate::segment::moves::retype::retype;
use crate::segment::moves::settle::settle;
use crate::segment::moves::split::split;
use crate::segment::moves::swap::swap_families;
use crate::segment::objective::DOUBT;
use crate::segment::partition::{Partition, prune};
use crate::segment::prepare::scene::Scene;
use crate::segment::{Cancelled, Monitor};

constants! {
    /// Rounds of labels and fits that settle.
    SETTLED: usize = 8, Effort("rounds of labels and fits");
    /// Those that show what is one surface.
    FEW: usize = 2, Effort("rounds of labels and fits");
    /// Rounds of moves after each pass at most: each makes the description shorter, and three are mostly enough.
    MOVES: usize = 12, Effort("rounds of moves");
}

/// Settles labels, families and surfaces: relabelling with refits, types, merging, then moves on the
/// total energy.
pub fn converge(
    scene: &Scene,
    model: &mut Partition,
    families: &Families,
    monitor: &dyn Monitor,
) -> Result<(), Cancelled> {
    // What several hypotheses share is joined before labels settle among them.
    for rounds in [FEW.get(), SETTLED.get()] {
        monitor.check()?;
        settle(scene, model, families.sigma, rounds);
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
    settle(scene, model, families.sigma, SETTLED.get());
    if families.policy.refine {
        improve(scene, model, families, monitor)?;
    }
    monitor.check()?;
    prune(model, families.policy.least);
    Ok(())
}

/// Moves of each kind in turn, as long as any makes the description of the scene shorter. Those of one kind that make
/// it longer once labels have settled are taken back, and no more of it are tried.
fn improve(
    scene: &Scene,
    model: &mut Partition,
    families: &Families,
    monitor: &dyn Monitor,
) -> Result<(), Cancelled> {
    let mut kinds: Vec<Moves> = vec![remove_needless, swap_families, split_and_merge];
    let mut energy = model.energy(scene, families.sigma);
    for _ in 0..MOVES.get() {
        let mut gained = false;
        let mut next = Vec::with_capacity(kinds.len());
        for kind in kinds {
            monitor.check()?;
            let (shapes, labels, merges) =
                (model.shapes.clone(), model.labels.clone(), model.merges);
            if kind(scene, model, families) > 0 {
                settle(scene, model, families.sigma, SETTLED.get());
                let after = model.energy(scene, families.sigma);
                if after > energy + DOUBT.get() {
                    (model.shapes, model.labels, model.merges) = (shapes, labels, merges);
                    model.note(scene, families.sigma);
                    continue;
                }
                (energy, gained) = (after, true);
            }
            next.push(kind);
        }
        kinds = next;
        if !gained {
            break;
        }
    }
    Ok(())
}

/// Moves of one kind; returns how many there were.
type Moves = fn(&Scene<'_>, &mut Partition, &Families) -> usize;

/// Surfaces that stand for several give way to these, and what is one surface is joined.
fn split_and_merge(scene: &Scene<'_>, model: &mut Partition, families: &Families) -> usize {
    let broken = split(scene, model, families);
    let merged = merge(scene, model, families);
    model.merges += merged;
    broken + merged
}

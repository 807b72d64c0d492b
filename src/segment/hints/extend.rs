//! A surface that was told takes what is its own of what lies around it.

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::fit::{Family, Held, Ruler};
use crate::segment::found::Found;
use crate::segment::hints::local::{families, refitted};
use crate::segment::hints::place::of_region;
use crate::segment::label::blocks::BLOCK;
use crate::segment::label::relabel::relabel;
use crate::segment::moves::merge;
use crate::segment::objective::{ACCEPT, LITTLE};
use crate::segment::partition::Partition;
use crate::segment::{Cancelled, Monitor, Parameters};

constants! {
    /// Rounds of labels and fits.
    ROUNDS: usize = 8, Effort("rounds of labels and fits");
    /// Sweeps of one relabelling.
    SWEEPS: usize = 12, Effort("sweeps of one relabelling");
    /// Regions joined to one at most.
    JOINED: usize = 100, Effort("regions joined to one");
}

/// Joins the regions that are the same surface as the one at `own`, unless somebody told of them too or the caller wants
/// none `joined`, and lets it compete for the points around it.
///
/// # Errors
/// `monitor` cancelled the work.
pub fn extend(
    found: &mut Found,
    own: usize,
    sigma: f64,
    joined: bool,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<(), Cancelled> {
    let held = found.told[own].unwrap_or_default();
    if joined && parameters.merge {
        join(found, own, sigma, &held, parameters, monitor)?;
    }
    for _ in 0..ROUNDS.get() {
        monitor.check()?;
        let turned = claim(found, own, sigma);
        let members = of_region(found, own as i32);
        found.shapes[own] = refitted(found, &members, &found.shapes[own], &held);
        if turned == 0 {
            break;
        }
    }
    Ok(())
}

/// Joins regions with the one at `own` where one surface for both costs less.
fn join(
    found: &mut Found,
    own: usize,
    sigma: f64,
    held: &Held,
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Result<(), Cancelled> {
    let families = families(found, Family::ALL.to_vec(), sigma, parameters);
    for _ in 0..JOINED.get() {
        monitor.check()?;
        // the one at `own` comes last: pairs with it alone are looked at
        let last = found.shapes.len() - 1;
        let swap = |l: usize| {
            if l == own {
                last
            } else if l == last {
                own
            } else {
                l
            }
        };
        let shapes = (0..=last).map(|l| found.shapes[swap(l)]).collect();
        let moved = |l: i32| usize::try_from(l).map_or(-1, |l| swap(l) as i32);
        let labels = scene_labels(found).into_iter().map(moved).collect();
        let mut model = Partition { shapes, labels, ..Partition::default() };
        let pairs = merge::found(&found.scene, &mut model, &families, last);
        let family = found.shapes[own].family;
        let pair = pairs.into_iter().find(|joint| {
            let other = swap(joint.pair.0);
            joint.shape.family == family && found.told[other].is_none()
        });
        let Some(other) = pair.map(|joint| swap(joint.pair.0)) else { break };
        let mut both = of_region(found, own as i32);
        both.extend(of_region(found, other as i32));
        both.sort_unstable();
        found.shapes[own] = refitted(found, &both, &found.shapes[own], held);
        both.iter().for_each(|&i| found.labels[i as usize] = own as i32);
        found.reaches[own] = found.reaches[own].max(found.reaches[other]);
        found.counters.merges += 1;
    }
    Ok(())
}

/// The labels of the scene's points.
fn scene_labels(found: &Found) -> Vec<i32> {
    found.scene.places.iter().map(|&i| found.labels[i as usize]).collect()
}

/// Labels the points beside the region at `own` anew, those of surfaces that were told apart. Returns how many changed.
fn claim(found: &mut Found, own: usize, sigma: f64) -> usize {
    let places = &found.scene.places;
    let (m, n) = (places.len(), found.labels.len());
    let before = scene_labels(found);
    let mut after = before.clone();
    let blocks: Vec<usize> = (0..m.div_ceil(BLOCK)).collect();
    relabel(&found.scene, &found.shapes, &mut after, sigma, SWEEPS.get(), &blocks);
    let own = own as i32;
    let is_free = |l: i32| l == own || usize::try_from(l).map_or(true, |l| found.told[l].is_none());
    for (new, old) in after.iter_mut().zip(&before) {
        let is_ours = (*new == own) != (*old == own);
        if !is_ours || !is_free(*old) || !is_free(*new) {
            *new = *old;
        }
    }
    let rulers: Vec<Ruler> = found.shapes.iter().map(Ruler::of).collect();
    let reach = (ACCEPT.get() * sigma).powi(2);
    let sq = |l: i32, i: usize| {
        usize::try_from(l).map_or(reach, |l| rulers[l].distance(&found.points[i]).powi(2))
    };
    // Points between those of the scene go with these where they change.
    let next: Vec<i32> = (0..n)
        .into_par_iter()
        .with_min_len(4096)
        .map(|i| {
            let l = found.labels[i];
            // the point of the scene that is this one, or the next before it
            let q = places.partition_point(|&k| k as usize <= i).saturating_sub(1);
            if places[q] as usize == i {
                return after[q];
            }
            let beside = [q, (q + 1).min(m - 1)];
            let won = beside.iter().any(|&k| after[k] == own && before[k] != own);
            if won && l != own && is_free(l) && sq(own, i) < sq(l, i) { own } else { l }
        })
        .collect();
    let mut lost = vec![0usize; found.shapes.len()];
    let mut turned = 0;
    for (new, old) in next.iter().zip(&found.labels).filter(|(new, old)| new != old) {
        turned += 1;
        for l in [*new, *old].into_iter().filter_map(|l| usize::try_from(l).ok()) {
            lost[l] += 1;
        }
    }
    found.labels = next;
    refit_others(found, own, &lost);
    turned
}

/// Fits surfaces anew that lost or won a good part of their points to the one at `own`.
fn refit_others(found: &mut Found, own: i32, turned: &[usize]) {
    for l in (0..turned.len()).filter(|&l| l as i32 != own && turned[l] > 0) {
        let members = of_region(found, l as i32);
        if turned[l] as f64 > LITTLE.get() * LITTLE.get() * members.len() as f64
            && members.len() > found.shapes[l].family.dof()
        {
            found.shapes[l] = refitted(found, &members, &found.shapes[l], &Held::default());
        }
    }
}

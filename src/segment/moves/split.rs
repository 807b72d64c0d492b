//! Surfaces that stand for several: other surfaces in their place.

use rayon::prelude::*;

use crate::fit::Family;
use crate::segment::family::Families;
use crate::segment::grow::walk::Walk;
use crate::segment::moves::directions::Directions;
use crate::segment::moves::memo::{Key, Memo, Move};
use crate::segment::moves::pieces::Piece;
use crate::segment::moves::site::Site;
use crate::segment::moves::{joint, planes, rings, step, strips};
use crate::segment::partition::{Partition, members, neighbours_of};
use crate::segment::prepare::scene::Scene;

/// The surfaces that take the region's place, each with its points: those of the first proposal that gains.
fn pieces(site: &Site<'_>, walk: &mut Walk) -> Option<Vec<Piece>> {
    let bridge = if site.shape().family == Family::Plane {
        strips::instead(site)
    } else {
        rings::instead(site).or_else(|| planes::instead(site, walk))
    };
    bridge.or_else(|| step::sides(site)).or_else(|| joint::sides(site))
}

/// Puts several surfaces in the place of each that they explain better: planes or cones instead of what bridges them,
/// and the two sides of a step or of a smooth joint. Returns how many surfaces went.
pub fn split(scene: &Scene, model: &mut Partition, families: &Families) -> usize {
    model.note(scene, families.sigma);
    let groups = members(&model.labels, model.shapes.len());
    let around = neighbours_of(&model.changes.borders(), groups.len());
    let directions = &Directions::of(scene, &model.shapes, &groups);
    let frozen: &Partition = model;
    let key = |r: usize| Memo::key(&frozen.changes, Move::Split, r, around[r].iter().copied());
    let keys: Vec<Option<Key>> = (0..groups.len()).map(key).collect();
    let splits: Vec<Option<Vec<Piece>>> = groups
        .par_iter()
        .enumerate()
        .map_init(
            || Walk::new(scene.len()),
            |walk, (region, group)| {
                if frozen.vain.is_vain(keys[region].as_ref()) || scene.cancelled() {
                    return None;
                }
                let site = Site { scene, model: frozen, families, directions, region, group };
                pieces(&site, walk)
            },
        )
        .collect();
    model.vain.add(keys, &splits);
    let mut count = 0;
    for (region, pieces) in splits.into_iter().enumerate() {
        let Some(pieces) = pieces else { continue };
        count += 1;
        // what belongs to no piece yet goes to the one that suits it as labels settle
        groups[region].iter().for_each(|&i| model.labels[i as usize] = -1);
        let more = model.shapes.len() - 1;
        for (k, (shape, piece)) in pieces.into_iter().enumerate() {
            let label = if k == 0 { region } else { more + k };
            if k == 0 {
                model.shapes[region] = shape;
            } else {
                model.shapes.push(shape);
            }
            piece.into_iter().for_each(|i| model.labels[i as usize] = label as i32);
        }
    }
    count
}

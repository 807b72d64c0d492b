//! Taking out surfaces that others make needless.

use crate::fit::constant::constants;
use crate::fit::{Family, Shape};
use crate::geometry::Vec3;
use crate::segment::family::Families;
use crate::segment::moves::directions::{Directions, asked};
use crate::segment::moves::glance::Glance;
use crate::segment::moves::memo::{Memo, Move};
use crate::segment::objective::{SURFACE, unassigned};
use crate::segment::partition::{Partition, members, neighbours_of, retain};
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::take;

/// Takes out every region whose points its neighbours explain more cheaply than it does, counting
/// what the surface itself costs. Smallest regions first. Returns how many went.
pub fn remove_needless(scene: &Scene, model: &mut Partition, families: &Families) -> usize {
    model.note(scene, families.sigma);
    let inverse = 1.0 / (families.sigma * families.sigma);
    // A surface elsewhere that explains a region is the same surface: whether they join is the user's choice.
    let elsewhere = families.policy.merge;
    let groups = members(&model.labels, model.shapes.len());
    let around = neighbours_of(&model.changes.borders(), model.shapes.len());
    let directions = Directions::of(scene, &model.shapes, &groups);
    let mut order: Vec<usize> = (0..groups.len()).collect();
    order.sort_by_key(|&k| (groups[k].len(), k));
    let mut keep = vec![true; groups.len()];
    for b in order {
        if scene.cancelled() {
            return 0;
        }
        let key = Memo::key(&model.changes, Move::Remove, b, around[b].iter().copied());
        if model.vain.is_vain(key.as_ref()) {
            continue;
        }
        let s = model.shapes[b];
        let n = groups[b].len();
        if n == 0 {
            keep[b] = false;
            continue;
        }
        let elsewhere =
            if elsewhere { explaining(scene, model, &groups[b], b, inverse) } else { Vec::new() };
        let others = elsewhere.iter().flat_map(|&a| take(scene, &groups[a], SAMPLE.get()));
        let count = elsewhere.iter().map(|&a| groups[a].len()).sum::<usize>();
        let length = own_length(scene, &s, &groups[b], others, count, &directions, families);
        // A surface elsewhere must explain the region as well as its own does: what it saves is the
        // parameters alone. Beside it a region may be a fragment of the labels' making.
        let moved = [(&around[b], SURFACE.get()), (&elsewhere, 0.0)].into_iter().find_map(
            |(near, saved)| {
                let kept = near.iter().copied().filter(|&a| keep[a]);
                let saved = (length + saved) * families.repeats();
                explained_by(scene, model, &groups[b], b, kept, saved, inverse)
            },
        );
        if let Some(moved) = moved {
            keep[b] = false;
            for (&i, l) in groups[b].iter().zip(moved) {
                model.labels[i as usize] = l;
            }
        } else {
            model.vain.add(vec![key], &[None::<()>]);
        }
    }
    let gone = keep.iter().filter(|k| !**k).count();
    retain(model, &keep);
    gone
}

/// What a region's surface costs beside its residuals: for a plane that could as well be parallel to a better
/// known one, what that one costs. `others` are some of the `count` points of the surfaces it may belong to.
fn own_length(
    scene: &Scene,
    s: &Shape,
    group: &[u32],
    others: impl Iterator<Item = Vec3>,
    count: usize,
    directions: &Directions,
    families: &Families,
) -> f64 {
    if s.family != Family::Plane {
        return s.family.description_length(families.worth(group.len()));
    }
    let points = take(scene, group, usize::MAX);
    let whole: Vec<Vec3> = take(scene, group, SAMPLE.get()).into_iter().chain(others).collect();
    let needed = asked(&whole, group.len() + count);
    directions.length(s, &points, needed, families)
}

/// Labels for the points of region `b` from the regions `near`, where their surfaces explain them for less
/// than its own and what is `saved` with it.
fn explained_by(
    scene: &Scene,
    model: &Partition,
    group: &[u32],
    b: usize,
    near: impl Iterator<Item = usize> + Clone,
    saved: f64,
    inverse: f64,
) -> Option<Vec<i32>> {
    let mut rise = -saved;
    let mut moved = Vec::with_capacity(group.len());
    for &i in group {
        let p = &scene.points[i as usize];
        let own = model.shapes[b].distance(p).powi(2) * inverse;
        let other = near
            .clone()
            .map(|a| (model.shapes[a].distance(p).powi(2) * inverse, a as i32))
            .fold((unassigned(), -1), |m, c| if c.0 < m.0 { c } else { m });
        rise += other.0 - own;
        moved.push(other.1);
        if rise > 0.0 && moved.len() > group.len() / 2 {
            return None;
        }
    }
    (rise < 0.0).then_some(moved)
}

constants! {
    /// Points of a region that a first look takes.
    LOOK: usize = 24, Effort("points of one look");
    /// Points of a region that tell whether it says a direction.
    SAMPLE: usize = 200, Effort("points of one look");
}

/// Other regions whose surface runs through most of `b`'s points.
fn explaining(
    scene: &Scene,
    model: &Partition,
    group: &[u32],
    b: usize,
    inverse: f64,
) -> Vec<usize> {
    let few = Glance::of(&take(scene, group, LOOK.get()), LOOK.get());
    let reach = (unassigned() / inverse).sqrt();
    (0..model.shapes.len())
        .filter(|&a| {
            let s = &model.shapes[a];
            let near = |p: &&Vec3| s.distance(p).powi(2) * inverse < unassigned();
            a != b
                && few.least_distance(s) < reach
                && few.points.iter().filter(near).count() * 2 > few.points.len()
        })
        .collect()
}

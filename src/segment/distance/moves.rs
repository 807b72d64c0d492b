//! Moves on the total energy of the scene: take a surface out, or put another family in.
//!
//! Residuals of a region whose labels leak over a smooth joint cannot decide its type, nor whether it
//! is needed at all; the energy of all points it could win or lose can.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::directions::{Directions, asked};
use super::engine::{Model, borders, put_in, retain, take, take_core};
use super::family::{Families, Scored};
use super::label::{ACCEPT, members};
use super::scene::Scene;
use super::trial::{Place, Trial};
use crate::fit::starts::Patch;
use crate::fit::{Family, Ruler, Shape};
use crate::geometry::Vec3;

/// Energy of a point without a surface.
pub const UNASSIGNED: f64 = ACCEPT * ACCEPT;
/// Energy of one more surface beside its parameters.
pub const SURFACE: f64 = 120.0;
fn neighbours_of(touching: &BTreeMap<(usize, usize), usize>, regions: usize) -> Vec<Vec<usize>> {
    let mut out = vec![Vec::new(); regions];
    for &(a, b) in touching.keys() {
        out[a].push(b);
        out[b].push(a);
    }
    out
}

/// Takes out every region whose points its neighbours explain more cheaply than it does, counting
/// what the surface itself costs. Smallest regions first. Returns how many went.
pub fn remove_needless(scene: &Scene, model: &mut Model, families: &Families) -> usize {
    let inverse = 1.0 / (families.sigma * families.sigma);
    // A surface elsewhere that explains a region is the same surface: whether they join is the user's choice.
    let elsewhere = families.policy.merge;
    let groups = members(&model.labels, model.shapes.len());
    let around = neighbours_of(&borders(scene, &model.labels), model.shapes.len());
    let directions = Directions::of(scene, &model.shapes, &groups);
    let mut order: Vec<usize> = (0..groups.len()).collect();
    order.sort_by_key(|&k| (groups[k].len(), k));
    let mut keep = vec![true; groups.len()];
    for b in order {
        if scene.cancelled() {
            return 0;
        }
        let s = model.shapes[b];
        let n = groups[b].len();
        if n == 0 {
            keep[b] = false;
            continue;
        }
        let elsewhere =
            if elsewhere { explaining(scene, model, &groups[b], b, inverse) } else { Vec::new() };
        let others = elsewhere.iter().flat_map(|&a| take(scene, &groups[a], 200));
        let count = elsewhere.iter().map(|&a| groups[a].len()).sum::<usize>();
        let length = own_length(scene, &s, &groups[b], others, count, &directions, families);
        // A surface elsewhere must explain the region as well as its own does: what it saves is the
        // parameters alone. Beside it a region may be a fragment of the labels' making.
        let moved =
            [(&around[b], SURFACE), (&elsewhere, 0.0)].into_iter().find_map(|(near, saved)| {
                let kept = near.iter().copied().filter(|&a| keep[a]);
                explained_by(scene, model, &groups[b], b, kept, length + saved, inverse)
            });
        if let Some(moved) = moved {
            keep[b] = false;
            for (&i, l) in groups[b].iter().zip(moved) {
                model.labels[i as usize] = l;
            }
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
        return s.family.description_length(group.len());
    }
    let points = take(scene, group, usize::MAX);
    let whole: Vec<Vec3> = take(scene, group, 200).into_iter().chain(others).collect();
    let needed = asked(&whole, group.len() + count);
    directions.length(s, &points, needed, families)
}

/// Labels for the points of region `b` from the regions `near`, where their surfaces explain them for less
/// than its own and what is `saved` with it.
fn explained_by(
    scene: &Scene,
    model: &Model,
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
            .fold((UNASSIGNED, -1), |m, c| if c.0 < m.0 { c } else { m });
        rise += other.0 - own;
        moved.push(other.1);
        if rise > 0.0 && moved.len() > group.len() / 2 {
            return None;
        }
    }
    (rise < 0.0).then_some(moved)
}

/// Other regions whose surface runs through most of `b`'s points.
fn explaining(scene: &Scene, model: &Model, group: &[u32], b: usize, inverse: f64) -> Vec<usize> {
    let few = take(scene, group, 24);
    (0..model.shapes.len())
        .filter(|&a| {
            let s = &model.shapes[a];
            let near = few.iter().filter(|p| s.distance(p).powi(2) * inverse < UNASSIGNED);
            a != b && near.count() * 2 > few.len()
        })
        .collect()
}

/// Tries other families in each region's place and keeps the one with the least energy. Returns how many
/// regions changed family.
pub fn swap_families(scene: &Scene, model: &mut Model, families: &Families) -> usize {
    let groups = members(&model.labels, model.shapes.len());
    let around = neighbours_of(&borders(scene, &model.labels), model.shapes.len());
    let frozen: &Model = model;
    let rulers: Vec<Ruler> = frozen.shapes.iter().map(Ruler::of).collect();
    let next: Vec<Option<Shape>> = (0..frozen.shapes.len())
        .into_par_iter()
        .map_init(
            || vec![0u32; scene.len()],
            |slot, r| {
                let current = frozen.shapes[r];
                if groups[r].len() < 20 || scene.cancelled() {
                    return None;
                }
                let candidates = candidates(scene, frozen, families, &groups[r], r);
                if candidates.is_empty() {
                    return None;
                }
                let alone = around[r].is_empty();
                let sigma = families.sigma;
                let place = Place::new(scene, frozen, &rulers, r, &groups[r], slot, sigma);
                let (mut least, mut winner) = Trial::new(&place).run(&current, sigma, true);
                for c in candidates {
                    let (e, s) = Trial::new(&place).run(&c, sigma, !alone);
                    if e < least - 1.0 {
                        least = e;
                        winner = s;
                    }
                }
                place.leave();
                (winner.family != current.family).then_some(winner)
            },
        )
        .collect();
    put_in(&mut model.shapes, next)
}

/// One shape of every other family that comes near explaining the region.
fn candidates(
    scene: &Scene,
    model: &Model,
    families: &Families,
    group: &[u32],
    region: usize,
) -> Vec<Shape> {
    let (points, normals) = take_core(scene, &model.labels, group, region as i32, 600);
    let current = model.shapes[region];
    let centroid = points.iter().sum::<Vec3>() / points.len().max(1) as f64;
    let size = points.iter().map(|p| (p - centroid).norm()).fold(0.0, f64::max);
    let osculating = osculating_cylinder(&current, &points);
    let warm: Vec<Shape> = osculating.into_iter().chain([current]).collect();
    let all = families.each(&Patch { points: &points, normals: &normals }, &warm);
    let own = families.score(current, &points);
    let tip = osculating.map(|s| families.score(s, &points)).filter(|s| s.reduced < FAR);
    tip.into_iter()
        .chain(all.into_iter().filter(|s| s.reduced < NEAR))
        .filter(|s| {
            let boundary =
                if is_apart(&current, &s.shape, &points, families.sigma) { BOUNDARY } else { 0.0 };
            may_gain(&own, s, points.len(), group.len(), boundary)
        })
        .map(|s| s.shape)
        .filter(|s| s.family != current.family)
        .filter(|s| match s.family {
            // A tube far wider than the patch is no fillet and no elbow, but a plane with leaked points.
            // And of one that is a tube's the points go some way around it: a narrow strip of a cylinder
            // does not, which leaked points make look like a barrel.
            Family::Torus => s.size[1] < 2.0 * size && tube_span(s, &points) > AROUND_TUBE,
            family => family.dof() <= current.family.dof() + 2,
        })
        .collect()
}

/// Angle around the tube of a torus that its points span, from the middle of them to the furthest on either side.
fn tube_span(torus: &Shape, points: &[Vec3]) -> f64 {
    let spoke = |p: &Vec3| {
        let q = torus.frame.tr_mul(&(p - torus.origin));
        [q.x.hypot(q.y) - torus.size[0], q.z]
    };
    let [x, y] = points.iter().map(spoke).fold([0.0; 2], |s, q| [s[0] + q[0], s[1] + q[1]]);
    let from_middle = |p: &Vec3| {
        let [u, v] = spoke(p);
        (x * v - y * u).atan2(x * u + y * v).abs()
    };
    2.0 * points.iter().map(from_middle).fold(0.0, f64::max)
}

/// Least angle around a tube, in radians.
const AROUND_TUBE: f64 = 0.5;
/// Reduced chi2 beyond which a fitted shape is no candidate, and one beyond which an unfitted one is not.
const NEAR: f64 = 4.0;
const FAR: f64 = 8.0;
/// What a surface may save at its region's boundary beside what its fit to the interior shows.
const BOUNDARY: f64 = 25.0;

/// Surfaces whose distances from a region's points differ by less than this many sigmas, root mean square, are the
/// same at its boundary too.
const ALIKE: f64 = 0.3;

/// Whether two surfaces differ visibly at some points.
fn is_apart(a: &Shape, b: &Shape, points: &[Vec3], sigma: f64) -> bool {
    let [a, b] = [a, b].map(Ruler::of);
    // Normals may point either way.
    let difference = |p: &Vec3| {
        let [a, b] = [a.distance(p), b.distance(p)];
        (a - b).abs().min((a + b).abs()).powi(2)
    };
    let sum: f64 = points.iter().map(difference).sum();
    sum > (ALIKE * sigma).powi(2) * points.len() as f64
}

/// Whether a candidate may cost less than a region's own surface, both scored on `m` of its `n` points, where it may
/// save so much at its `boundary`.
///
/// A simpler one always may: leaked points, which make it look poor, would leave. A richer one must fit the
/// interior better by about what it costs.
fn may_gain(own: &Scored, candidate: &Scored, m: usize, n: usize, boundary: f64) -> bool {
    let length = |s: &Scored| s.shape.family.description_length(n);
    let (more, share) = (length(candidate) - length(own), n as f64 / m.max(1) as f64);
    more < 0.0 || (own.chi2 - candidate.chi2) * share + boundary > more
}

/// The cylinder that an elliptic one is where its points lie: fillets whose labels leak over their
/// joints look like the tip of an ellipse.
fn osculating_cylinder(s: &Shape, points: &[Vec3]) -> Option<Shape> {
    if s.family != Family::EllipticCylinder || points.is_empty() {
        return None;
    }
    let centroid = points.iter().sum::<Vec3>() / points.len() as f64;
    let o = s.offset(&centroid);
    let q = s.frame.tr_mul(&(centroid - o.normal * o.distance - s.origin));
    let [a, b, _] = s.size;
    let radius = ((a * q.y / b).powi(2) + (b * q.x / a).powi(2)).powf(1.5) / (a * b);
    let axis = centroid - o.normal * (o.distance + radius);
    let shape = Shape::with_axis(Family::Cylinder, axis, s.w(), [radius, 0.0, 0.0]);
    shape.is_proper().then_some(shape)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_points_of_a_fillet_go_around_its_tube_and_those_of_a_strip_hardly() {
        let torus =
            Shape::with_axis(Family::Torus, Vec3::new(1.0, 2.0, 3.0), Vec3::y(), [9.0, 2.0, 0.0]);
        // all around the axis, between two angles around the tube
        let points = |from: f64, to: f64| -> Vec<Vec3> {
            let at = |k: usize| {
                let (turn, angle) = (0.1 * k as f64, from + (to - from) * (k % 50) as f64 / 49.0);
                let (out, up) = (9.0 + 2.0 * angle.cos(), 2.0 * angle.sin());
                torus.origin + torus.frame * Vec3::new(out * turn.cos(), out * turn.sin(), up)
            };
            (0..500).map(at).collect()
        };
        for (from, to) in [(0.0, 1.5), (2.9, 3.2), (-0.1, 0.1), (2.0, 4.0), (-2.5, 2.5)] {
            let span = tube_span(&torus, &points(from, to));
            assert!((span - (to - from)).abs() < 1e-9, "{from} {to}: {span}");
        }
        assert!(tube_span(&torus, &points(0.0, 6.2)) > 3.0);
    }
}

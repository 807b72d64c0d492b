//! Putting another family in the place of a surface's own.
//!
//! Residuals of a region whose labels leak over a smooth joint cannot decide its type; the energy of all
//! points it could win or lose can.

use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::fit::starts::Patch;
use crate::fit::{Family, Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::family::{Families, Scored};
use crate::segment::moves::memo::{Key, Memo, Move};
use crate::segment::moves::trial::{Place, STEPS, Trial};
use crate::segment::objective::{DOUBT, FEW, SLIGHT};
use crate::segment::partition::{Partition, members, neighbours_of, put_in};
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::{take, take_core};

/// Tries other families in each region's place and keeps the one with the least energy. Returns how many
/// regions changed family.
pub fn swap_families(scene: &Scene, model: &mut Partition, families: &Families) -> usize {
    model.note(scene, families.sigma);
    let groups = members(&model.labels, model.shapes.len());
    let around = neighbours_of(&model.changes.borders(), model.shapes.len());
    let frozen: &Partition = model;
    let keys: Vec<Option<Key>> = (0..groups.len())
        .map(|r| Memo::key(&frozen.changes, Move::Swap, r, around[r].iter().copied()))
        .collect();
    let rulers: Vec<Ruler> = frozen.shapes.iter().map(Ruler::of).collect();
    let next: Vec<Option<Shape>> = (0..frozen.shapes.len())
        .into_par_iter()
        .map_init(
            || vec![0u32; scene.len()],
            |slot, r| {
                let current = frozen.shapes[r];
                let vain = frozen.vain.is_vain(keys[r].as_ref());
                if vain || groups[r].len() < FEW.get() || scene.cancelled() {
                    return None;
                }
                let found = candidates(scene, frozen, families, &groups[r], r);
                let candidates = on_more_points(scene, frozen, families, &groups[r], r, found);
                if candidates.is_empty() {
                    return None;
                }
                let own = take(scene, &groups[r], SAMPLE.get());
                let alone = around[r].is_empty();
                let sigma = families.sigma;
                let place = Place::new(scene, frozen, &rulers, r, &groups[r], slot, families);
                let (mut least, mut winner) = Trial::new(&place).run(&current, sigma, true);
                for c in candidates {
                    let (e, s) = Trial::new(&place).run(&c, sigma, !alone);
                    if e < least - 1.0 && !families.degenerate(&s, &own) {
                        least = e;
                        winner = s;
                    }
                }
                place.leave();
                (winner.family != current.family).then_some(winner)
            },
        )
        .collect();
    model.vain.add(keys, &next);
    put_in(&mut model.shapes, next)
}

/// One shape of every other family that comes near explaining the region.
fn candidates(
    scene: &Scene,
    model: &Partition,
    families: &Families,
    group: &[u32],
    region: usize,
) -> Vec<Shape> {
    let (points, normals) = take_core(scene, &model.labels, group, region as i32, SAMPLE.get());
    let current = model.shapes[region];
    let centroid = points.iter().sum::<Vec3>() / points.len().max(1) as f64;
    let size = points.iter().map(|p| (p - centroid).norm()).fold(0.0, f64::max);
    let osculating = osculating_cylinder(&current, &points);
    let warm: Vec<Shape> = osculating.into_iter().chain([current]).collect();
    let all = families.each(&Patch { points: &points, normals: &normals }, &warm);
    let own = families.score(current, &points);
    let tip = osculating.map(|s| families.score(s, &points)).filter(|s| s.reduced < FAR.get());
    tip.into_iter()
        .chain(all.into_iter().filter(|s| s.reduced < NEAR.get()))
        .filter(|s| {
            let boundary = if is_apart(&current, &s.shape, &points, families.sigma) {
                DOUBT.get()
            } else {
                0.0
            };
            may_gain(families, &own, s, points.len(), group.len(), boundary)
        })
        .map(|s| s.shape)
        .filter(|s| s.family != current.family)
        .filter(|s| match s.family {
            // A tube far wider than the patch is no fillet and no elbow, but a plane with leaked points.
            // And of one that is a tube's the points go some way around it: a narrow strip of a cylinder
            // does not, which leaked points make look like a barrel.
            Family::Torus => {
                s.size[1] < WIDE.get() * size && tube_span(s, &points) > AROUND_TUBE.get()
            }
            family => family.dof() <= current.family.dof() + 2,
        })
        .collect()
}

constants! {
    /// Points of a region's core that candidates are fitted to.
    SAMPLE: usize = 600, Effort("points of one fit");
    /// Those of one with more than twice as many that they are fitted to again: chance alone lets a richer family gain
    /// on a few what counts much on all.
    MANY: usize = 4000, Effort("points of one fit");
    /// Least angle around a tube, in radians.
    AROUND_TUBE: f64 = 0.5, Trial(0.5, 0.5);
    /// Reduced chi2 beyond which a fitted shape is no candidate.
    NEAR: f64 = 4.0, Effort("candidates that are not tried");
    /// Reduced chi2 beyond which an unfitted shape is no candidate.
    FAR: f64 = 8.0, Effort("candidates that are not tried");
    /// How many times wider than the points reach the tube of a fillet or an elbow may be.
    WIDE: f64 = 2.0, Trial(2.0, 2.0);
}

/// Those of the candidates for a large region that may still gain when they and its own surface are fitted to more of
/// its points.
fn on_more_points(
    scene: &Scene,
    model: &Partition,
    families: &Families,
    group: &[u32],
    region: usize,
    found: Vec<Shape>,
) -> Vec<Shape> {
    if found.is_empty() || group.len() < 2 * SAMPLE.get() {
        return found;
    }
    let (points, _) = take_core(scene, &model.labels, group, region as i32, MANY.get());
    let refit = |s: &Shape| {
        let shape = families.polish(s, &points, STEPS.get()).map_or(*s, |f| f.shape);
        families.score(shape, &points)
    };
    let own = refit(&model.shapes[region]);
    let gains = |s: &Scored| may_gain(families, &own, s, points.len(), group.len(), DOUBT.get());
    found.iter().map(refit).filter(gains).map(|s| s.shape).collect()
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

/// Whether two surfaces differ visibly at some points.
fn is_apart(a: &Shape, b: &Shape, points: &[Vec3], sigma: f64) -> bool {
    let [a, b] = [a, b].map(Ruler::of);
    // Normals may point either way.
    let difference = |p: &Vec3| {
        let [a, b] = [a.distance(p), b.distance(p)];
        (a - b).abs().min((a + b).abs()).powi(2)
    };
    let sum: f64 = points.iter().map(difference).sum();
    sum > (SLIGHT.get() * sigma).powi(2) * points.len() as f64
}

/// Whether a candidate may cost less than a region's own surface, both scored on `m` of its `n` points, where it may
/// save so much at its `boundary`.
///
/// A simpler one always may: leaked points, which make it look poor, would leave. A richer one must fit the
/// interior better by about what it costs.
fn may_gain(
    families: &Families,
    own: &Scored,
    candidate: &Scored,
    m: usize,
    n: usize,
    boundary: f64,
) -> bool {
    let length = |s: &Scored| s.shape.family.description_length(families.worth(n));
    let (more, share) =
        (length(candidate) - length(own), n as f64 / m.max(1) as f64 / families.repeats());
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

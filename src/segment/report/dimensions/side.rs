//! On which side of a face the material is: hole or boss.
//!
//! Regions that touch are one skin: at an edge both outer normals lean away from the other face or both towards it, and
//! over a smooth joint they are the same. So all regions that hang together have one sign in common, and that is told by
//! the skin's outermost points, whose outer normals point away from the body. It takes the cloud for that of a body seen
//! from outside: nothing but the scanner's place would tell a room from a block. Where the file has normals, which point
//! out of the material, they tell it of each region by itself.

use std::collections::BTreeMap;

use crate::fit::constant::constants;
use crate::geometry::Vec3;
use crate::segment::Continuity;
use crate::segment::dimensions::Side;
use crate::segment::prepare::scene::Scene;
use crate::segment::report::known::{Joint, Known};

constants! {
    /// Directions in which outermost points are looked for.
    DIRECTIONS: usize = 96, Effort("directions looked in");
    /// Least cosine of the angle between a direction and the outermost point's normal: at an edge of a box the better of two
    /// faces has 0.7, at a corner of three 0.57; where the skin ends both are near nought.
    LEAST_COSINE: f64 = 0.4, Derived("below the 0.57 of a corner of three faces");
    /// Share of the directions in which a skin must have such points: one that lacks its bottom has two thirds.
    CLOSED: f64 = 0.6, Derived("below the two thirds that a skin without its bottom has");
    /// Share of these that must agree.
    AGREED: f64 = 0.9, Trial(0.9, 0.9);
    /// Heights over a tangent plane that tell a side, in standard deviations of the noise.
    SURE: f64 = 2.0, Trial(2.0, 2.0);
    /// Least cosine of the angle between a file's normal and the surface's for it to be one: that of 60 degrees.
    LIKE: f64 = 0.5, Trial(0.5, 0.5);
    /// Share of a region's points whose normals must be such, and of these that must be on one side.
    CONSISTENT: f64 = 0.8, Trial(0.8, 0.8);
}

/// The side of each region by the `normals` of the scene's points, as the file has them: those `without` where a region's
/// do not agree with its surface or with each other, and everywhere where most regions' do not: then nobody has made them
/// point out of the material.
pub fn by_normals(
    scene: &Scene,
    labels: &[i32],
    surfaces: &[Known],
    normals: impl Fn(usize) -> Vec3,
    without: &[Side],
) -> Vec<Side> {
    let mut sums = vec![[0usize; 3]; surfaces.len()];
    for (i, p) in scene.points.iter().enumerate() {
        let Some(l) = usize::try_from(labels[i]).ok().filter(|l| *l < surfaces.len()) else {
            continue;
        };
        let normal = normals(i);
        let cosine = surfaces[l].shape.offset(p).normal.dot(&normal) / normal.norm();
        // one that is zero, or no number, tells nothing
        let place = if cosine >= LIKE.get() {
            0
        } else if cosine <= -LIKE.get() {
            1
        } else {
            2
        };
        sums[l][place] += 1;
    }
    let side = |[boss, hole, none]: &[usize; 3]| {
        let (told, all) = (boss + hole, boss + hole + none);
        let sure = told as f64 >= CONSISTENT.get() * all as f64
            && *boss.max(hole) as f64 >= CONSISTENT.get() * told as f64;
        match sure && told > 0 {
            true if boss > hole => Side::Boss,
            true => Side::Hole,
            false => Side::Unknown,
        }
    };
    let told: Vec<Side> = sums.iter().map(side).collect();
    let points = |s: &[usize; 3]| s.iter().sum::<usize>();
    let agreed = sums.iter().zip(&told).filter(|(_, side)| **side != Side::Unknown);
    let agreed: usize = agreed.map(|(s, _)| points(s)).sum();
    let all: usize = sums.iter().map(points).sum();
    if (agreed as f64) < CONSISTENT.get() * all as f64 {
        return without.to_vec();
    }
    // what the file does not tell the whole's shape may
    let or = |(own, other): (Side, &Side)| if own == Side::Unknown { *other } else { own };
    told.into_iter().zip(without).map(or).collect()
}

/// The side of each region; `labels` of the scene's points.
pub fn sides(
    scene: &Scene,
    labels: &[i32],
    surfaces: &[Known],
    joints: &[Joint],
    sigma: f64,
) -> Vec<Side> {
    let skins = Skins::of(surfaces.len(), &votes(scene, labels, surfaces, joints, sigma));
    let outer = skins.outermost(scene, labels);
    let mut out = vec![Side::Unknown; surfaces.len()];
    for (id, side) in out.iter_mut().enumerate() {
        let skin = skins.of[id];
        if skins.size(skin) < 2 || skins.is_within_another(skin, &outer) {
            continue;
        }
        let Some(places) = outer.get(&skin) else { continue };
        let sign = outward(&places.extremes, |i| {
            let label = labels[i] as usize;
            surfaces[label].shape.offset(&scene.points[i]).normal * skins.sign[label]
        });
        *side = match sign.map(|sign| sign * skins.sign[id]) {
            Some(s) if s > 0.0 => Side::Boss,
            Some(_) => Side::Hole,
            None => Side::Unknown,
        };
    }
    out
}

/// For each joint the regions, and whether their shapes' normals are on the same side of the skin (> 0) or on different
/// ones (< 0), by the number of pairs of points that say so.
fn votes(
    scene: &Scene,
    labels: &[i32],
    surfaces: &[Known],
    joints: &[Joint],
    sigma: f64,
) -> Vec<([usize; 2], i64)> {
    let mut sums: BTreeMap<[usize; 2], (Continuity, i64)> =
        joints.iter().map(|j| (j.regions, (j.continuity, 0))).collect();
    for (i, &a) in labels.iter().enumerate() {
        for &j in scene.neighbours(i) {
            let b = labels[j as usize];
            if a < 0 || b <= a {
                continue;
            }
            let Some((continuity, sum)) = sums.get_mut(&[a as usize, b as usize]) else { continue };
            let (p, q) = (scene.points[i], scene.points[j as usize]);
            let n = surfaces[a as usize].shape.offset(&p).normal;
            let m = surfaces[b as usize].shape.offset(&q).normal;
            let (over, under) = (n.dot(&(q - p)), m.dot(&(p - q)));
            *sum += match continuity {
                Continuity::G1 => n.dot(&m).signum() as i64,
                Continuity::G0 if over.abs().min(under.abs()) > SURE.get() * sigma => {
                    (over * under).signum() as i64
                }
                Continuity::G0 => 0,
            };
        }
    }
    let mut out: Vec<_> = sums.into_iter().map(|(regions, (_, sum))| (regions, sum)).collect();
    out.retain(|(_, sum)| *sum != 0);
    // The surest first; the sort keeps the order of equal ones.
    out.sort_by_key(|(_, sum)| std::cmp::Reverse(sum.abs()));
    out
}

/// Regions that hang together.
struct Skins {
    /// The skin of each region.
    of: Vec<usize>,
    /// Whether a region's shape has its normal on the skin's first side (1) or second (-1).
    sign: Vec<f64>,
}

/// A skin's box and its outermost point in each direction.
struct Outer {
    low: Vec3,
    high: Vec3,
    extremes: Vec<(Vec3, f64, usize)>,
}

impl Skins {
    fn of(regions: usize, votes: &[([usize; 2], i64)]) -> Self {
        let mut skins = Self { of: (0..regions).collect(), sign: vec![1.0; regions] };
        for &([a, b], sum) in votes {
            let (kept, gone) = (skins.of[a], skins.of[b]);
            if kept == gone {
                continue;
            }
            let turn = skins.sign[a] * skins.sign[b] * if sum > 0 { 1.0 } else { -1.0 };
            for (of, sign) in skins.of.iter_mut().zip(&mut skins.sign) {
                if *of == gone {
                    (*of, *sign) = (kept, *sign * turn);
                }
            }
        }
        skins
    }

    fn size(&self, skin: usize) -> usize {
        self.of.iter().filter(|s| **s == skin).count()
    }

    fn outermost(&self, scene: &Scene, labels: &[i32]) -> BTreeMap<usize, Outer> {
        let directions = directions();
        let mut out: BTreeMap<usize, Outer> = BTreeMap::new();
        for (i, (p, &l)) in scene.points.iter().zip(labels).enumerate() {
            let Some(&skin) = usize::try_from(l).ok().and_then(|l| self.of.get(l)) else {
                continue;
            };
            let outer = out.entry(skin).or_insert_with(|| Outer {
                low: *p,
                high: *p,
                extremes: directions.iter().map(|d| (*d, f64::NEG_INFINITY, i)).collect(),
            });
            (outer.low, outer.high) = (outer.low.inf(p), outer.high.sup(p));
            for (d, most, at) in &mut outer.extremes {
                let far = p.dot(d);
                if far > *most {
                    (*most, *at) = (far, i);
                }
            }
        }
        out
    }

    /// Whether another skin's box holds that of this one: it may be the wall of a cavity.
    fn is_within_another(&self, skin: usize, outer: &BTreeMap<usize, Outer>) -> bool {
        let Some(own) = outer.get(&skin) else { return true };
        outer.iter().any(|(other, o)| *other != skin && own.low >= o.low && own.high <= o.high)
    }
}

/// 1 where the skin's normals point outward, -1 where inward; none where its outermost points do not say.
fn outward(extremes: &[(Vec3, f64, usize)], normal: impl Fn(usize) -> Vec3) -> Option<f64> {
    let cosines = extremes.iter().map(|(d, _, i)| normal(*i).dot(d));
    let told: Vec<f64> = cosines.filter(|c| c.abs() > LEAST_COSINE.get()).collect();
    let out = told.iter().filter(|c| **c > 0.0).count();
    let most = out.max(told.len() - out);
    let sure = told.len() as f64 >= CLOSED.get() * extremes.len() as f64
        && most as f64 >= AGREED.get() * told.len() as f64;
    sure.then(|| if most == out { 1.0 } else { -1.0 })
}

/// Directions all over the sphere, along a spiral that turns by the golden angle.
fn directions() -> Vec<Vec3> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let at = |k: usize| {
        let z = 1.0 - (2 * k + 1) as f64 / DIRECTIONS.get() as f64;
        let (sin, cos) = (golden * k as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * cos, r * sin, z)
    };
    (0..DIRECTIONS.get()).map(at).collect()
}

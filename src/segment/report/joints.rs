//! Where regions touch, how their surfaces meet there, and how exactly the boundary can be placed.

use crate::fit::constant::constants;
use crate::segment::objective::SURE;
use crate::segment::report::known::Joint;
use std::collections::BTreeMap;

use nalgebra::{DMatrix, Matrix2x3, Vector2};

use crate::fit::Shape;
use crate::geometry::{Vec3, perpendicular_frame};
use crate::segment::Continuity;
use crate::segment::prepare::scene::Scene;
use crate::segment::report::known::Known;

constants! {
    /// Border places of one joint that are looked at; of more, every n-th.
    SAMPLE: usize = 200, Effort("places looked at");
    /// A joint has at least this many neighbouring pairs of points across it.
    LEAST_PAIRS: usize = 4, Trial(4.0, 4.0);
}

/// What a joint is judged by.
pub struct Scale {
    /// Noise of the points.
    pub sigma: f64,
    /// Points of the cloud for each point of the scene.
    pub density: f64,
}

/// The joints of a scene whose points carry `labels`, by region.
///
/// Two regions touch where their points are neighbours and their surfaces run through one place nearby;
/// the two sides of a thin wall do not.
pub fn joints(scene: &Scene, labels: &[i32], surfaces: &[Known], scale: &Scale) -> Vec<Joint> {
    borders(scene, labels, surfaces.len())
        .into_iter()
        .filter_map(|(regions, pairs)| {
            if scene.cancelled() {
                return None;
            }
            let [a, b] = regions.map(|r| &surfaces[r]);
            let border = Border { scene, pairs: &pairs, scale };
            let (continuity, resolution) = border.judge(a, b)?;
            Some(Joint { regions, continuity, resolution })
        })
        .collect()
}

/// Neighbouring points with different labels, the smaller label first, of the first so many `regions`: labels beyond
/// them are of quadrics whose joints are not told.
fn borders(scene: &Scene, labels: &[i32], regions: usize) -> BTreeMap<[usize; 2], Vec<[u32; 2]>> {
    let known = |l: i32| usize::try_from(l).is_ok_and(|l| l < regions);
    let mut out: BTreeMap<[usize; 2], Vec<[u32; 2]>> = BTreeMap::new();
    for (i, &l) in labels.iter().enumerate() {
        for &j in scene.neighbours(i) {
            let m = labels[j as usize];
            if known(l) && known(m) && l != m {
                let (pair, points) =
                    if l < m { ([l, m], [i as u32, j]) } else { ([m, l], [j, i as u32]) };
                out.entry(pair.map(|l| l as usize)).or_default().push(points);
            }
        }
    }
    out
}

/// The pairs of points across one border.
struct Border<'a> {
    scene: &'a Scene<'a>,
    pairs: &'a [[u32; 2]],
    scale: &'a Scale,
}

impl Border<'_> {
    /// Class and resolution of the joint; `None` where the surfaces do not meet at the border.
    fn judge(&self, a: &Known, b: &Known) -> Option<(Continuity, f64)> {
        let stride = self.pairs.len().div_ceil(SAMPLE.get()).max(1);
        let looked_at = self.pairs.len().div_ceil(stride);
        let meetings: Vec<Meeting> = self
            .pairs
            .iter()
            .step_by(stride)
            .filter_map(|&pair| self.meeting(&a.shape, &b.shape, pair))
            .collect();
        if self.pairs.len() < LEAST_PAIRS.get() || meetings.len() * 3 < looked_at {
            return None;
        }
        let angle = median(meetings.iter().map(|m| m.angle));
        let bend = median(meetings.iter().map(|m| m.bend));
        let smooth = self.smooth_resolution(bend, meetings.len() as f64 / looked_at as f64);
        let middle = meetings[meetings.len() / 2].place;
        let tilt = tilt(a, &middle).hypot(tilt(b, &middle));
        // Next to a smooth joint the normals part by bend times the distance from it.
        if angle <= (SURE.get() * tilt).hypot(bend * smooth) {
            Some((Continuity::G1, smooth))
        } else {
            let edge = SURE.get() * self.scale.sigma / angle.sin();
            Some((Continuity::G0, edge.hypot(self.spacing()).min(smooth.max(self.spacing()))))
        }
    }

    /// Spacing of the cloud's points.
    fn spacing(&self) -> f64 {
        self.scene.spacing / self.scale.density.sqrt()
    }

    /// t = (6 z sigma / (bend sqrt(density length)))^(2/5): past a smooth joint over which the normal
    /// curvature jumps by `bend`, points leave the other surface by bend t2 / 2, and the mean over a band of
    /// that width stands out of the noise by z. Never less than the spacing, nor more than the border is
    /// long.
    fn smooth_resolution(&self, bend: f64, share: f64) -> f64 {
        let spacing = self.spacing();
        // Sixteen neighbours reach two spacings, so a border holds about 1.5 points a spacing on each side.
        let mut places: Vec<u32> = self.pairs.iter().flatten().copied().collect();
        places.sort_unstable();
        places.dedup();
        let length = share * places.len() as f64 * self.scene.spacing / 3.0;
        // The fourth neighbour stands at the radius of a disc with four points.
        let density = 4.0 / (std::f64::consts::PI * spacing * spacing);
        let t =
            6.0 * SURE.get() * self.scale.sigma / (bend * (density * length).sqrt()).max(1e-300);
        t.powf(0.4).min(length.max(spacing)).max(spacing)
    }

    /// How the surfaces meet near a pair of points; `None` where they pass each other.
    fn meeting(&self, a: &Shape, b: &Shape, pair: [u32; 2]) -> Option<Meeting> {
        let [p, q] = pair.map(|i| self.scene.points[i as usize]);
        let reach = (p - q).norm() + self.scene.spacing;
        let middle = (p + q) / 2.0;
        let limit = SURE.get() * self.scale.sigma;
        let tangent = a.distance(&q).abs() < limit && b.distance(&p).abs() < limit;
        let crossing = crossing(a, b, &middle, reach).filter(|x| (x - middle).norm() <= reach);
        let place = crossing.or(tangent.then_some(middle))?;
        let (n, mut m) = (a.offset(&place).normal, b.offset(&place).normal);
        let side = if n.dot(&m) < 0.0 { -1.0 } else { 1.0 };
        m *= side;
        let angle = n.cross(&m).norm().atan2(n.dot(&m));
        Some(Meeting { place, angle, bend: bend(a, b, &place, side, reach) })
    }
}

/// Two surfaces at one place of their joint.
struct Meeting {
    place: Vec3,
    /// Angle between the tangent planes, 0..=pi/2.
    angle: f64,
    /// Largest difference of their normal curvatures.
    bend: f64,
}

/// The place nearest to `from` on both surfaces, to a thousandth of `reach`: Newton's steps of least
/// length on both distances.
fn crossing(a: &Shape, b: &Shape, from: &Vec3, reach: f64) -> Option<Vec3> {
    let mut x = *from;
    for _ in 0..6 {
        let (p, q) = (a.offset(&x), b.offset(&x));
        let normals = Matrix2x3::from_rows(&[p.normal.transpose(), q.normal.transpose()]);
        let square = (normals * normals.transpose()).try_inverse()?;
        x -= normals.transpose() * (square * Vector2::new(p.distance, q.distance));
    }
    let rest = a.distance(&x).abs().max(b.distance(&x).abs());
    (rest < 1e-3 * reach).then_some(x)
}

/// Largest difference of the normal curvatures of two surfaces at `x`, over steps of length `h`; `side`
/// is -1 where their normals point to opposite sides.
fn bend(a: &Shape, b: &Shape, x: &Vec3, side: f64, h: f64) -> f64 {
    let n = a.offset(x).normal;
    let (u, v) = perpendicular_frame(&n);
    let step = 0.1 * h;
    let slope = |s: &Shape, d: &Vec3| {
        (s.offset(&(x + d * step)).normal - s.offset(&(x - d * step)).normal) / (2.0 * step)
    };
    let part = |d: &Vec3| slope(a, d) - slope(b, d) * side;
    let (du, dv) = (part(&u), part(&v));
    let (uu, vv, uv) = (du.dot(&u), dv.dot(&v), (du.dot(&v) + dv.dot(&u)) / 2.0);
    (uu + vv).abs() / 2.0 + ((uu - vv) / 2.0).hypot(uv)
}

/// Standard deviation of the direction of a surface's normal at `x`, from that of its parameters.
fn tilt(surface: &Known, x: &Vec3) -> f64 {
    let Some(uncertainty) = &surface.uncertainty else { return 0.0 };
    let (covariance, shape) = (&uncertainty.of_freedoms, &surface.shape);
    let dof = shape.family.dof();
    let mut slopes = DMatrix::zeros(3, dof);
    for k in 0..dof {
        let step = 1e-3 * covariance[(k, k)].sqrt();
        let normal = |h: f64| {
            let mut delta = vec![0.0; dof];
            delta[k] = h;
            shape.stepped(&delta).map(|s| s.offset(x).normal)
        };
        if let (Some(after), Some(before)) = (normal(step), normal(-step)) {
            slopes.set_column(k, &((after - before) / (2.0 * step).max(1e-300)));
        }
    }
    let spread: DMatrix<f64> = &slopes * covariance * slopes.transpose();
    spread.trace().max(0.0).sqrt()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let mid = values.len() / 2;
    *values.select_nth_unstable_by(mid, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::segment::fixtures::plane;

    fn cylinder(axis_point: Vec3, radius: f64) -> Shape {
        Shape::with_axis(Family::Cylinder, axis_point, Vec3::y(), [radius, 0.0, 0.0])
    }

    #[test]
    fn the_crossing_is_the_nearest_place_on_both_surfaces() {
        let (floor, wall) = (plane(Vec3::zeros(), Vec3::z()), plane(2.0 * Vec3::x(), Vec3::x()));
        let from = Vec3::new(1.5, 7.0, 0.4);
        let found = crossing(&floor, &wall, &from, 1.0).unwrap();
        assert!((found - Vec3::new(2.0, 7.0, 0.0)).norm() < 1e-12, "{found}");
        let found = crossing(&floor, &cylinder(Vec3::zeros(), 5.0), &Vec3::new(4.5, 1.0, 0.3), 1.0);
        assert!((found.unwrap() - Vec3::new(5.0, 1.0, 0.0)).norm() < 1e-3);
        let above = plane(Vec3::z(), Vec3::z());
        assert_eq!(crossing(&floor, &above, &from, 1.0), None);
    }

    #[test]
    fn the_bend_is_the_largest_difference_of_normal_curvatures() {
        let place = Vec3::zeros();
        let floor = plane(place, Vec3::z());
        let above = |radius: f64| cylinder(Vec3::new(0.0, 0.0, radius), radius);
        let below = |radius: f64| cylinder(Vec3::new(0.0, 0.0, -radius), radius);
        // A side is 1 where both normals point to the same.
        for (a, b, expected) in [
            (floor, above(4.0), 1.0 / 4.0),
            (above(4.0), above(5.0), 1.0 / 4.0 - 1.0 / 5.0),
            (above(4.0), below(5.0), 1.0 / 4.0 + 1.0 / 5.0),
        ] {
            let (n, m) = (a.offset(&place).normal, b.offset(&place).normal);
            let found = bend(&a, &b, &place, n.dot(&m).signum(), 0.1);
            assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
        }
    }

    #[test]
    fn borders_are_the_pairs_of_neighbours_with_two_labels_the_smaller_first() {
        let (scene, _, mut labels) = crate::segment::fixtures::roof(2000, 1.0);
        labels.iter_mut().step_by(90).for_each(|l| *l = -1);
        labels.iter_mut().step_by(70).for_each(|l| *l = 2);
        let found = borders(&scene, &labels, 2);
        let mut expected = Vec::new();
        for i in 0..scene.len() {
            for &j in scene.neighbours(i) {
                match (labels[i], labels[j as usize]) {
                    (0, 1) => expected.push([i as u32, j]),
                    (1, 0) => expected.push([j, i as u32]),
                    _ => {}
                }
            }
        }
        assert_eq!(found, BTreeMap::from([([0, 1], expected)]));
    }
}

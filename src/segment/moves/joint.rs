//! Surfaces that stand for two that join smoothly.
//!
//! Two arcs that bend the same way, one a little more than the other, lie within noise of one ellipse: no point
//! shows it, and growth passes the joint. What gives it away is that residuals go together, by less than at a
//! [step](super::step); and that two surfaces, each for the points on its side of some cut, cost less.

use crate::fit::constant::constants;
use crate::fit::least_squares::{Options, fit};
use crate::fit::starts::Patch;
use crate::fit::{Family, Ruler, Shape};
use crate::geometry::{Mat3, Vec3};
use crate::segment::family::{Families, Scored};
use crate::segment::judge::whiteness::correlation;
use crate::segment::moves::pieces::Piece;
use crate::segment::moves::site::Site;
use crate::segment::objective::{
    ACCEPT, CHANCE, CORRELATED, DOUBT, GOOD, ONE_OF_TWO, PART, surface_cost, unassigned,
};
use crate::segment::prepare::scene::Scene;
use crate::segment::prepare::take::take_with_normals;

constants! {
    /// Points of a region that cuts are looked for on.
    SAMPLE: usize = 2000, Effort("points of one fit");
    /// Points of a side that its family is judged on.
    SIDE: usize = 600, Effort("points of one fit");
    /// Rounds of fitting the sides and cutting anew.
    ROUNDS: usize = 6, Effort("rounds of one cut");
    /// Steps of a fit to a side.
    STEPS: usize = 12, Effort("steps of one fit");
    /// Steps of the first fit to a half.
    FEW_STEPS: usize = 8, Effort("steps of one fit");
}

/// Two surfaces instead of one that they explain for less, one on either side of a plane cut.
pub fn sides(site: &Site<'_>) -> Option<Vec<Piece>> {
    let Site { scene, model, families, region, group, .. } = *site;
    let shape = site.shape();
    let inside = |j: u32| model.labels[j as usize] == region as i32;
    let chance = CHANCE.get() / (group.len().max(1) as f64).sqrt();
    let suspect = group.len() >= 2 * ONE_OF_TWO.get()
        && shape.family.dof() > Family::Cylinder.dof()
        && correlation(scene, shape, group, families.sigma, inside)
            > families.common + CORRELATED.get() + chance;
    if !suspect {
        return None;
    }
    let Split { cut, shapes: [own, other] } = split(scene, shape, group, families)?;
    let (beyond, below) = group.iter().partition(|&&i| cut.is_beyond(&scene.points[i as usize]));
    Some(vec![(own, below), (other, beyond)])
}

/// A plane cut: points whose height along `axis` is more than `at` lie beyond.
#[derive(Clone, Copy)]
struct Cut {
    axis: Vec3,
    at: f64,
}

impl Cut {
    fn is_beyond(&self, p: &Vec3) -> bool {
        self.axis.dot(p) > self.at
    }
}

/// Two surfaces, the second for what lies beyond the cut.
struct Split {
    cut: Cut,
    shapes: [Shape; 2],
}

/// The cheapest split of a region across one of its principal axes, where it is worth it.
fn split(scene: &Scene, shape: &Shape, group: &[u32], families: &Families) -> Option<Split> {
    let (points, normals) = take_with_normals(scene, group, SAMPLE.get());
    let own = families.score(*shape, &points);
    let axes = principal_axes(&points);
    let splits = axes.into_iter().filter_map(|axis| {
        if scene.cancelled() {
            return None;
        }
        let order = Along::new(&points, &normals, axis);
        order.split(shape, families)
    });
    let (split, bic) = splits.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (bic + surface_cost() < own.bic).then_some(split)
}

fn principal_axes(points: &[Vec3]) -> [Vec3; 3] {
    let mean = points.iter().sum::<Vec3>() / points.len() as f64;
    let square = |p: &Vec3| (p - mean) * (p - mean).transpose();
    let axes = points.iter().map(square).sum::<Mat3>().symmetric_eigen().eigenvectors;
    [0, 1, 2].map(|k| axes.column(k).into_owned())
}

/// Points in their order along an axis.
struct Along {
    axis: Vec3,
    points: Vec<Vec3>,
    normals: Vec<Vec3>,
}

impl Along {
    fn new(points: &[Vec3], normals: &[Vec3], axis: Vec3) -> Self {
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by(|&a, &b| axis.dot(&points[a]).total_cmp(&axis.dot(&points[b])));
        Self {
            axis,
            points: order.iter().map(|&k| points[k]).collect(),
            normals: order.iter().map(|&k| normals[k]).collect(),
        }
    }

    /// Two surfaces, first of each half, then of what lies on either side of where they suit the points best; with
    /// their cost in BIC.
    fn split(&self, shape: &Shape, families: &Families) -> Option<(Split, f64)> {
        let n = self.points.len();
        let mut at = n / 2;
        let chi2 = |points: &[Vec3]| Some(Self::own(points, shape, families)?.chi2);
        let (below, beyond) = self.points.split_at(at);
        if chi2(below)? + chi2(beyond)? + DOUBT.get() > families.score(*shape, &self.points).chi2 {
            return None;
        }
        let mut shapes = [self.best(0..at, shape, families)?, self.best(at..n, shape, families)?];
        let least = ONE_OF_TWO.get().min((PART.get() * n as f64) as usize);
        for round in 0..ROUNDS.get() {
            let next = self.cut(&shapes, families.sigma);
            if next < least || next + least > n {
                return None;
            }
            if next == at && round > 0 {
                break;
            }
            at = next;
            let options = Options {
                cauchy: Some(ACCEPT.get() * families.sigma),
                steps: STEPS.get(),
                tolerance: 1e-5,
            };
            let refit = |s: &Shape, side: &[Vec3]| Some(fit(s, side, None, &options)?.shape);
            shapes =
                [refit(&shapes[0], &self.points[..at])?, refit(&shapes[1], &self.points[at..])?];
        }
        // The halves were not of one surface each: of what family they are shows now.
        shapes = [self.best(0..at, &shapes[0], families)?, self.best(at..n, &shapes[1], families)?];
        at = self.cut(&shapes, families.sigma).clamp(1, n - 1);
        let (below, beyond) = self.points.split_at(at);
        let sides = [families.score(shapes[0], below), families.score(shapes[1], beyond)];
        if sides.iter().any(|s| s.reduced > GOOD.get()) {
            return None;
        }
        let bic = sides[0].bic + sides[1].bic;
        let between = 0.5 * (self.axis.dot(&below[at - 1]) + self.axis.dot(&beyond[0]));
        Some((Split { cut: Cut { axis: self.axis, at: between }, shapes }, bic))
    }

    /// A surface of the same family fitted to some of the points.
    fn own(points: &[Vec3], shape: &Shape, families: &Families) -> Option<Scored> {
        families.polish(shape, points, FEW_STEPS.get()).map(|f| families.score(f.shape, points))
    }

    /// The surface that explains some of the points best.
    fn best(
        &self,
        range: std::ops::Range<usize>,
        shape: &Shape,
        families: &Families,
    ) -> Option<Shape> {
        let (points, normals) = (&self.points[range.clone()], &self.normals[range]);
        let step = points.len().div_ceil(SIDE.get()).max(1);
        let thin = |all: &[Vec3]| -> Vec<Vec3> { all.iter().step_by(step).copied().collect() };
        let (few, normals) = (thin(points), thin(normals));
        let all = families.each(&Patch { points: &few, normals: &normals }, &[*shape]);
        let refit = |s: Shape| {
            families.polish(&s, points, STEPS.get()).map(|f| families.score(f.shape, points))
        };
        let best = all.into_iter().filter_map(|s| refit(s.shape));
        Some(best.min_by(|a, b| a.bic.total_cmp(&b.bic))?.shape)
    }

    /// How many points lie below the cut that suits two surfaces best.
    fn cut(&self, shapes: &[Shape; 2], sigma: f64) -> usize {
        let [a, b] = [0, 1].map(|k| Ruler::of(&shapes[k]));
        let sq = |r: &Ruler, p: &Vec3| (r.distance(p) / sigma).powi(2).min(unassigned());
        let (mut sum, mut least, mut at) = (0.0, f64::INFINITY, 0);
        for (k, p) in self.points.iter().enumerate() {
            sum += sq(&a, p) - sq(&b, p);
            if sum < least {
                (least, at) = (sum, k + 1);
            }
        }
        at
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;
    use crate::segment::fixtures;
    use crate::segment::moves::split;
    use crate::segment::partition::Partition;
    use crate::segment::prepare::morton::morton_order;

    const SIGMA: f64 = 0.01;

    /// Arcs of radii 10 and `radius` that join smoothly and bend the same way, taken for one elliptic cylinder.
    fn arcs(radius: f64) -> (Scene<'static>, Partition, Families) {
        let mut random = Random::new(4);
        let points: Vec<Vec3> = (0..12_000)
            .map(|_| {
                let turn = random.uniform(-1.0, 1.0);
                let r = if turn < 0.0 { 10.0 } else { radius };
                let at = r + SIGMA * random.normal();
                Vec3::new(at * turn.sin(), at * turn.cos() - r, random.uniform(0.0, 30.0))
            })
            .collect();
        let order = morton_order(&points, &crate::segment::Silent).unwrap_or_default();
        let points: Vec<Vec3> = order.iter().map(|&i| points[i as usize]).collect();
        let families =
            Families { sigma: SIGMA, floor: SIGMA, max_radius: 1e3, ..fixtures::families() };
        let origin = Vec3::new(0.0, -10.0, 0.0);
        let start =
            Shape::with_axis(Family::EllipticCylinder, origin, Vec3::z(), [10.0, 10.4, 0.0]);
        let options = Options { cauchy: None, steps: 50, tolerance: 1e-9 };
        let shape = fit(&start, &points, None, &options).map_or(start, |f| f.shape);
        let labels = vec![0; points.len()];
        (
            Scene::new(points),
            Partition { shapes: vec![shape], labels, ..Partition::default() },
            families,
        )
    }

    #[test]
    fn arcs_that_bend_the_same_way_are_told_apart() {
        let (scene, mut model, families) = arcs(11.5);
        assert_eq!(split::split(&scene, &mut model, &families), 1);
        let mut radii: Vec<f64> = model.shapes.iter().map(|s| s.size[0]).collect();
        radii.sort_by(f64::total_cmp);
        assert!((radii[0] - 10.0).abs() < 0.03 && (radii[1] - 11.5).abs() < 0.03, "{radii:?}");
        let wrong = scene.points.iter().zip(&model.labels).filter(|(p, l)| {
            let own = if p.x < 0.0 { 10.0 } else { 11.5 };
            (model.shapes[**l as usize].size[0] - own).abs() > 0.5
        });
        // Three in a hundred, all beside the joint.
        assert!(wrong.count() < 450);
    }

    #[test]
    fn one_arc_stays_one() {
        let (scene, mut model, families) = arcs(10.0);
        assert_eq!(split::split(&scene, &mut model, &families), 0);
    }
}

//! Whether points spread along a surface: those on a line or a curve, or in a heap as thick as wide, lie near
//! many surfaces and tell of none.

use nalgebra::SymmetricEigen;
use rayon::prelude::*;

use crate::fit::constant::constants;
use crate::fit::{Ruler, Shape};
use crate::geometry::{Mat3, Vec3, perpendicular_frame};
use crate::segment::grow::walk::Walk;
use crate::segment::judge::across::{breadth, main_direction};
use crate::segment::judge::parabola;
use crate::segment::objective::{SURE, surface_cost};
use crate::segment::partition::{Partition, members};
use crate::segment::prepare::scene::Scene;
use crate::segment::union::Union;

constants! {
    /// Points of a region around which its breadth is measured.
    CENTRES: usize = 64, Effort("places looked at");
    /// Sigmas that the measured surroundings reach at least: nearer by, noise is as broad as long.
    REACH: f64 = 10.0, Trial(10.0, 10.0);
    /// Points measured around each.
    AROUND: usize = 4000, Effort("points of one look");
    /// Points that tell breadth from a curve's bend.
    LEAST: usize = 6, Trial(6.0, 6.0);
    /// Share of its length that a curve, where its points are few, may differ by from a parabola.
    BENT: f64 = 1e-3, Trial(1e-3, 1e-3);
    /// One in so many places that are broad are enough.
    BROAD_PLACES: usize = 8, Trial(8.0, 8.0);
}

/// Points looked at between two looks at whether the work was cancelled.
const WATCHED: usize = 1024;

/// Marks the regions of a model that are no surfaces as spurious.
pub fn mark(scene: &Scene, model: &mut Partition, sigma: f64) {
    let groups = members(&model.labels, model.shapes.len());
    let labels = &model.labels;
    let none: Vec<bool> = model
        .shapes
        .par_iter()
        .zip(&groups)
        .map_init(
            || Walk::new(scene.len()),
            |walk, (shape, group)| {
                if scene.cancelled() {
                    return true;
                }
                let sigma = sigma.max(scatter(scene, shape, group));
                !Region { scene, labels, shape, group, sigma }.is_surface(walk)
            },
        )
        .collect();
    let open = parabola::open(scene, model, &groups, sigma);
    if none.contains(&true) || open.contains(&true) {
        model.spurious.resize(none.len(), false);
        let why = none.into_iter().zip(open);
        model.spurious.iter_mut().zip(why).for_each(|(s, (none, open))| *s |= none || open);
    }
}

/// Root mean square distance of a region's points from its surface: the noise may be more than reckoned with.
fn scatter(scene: &Scene, shape: &Shape, group: &[u32]) -> f64 {
    let ruler = Ruler::of(shape);
    let squares = group.iter().map(|&i| ruler.distance(&scene.points[i as usize]).powi(2));
    (squares.sum::<f64>() / group.len().max(1) as f64).sqrt()
}

/// The points of one region and the surface they are said to lie on.
struct Region<'a> {
    scene: &'a Scene<'a>,
    labels: &'a [i32],
    shape: &'a Shape,
    group: &'a [u32],
    sigma: f64,
}

/// What a region looks like around one of its points.
struct Place {
    centre: u32,
    /// Standard deviation across the main direction, along the surface.
    breadth: f64,
    broad: bool,
    /// The main direction, and that across.
    along: Vec3,
    across: Vec3,
}

impl Region<'_> {
    /// Whether the points are broader along the surface than across it, by so much that the surface is the
    /// shorter description of them; or else on several curves side by side, as a scanner's lines are.
    fn is_surface(&self, walk: &mut Walk) -> bool {
        let n = self.group.len();
        let count = n.min(CENTRES.get());
        let places: Vec<Place> =
            (0..count).filter_map(|k| self.place(walk, self.group[k * n / count])).collect();
        let broad = places.iter().filter(|p| p.broad).count();
        if places.is_empty() {
            return false;
        }
        if broad * BROAD_PLACES.get() < places.len() {
            return self.are_side_by_side(&places);
        }
        let mut breadths: Vec<f64> = places.iter().map(|p| p.breadth).collect();
        let mid = breadths.len() / 2;
        let breadth = *breadths.select_nth_unstable_by(mid, f64::total_cmp).1;
        let freedom = n.saturating_sub(self.shape.family.dof()) as f64;
        freedom * (breadth / self.sigma).max(SURE.get()).ln() > surface_cost()
    }

    fn place(&self, walk: &mut Walk, centre: u32) -> Option<Place> {
        let Self { scene, labels, sigma, .. } = *self;
        let c = centre as usize;
        let at = scene.points[c];
        let sq = |j: usize| (scene.points[j] - at).norm_squared();
        let own = scene.neighbours(c).iter().filter(|&&j| labels[j as usize] == labels[c]);
        let near = own.map(|&j| sq(j as usize)).fold(0.0, f64::max).sqrt();
        let reach = near.max(REACH.get() * sigma) * (1.0 + 1e-9);
        let inside = |_, j: usize| labels[j] == labels[c] && sq(j) <= reach * reach;
        let around = walk.run(scene, &[centre], AROUND.get(), inside);
        if around.len() < LEAST.get() {
            return None;
        }
        let (u, v) = perpendicular_frame(&self.shape.offset(&at).normal);
        let flat: Vec<[f64; 2]> = around
            .iter()
            .map(|&j| scene.points[j as usize] - at)
            .map(|d| [d.dot(&u), d.dot(&v)])
            .collect();
        let (cos, sin) = main_direction(&flat);
        let breadth = breadth(&flat, cos, sin, reach);
        let broad = breadth > (SURE.get() * sigma).max(BENT.get() * reach);
        Some(Place { centre, breadth, broad, along: u * cos + v * sin, across: v * cos - u * sin })
    }

    /// Whether the curves on which the points lie are several side by side.
    fn are_side_by_side(&self, places: &[Place]) -> bool {
        let curves = self.curves();
        if curves.iter().all(|c| *c == curves[0]) {
            return false;
        }
        let looked_at = places.iter().take_while(|_| !self.scene.cancelled());
        let between = looked_at.filter(|p| self.is_between_curves(p, &curves)).count();
        between * BROAD_PLACES.get() >= places.len()
    }

    /// Which curve each of the region's points is on: those that hang together along it. Lines side by side meet at
    /// their ends, where neighbours are further off, but across.
    fn curves(&self) -> Vec<u32> {
        let Self { scene, group, sigma, .. } = *self;
        let near = 0.5 * REACH.get() * sigma;
        let mut union = Union::new(group.len());
        for (k, &i) in group.iter().enumerate() {
            if k % WATCHED == 0 && scene.cancelled() {
                break;
            }
            let at = scene.points[i as usize];
            let own = scene.neighbours(i as usize).iter();
            let own = own.filter_map(|j| Some((*j, group.binary_search(j).ok()?)));
            let chords: Vec<(Vec3, usize)> =
                own.map(|(j, place)| (scene.points[j as usize] - at, place)).collect();
            let scatter: Mat3 = chords.iter().map(|(d, _)| d * d.transpose()).sum();
            let e = SymmetricEigen::new(scatter);
            let along = e.eigenvectors.column(e.eigenvalues.imax()).into_owned();
            for (d, place) in chords {
                if d.norm() < near || 2.0 * d.dot(&along).powi(2) > d.norm_squared() {
                    union.join(k as u32, place as u32);
                }
            }
        }
        (0..group.len() as u32).map(|k| union.root(k)).collect()
    }

    /// Whether on both sides of a place what lies next across is another curve: not the same one further on, and on
    /// both as any two wires may have a plane in common.
    fn is_between_curves(&self, place: &Place, curves: &[u32]) -> bool {
        let at = self.scene.points[place.centre as usize];
        let Ok(own) = self.group.binary_search(&place.centre) else { return false };
        let mut next = [(f64::INFINITY, curves[own]); 2];
        for (&j, &curve) in self.group.iter().zip(curves) {
            let d = self.scene.points[j as usize] - at;
            let across = d.dot(&place.across);
            // The noise of the place's own curve lies across too.
            if across.abs() > d.dot(&place.along).abs().max(REACH.get() * self.sigma / 2.0) {
                let side = &mut next[usize::from(across > 0.0)];
                if d.norm_squared() < side.0 {
                    *side = (d.norm_squared(), curve);
                }
            }
        }
        next.iter().all(|s| s.1 != curves[own])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Family;
    use crate::fit::fits::Random;

    fn is_surface(points: Vec<Vec3>, shape: &Shape, sigma: f64) -> bool {
        let scene = Scene::new(points);
        let labels = vec![0; scene.len()];
        let mut model = Partition { shapes: vec![*shape], labels, ..Partition::default() };
        mark(&scene, &mut model, sigma);
        model.is_surface(0)
    }

    fn plane() -> Shape {
        Shape::with_axis(Family::Plane, Vec3::zeros(), Vec3::z(), [0.0; 3])
    }

    fn noisy(random: &mut Random, p: Vec3, sigma: f64) -> Vec3 {
        p + sigma * Vec3::new(random.normal(), random.normal(), random.normal())
    }

    #[test]
    fn points_on_a_line_or_a_curve_are_no_surface() {
        let random = &mut Random::new(1);
        for sigma in [1e-6, 0.02, 0.2] {
            let line = (0..800).map(|k| Vec3::new(0.05 * f64::from(k), 0.0, 0.0));
            let line = line.map(|p| noisy(random, p, sigma)).collect();
            assert!(!is_surface(line, &plane(), sigma), "{sigma}");
            let cylinder =
                Shape::with_axis(Family::Cylinder, Vec3::zeros(), Vec3::z(), [20.0, 0.0, 0.0]);
            let turn = |t: f64| Vec3::new(20.0 * t.cos(), 20.0 * t.sin(), 0.5 * t);
            let helix = (0..2000).map(|k| turn(0.01 * f64::from(k)));
            let helix = helix.map(|p| noisy(random, p, sigma)).collect();
            assert!(!is_surface(helix, &cylinder, sigma), "{sigma}");
        }
    }

    #[test]
    fn strips_and_scan_lines_side_by_side_are_a_surface() {
        let random = &mut Random::new(2);
        let strip = (0..400).map(|k| {
            Vec3::new(0.5 * f64::from(k), random.uniform(0.0, 0.5), 0.01 * random.normal())
        });
        assert!(is_surface(strip.collect(), &plane(), 0.01));
        for apart in [1.0, 5.0, 8.0, 15.0] {
            let scan = (0..3000).map(|k| {
                let (row, column) = (f64::from(k / 300), f64::from(k % 300));
                noisy(random, Vec3::new(column, apart * row, 0.0), 0.1)
            });
            assert!(is_surface(scan.collect(), &plane(), 0.1), "{apart}");
        }
    }

    #[test]
    fn a_heap_as_thick_as_wide_is_no_surface_and_a_thick_sheet_is() {
        let random = &mut Random::new(3);
        for n in [60, 200, 500] {
            let mut unit = || random.uniform(-1.0, 1.0);
            let heap = (0..n).map(|_| Vec3::new(unit(), unit(), unit()));
            assert!(!is_surface(heap.collect(), &plane(), 0.55), "{n}");
            let sheet = (0..n).map(|_| {
                Vec3::new(
                    random.uniform(-1.0, 1.0),
                    random.uniform(-1.0, 1.0),
                    0.1 * random.normal(),
                )
            });
            assert!(is_surface(sheet.collect(), &plane(), 0.1), "{n}");
        }
    }

    #[test]
    fn few_points_must_lie_closer_to_a_surface() {
        let random = &mut Random::new(4);
        let mut sheet = |n: usize, sigma: f64| {
            let mut at = || random.uniform(-1.0, 1.0);
            let points: Vec<Vec3> = (0..n).map(|_| Vec3::new(at(), at(), sigma * at())).collect();
            is_surface(points, &plane(), sigma)
        };
        assert!(sheet(20, 1e-3) && !sheet(20, 0.05) && sheet(100, 0.05));
    }
}

//! Whether the vertices of a mesh are points of its surfaces, or the corners of its faces alone.
//!
//! A scanner's mesh has its vertices where the scanner measured: its triangles are about as large as the space of the
//! vertices, and no two lie in one plane, for there is noise. A CAD program puts vertices on the edges of faces: a
//! cylinder's are on its two rims, its triangles reach from one to the other, and two of them are one flat quadrangle.
//! Of these vertices no method can tell the surface.
//!
//! Flat facets without a vertex inside, and triangles that reach from one sharp edge to another (`starved`), show a CAD
//! mesh where they hold a good part of its area. So does a mesh whose vertices are much too few where its area is, and
//! whose triangles span the part or lie in one plane. The first is measured by the mean square of the triangles' longest
//! edges, weighted by area, over the area a vertex has on average: 2 to 8 for even meshes, 16 to thousands for CAD
//! meshes, but a hundred also for a scan whose points thin out with the distance from the scanner. Scans also have flat
//! floors, coordinates in steps, and a few large triangles over their gaps. So a mesh of more than a thousand vertices
//! must show that its edges are unlike at most of them: along a rim and across the face, 7 to 40 times as long; scans
//! show up to 5.5. Of a part of boxes the vertices are not too few for its area: a small mesh is also coarse where its
//! faces are flat and all its vertices on sharp edges.

use std::collections::HashMap;

use super::corners;
use super::polygons::{Faces, Triangle};
use super::sheet::Sheet;
use super::starved::{is_ribbed, is_starved};
use crate::geometry::Vec3;

/// Fewer vertices are no measurement: a region needs that many by default.
const FEWEST_VERTICES: usize = 50;
/// The least measure of a coarse mesh.
const COARSE: f64 = 8.0;
/// The mean longest edge, as a share of the mesh's diagonal, of triangles that span the part.
const SPAN: f64 = 0.3;
/// Share of the area, in triangles with a neighbour in the same plane, that no measured mesh has.
const FLAT_SHARE: f64 = 0.75;
/// Meshes up to this many vertices need not show unlike edges: a small part has short faces.
const SMALL: usize = 1000;
/// Longest over shortest edge at the median vertex of a larger mesh that is coarse.
const UNLIKE: f64 = 6.0;
/// Distance from a plane, as a share of the largest coordinate, that rounding to single precision leaves: four roundings.
const SINGLE: f64 = 2.4e-7;
/// Distance from a plane, as a share of the mesh's diagonal, that single precision leaves, and the most that
/// rounding to decimals does: more may be a scan's noise.
const FLAT: f64 = 1e-6;
const MOST_FLAT: f64 = 1e-4;

/// Whether the vertices of a mesh are the corners of large faces alone. `places` tells which vertices are one.
pub(super) fn is_coarse(points: &[Vec3], triangles: &[Triangle], places: &[u32]) -> bool {
    let shape = Shape::of(triangles, points, places);
    if triangles.is_empty() || 2 * shape.corners() < shape.places {
        // a cloud with a few faces is no mesh
        return false;
    }
    // what single precision leaves: more lies in one plane by chance
    let sheet = Sheet::of(points, triangles, shape.step().max(SINGLE * shape.largest()));
    shape.places < FEWEST_VERTICES
        || is_starved(&sheet, shape.area)
        || is_ribbed(&sheet, shape.area)
        || shape.is_coarse()
}

/// Whether a mesh is too large and its triangles too small for it to be coarse, in a time that its size does not matter
/// for: before corners at one place are made one, which leaves fewer of them.
pub(super) fn is_dense(points: &[Vec3], faces: &Faces) -> bool {
    if points.len() <= SMALL {
        return false;
    }
    let (mut area, mut weighted) = (0.0, 0.0);
    for face in faces.each() {
        let [first, others @ ..] = face else { continue };
        for pair in others.windows(2) {
            let corners = [*first, pair[0], pair[1]].map(|i| points.get(i as usize));
            let [Some(a), Some(b), Some(c)] = corners else { continue };
            let own = (b - a).cross(&(c - a)).norm() / 2.0;
            let sq = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
            if (own * sq).is_finite() {
                area += own;
                weighted += own * sq;
            }
        }
    }
    weighted * points.len() as f64 <= COARSE * area * area
}

/// How far from a plane a flat face's corners may be: what rounding leaves.
pub(super) fn thickness(triangles: &[Triangle], points: &[Vec3], places: &[u32]) -> f64 {
    let shape = Shape::of(triangles, points, places);
    shape.thickness(shape.diagonal())
}

/// What is measured of a mesh. Vertices at one place are one.
struct Shape<'a> {
    points: &'a [Vec3],
    /// How many places there are.
    places: usize,
    triangles: &'a [Triangle],
    area: f64,
    /// Mean square of the longest edges, weighted by area.
    sq_edge: f64,
}

impl<'a> Shape<'a> {
    fn of(triangles: &'a [Triangle], points: &'a [Vec3], places: &[u32]) -> Self {
        let places = (0..).zip(places).filter(|(i, place)| i == *place).count();
        let sq_longest = |t: &Triangle| {
            let [a, b, c] = t.corners.map(|i| points[i as usize]);
            (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared())
        };
        let area: f64 = triangles.iter().map(|t| t.area).sum();
        let weighted: f64 = triangles.iter().map(|t| t.area * sq_longest(t)).sum();
        Self { points, places, triangles, area, sq_edge: weighted / area }
    }

    /// How many points are corners of triangles.
    fn corners(&self) -> usize {
        let mut is_corner = vec![false; self.points.len()];
        self.triangles.iter().flat_map(|t| t.corners).for_each(|i| is_corner[i as usize] = true);
        is_corner.into_iter().filter(|is_corner| *is_corner).count()
    }

    fn is_coarse(&self) -> bool {
        let corners = self.corners();
        let measure = self.sq_edge * corners as f64 / self.area;
        let diagonal = self.diagonal();
        let spans = self.sq_edge > (SPAN * diagonal).powi(2);
        if !spans && self.flat_share(self.thickness(diagonal)) <= FLAT_SHARE {
            return false;
        }
        let few = measure > COARSE && (corners <= SMALL || self.unlikeness() > UNLIKE);
        let faces = self.triangles.iter().map(|t| (t.corners, t.normal));
        few || (!spans && corners <= SMALL && corners::are_all(faces))
    }

    /// How far from a plane a flat face's corners may be: what rounding leaves.
    fn thickness(&self, diagonal: f64) -> f64 {
        self.step().max(FLAT * diagonal).max(SINGLE * self.largest())
    }

    /// The step of coordinates with few decimals; none where it is so large that a scan may have noise of that size.
    fn step(&self) -> f64 {
        let step = corners::step(self.points);
        if step <= MOST_FLAT * self.diagonal() { step } else { 0.0 }
    }

    /// The largest coordinate.
    fn largest(&self) -> f64 {
        let corners = self.triangles.iter().flat_map(|t| t.corners);
        corners.map(|i| self.points[i as usize].amax()).fold(0.0, f64::max)
    }

    /// Longest over shortest edge at the median vertex.
    fn unlikeness(&self) -> f64 {
        let mut lengths = vec![(f64::INFINITY, 0.0_f64); self.points.len()];
        for &[a, b, c] in self.triangles.iter().map(|t| &t.corners) {
            for (i, j) in [(a, b), (b, c), (c, a)] {
                let (i, j) = (i as usize, j as usize);
                let length = (self.points[i] - self.points[j]).norm();
                for end in [i, j] {
                    let (shortest, longest) = &mut lengths[end];
                    (*shortest, *longest) = (shortest.min(length), longest.max(length));
                }
            }
        }
        let corners = lengths.into_iter().filter(|(_, longest)| *longest > 0.0);
        let mut ratios: Vec<f64> = corners.map(|(shortest, longest)| longest / shortest).collect();
        let middle = ratios.len() / 2;
        if ratios.is_empty() {
            0.0
        } else {
            *ratios.select_nth_unstable_by(middle, f64::total_cmp).1
        }
    }

    fn diagonal(&self) -> f64 {
        let (mut low, mut high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        for corner in self.triangles.iter().flat_map(|t| t.corners) {
            let point = self.points[corner as usize];
            (low, high) = (low.inf(&point), high.sup(&point));
        }
        (high - low).norm()
    }

    /// Share of the area in triangles that lie in one plane with a neighbour, up to `thickness`.
    fn flat_share(&self, thickness: f64) -> f64 {
        let mut first: HashMap<[u32; 2], usize> = HashMap::new();
        let mut flat = vec![false; self.triangles.len()];
        for (t, triangle) in self.triangles.iter().enumerate() {
            let [a, b, c] = triangle.corners;
            for (i, j, opposite) in [(a, b, c), (b, c, a), (c, a, b)] {
                let other = *first.entry([i.min(j), i.max(j)]).or_insert(t);
                let plane = &self.triangles[other];
                let at = self.points[opposite as usize] - self.points[i as usize];
                if other != t && plane.normal.dot(&at).abs() <= thickness {
                    (flat[t], flat[other]) = (true, true);
                }
            }
        }
        let area = self.triangles.iter().zip(&flat).filter(|(_, flat)| **flat);
        area.map(|(t, _)| t.area).sum::<f64>() / self.area
    }
}

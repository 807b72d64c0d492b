//! Whether the vertices of a mesh are points of its surfaces, or the corners of its faces alone.
//!
//! A scanner's mesh has its vertices where the scanner measured: its triangles are about as large as the
//! space of the vertices, and no two lie in one plane, for there is noise. A CAD program puts vertices on
//! the edges of faces: a cylinder's are on its two rims, its triangles reach from one to the other, and two
//! of them are one flat quadrangle. Of these vertices no method can tell the surface.
//!
//! A mesh is refused only where its vertices are much too few where its area is, and its triangles span
//! the part or lie in one plane. The first is measured by the mean square of the triangles' longest edges,
//! weighted by area, over the area a vertex has on average: 2 to 8 for even meshes, 16 to thousands for
//! CAD meshes, but a hundred also for a scan whose points thin out with the distance from the scanner. Scans
//! also have flat floors, coordinates in steps, and a few large triangles over their gaps. So a mesh of more
//! than a thousand vertices must show that its edges are unlike at most of them: along a rim and across the
//! face, 7 to 40 times as long; scans show up to 5.5. Of a part of boxes the vertices are not too few for its
//! area: a small mesh is also refused where its faces are flat and all its vertices on sharp edges.

mod corners;

use std::collections::HashMap;

use super::{Format, FormatError};
use crate::geometry::Vec3;

/// A mesh with more vertices, or triangles, is not looked at: it is no coarse one.
const MAX_VERTICES: usize = 1 << 18;
const MAX_TRIANGLES: usize = 1 << 20;
/// Fewer vertices hold no surface in any case.
const FEWEST_VERTICES: usize = 10;
/// The least measure of a mesh that may be refused.
const COARSE: f64 = 8.0;
/// The mean longest edge, as a share of the mesh's diagonal, of triangles that span the part.
const SPAN: f64 = 0.3;
/// Share of the area, in triangles with a neighbour in the same plane, that no measured mesh has.
const FLAT_SHARE: f64 = 0.75;
/// Meshes up to this many vertices need not show unlike edges: a small part has short faces.
const SMALL: usize = 1000;
/// Longest over shortest edge at the median vertex of a larger mesh that may be refused.
const UNLIKE: f64 = 6.0;
/// Distance from a plane, as a share of the mesh's diagonal, that single precision leaves, and the most that
/// rounding to decimals does: more may be a scan's noise.
const FLAT: f64 = 1e-6;
const MOST_FLAT: f64 = 1e-4;

/// The triangles of a mesh, as far as they are looked at.
#[derive(Debug, Default)]
pub(super) struct Triangles {
    corners: Vec<[u32; 3]>,
    too_many: bool,
}

impl Triangles {
    /// Whether triangles of a mesh with that many vertices are of use.
    pub(super) fn are_wanted(&self, vertices: u64) -> bool {
        !self.too_many && vertices <= MAX_VERTICES as u64
    }

    /// Adds a face with its corners in their order, as a fan of triangles.
    pub(super) fn push(&mut self, face: &[u32]) {
        let [first, others @ ..] = face else { return };
        for pair in others.windows(2) {
            self.too_many |= self.corners.len() == MAX_TRIANGLES;
            if self.too_many {
                return;
            }
            self.corners.push([*first, pair[0], pair[1]]);
        }
    }

    /// Refuses the vertices of a mesh that are the corners of large faces alone.
    pub(super) fn check(&self, format: Format, points: &[Vec3]) -> Result<(), FormatError> {
        let vertices = points.len();
        let looked_at = vertices >= FEWEST_VERTICES && self.are_wanted(vertices as u64);
        let coarse = looked_at && Shape::of(self, points).is_coarse();
        if coarse { Err(FormatError::CadMesh { format, vertices }) } else { Ok(()) }
    }
}

/// A triangle with an area.
struct Triangle {
    corners: [u32; 3],
    area: f64,
    sq_longest: f64,
    normal: Vec3,
}

/// What is measured of a mesh. Vertices at one place are one.
struct Shape<'a> {
    points: &'a [Vec3],
    /// How many places there are.
    places: usize,
    triangles: Vec<Triangle>,
    area: f64,
    /// Mean square of the longest edges, weighted by area.
    sq_edge: f64,
}

impl<'a> Shape<'a> {
    fn of(triangles: &Triangles, points: &'a [Vec3]) -> Self {
        let place = corners::places(points);
        let places = (0..).zip(&place).filter(|(i, place)| i == *place).count();
        let whole = |corners: &[u32; 3]| {
            let place = |i: u32| place.get(i as usize).copied();
            let [i, j, k] = [place(corners[0])?, place(corners[1])?, place(corners[2])?];
            let [a, b, c] = [i, j, k].map(|i| points[i as usize]);
            let normal = (b - a).cross(&(c - a));
            let area = normal.norm() / 2.0;
            let sq_longest = (b - a).norm_squared().max((c - b).norm_squared());
            let sq_longest = sq_longest.max((a - c).norm_squared());
            let whole = area > 0.0 && area.is_finite() && sq_longest.is_finite();
            let normal = normal / (2.0 * area);
            whole.then_some(Triangle { corners: [i, j, k], area, sq_longest, normal })
        };
        let triangles: Vec<_> = triangles.corners.iter().filter_map(whole).collect();
        let area: f64 = triangles.iter().map(|t| t.area).sum();
        let weighted: f64 = triangles.iter().map(|t| t.area * t.sq_longest).sum();
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
        if 2 * corners < self.places {
            // a cloud with a few faces is no mesh
            return false;
        }
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
        let step = corners::step(self.points);
        if step <= MOST_FLAT * diagonal { step.max(FLAT * diagonal) } else { FLAT * diagonal }
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

#[cfg(test)]
pub(super) mod tests;

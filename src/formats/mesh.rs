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
//! face, 7 to 40 times as long; scans show up to 5.5.

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
/// Distance from a plane, as a share of the mesh's diagonal, that single precision leaves.
const FLAT: f64 = 1e-6;

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

/// What is measured of a mesh.
struct Shape<'a> {
    points: &'a [Vec3],
    triangles: Vec<Triangle>,
    area: f64,
    /// Mean square of the longest edges, weighted by area.
    sq_edge: f64,
}

impl<'a> Shape<'a> {
    fn of(triangles: &Triangles, points: &'a [Vec3]) -> Self {
        let corner = |i: u32| points.get(i as usize).copied();
        let whole = |&[i, j, k]: &[u32; 3]| {
            let (a, b, c) = (corner(i)?, corner(j)?, corner(k)?);
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
        Self { points, triangles, area, sq_edge: weighted / area }
    }

    /// How many points are corners of triangles.
    fn corners(&self) -> usize {
        let mut is_corner = vec![false; self.points.len()];
        self.triangles.iter().flat_map(|t| t.corners).for_each(|i| is_corner[i as usize] = true);
        is_corner.into_iter().filter(|is_corner| *is_corner).count()
    }

    fn is_coarse(&self) -> bool {
        let corners = self.corners();
        if 2 * corners < self.points.len() {
            // a cloud with a few faces is no mesh
            return false;
        }
        let measure = self.sq_edge * corners as f64 / self.area;
        let diagonal = self.diagonal();
        measure > COARSE
            && (self.sq_edge > (SPAN * diagonal).powi(2)
                || self.flat_share(FLAT * diagonal) > FLAT_SHARE)
            && (corners <= SMALL || self.unlikeness() > UNLIKE)
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
pub(super) mod tests {
    use std::f64::consts::TAU;

    use super::*;

    pub(in crate::formats) type Mesh = (Vec<Vec3>, Vec<[u32; 3]>);

    fn is_refused((points, faces): &Mesh) -> bool {
        let mut triangles = Triangles::default();
        faces.iter().for_each(|face| triangles.push(face));
        let told = triangles.check(Format::Stl, points);
        assert!(
            told.is_ok()
                || told
                    == Err(FormatError::CadMesh { format: Format::Stl, vertices: points.len() })
        );
        told.is_err()
    }

    /// A closed cylinder or cone as CAD programs mesh it: vertices on the rims and axis alone.
    pub(in crate::formats) fn turned(sides: u32, radius: f64, height: f64, top: f64) -> Mesh {
        let mut points = vec![Vec3::zeros(), Vec3::new(0.0, 0.0, height)];
        for i in 0..sides {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(sides)).sin_cos();
            points.push(Vec3::new(radius * cos, radius * sin, 0.0));
            points.push(Vec3::new(top * cos, top * sin, height));
        }
        let mut faces = Vec::new();
        for i in 0..sides {
            let (low, next) = (2 + 2 * i, 2 + 2 * ((i + 1) % sides));
            faces.extend([[0, next, low], [low, next, next + 1], [low, next + 1, low + 1]]);
            faces.push([1, low + 1, next + 1]);
        }
        (points, faces)
    }

    /// A measured plane: rows of points `across` apart, `along` within a row, with noise.
    fn scan(rows: u32, columns: u32, across: f64, along: impl Fn(u32) -> f64, noise: f64) -> Mesh {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let points = (0..rows * columns).map(|i| {
            let (row, column) = (i / columns, i % columns);
            Vec3::new(along(column), f64::from(row) * across, noise * random())
        });
        let points = points.collect();
        let mut faces = Vec::new();
        for i in (0..(rows - 1) * columns).filter(|i| (i + 1) % columns != 0) {
            faces.extend([[i, i + 1, i + columns], [i + 1, i + columns + 1, i + columns]]);
        }
        (points, faces)
    }

    #[test]
    fn cad_meshes_of_any_fineness_are_refused() {
        for sides in [24, 32, 64, 360, 2000] {
            assert!(is_refused(&turned(sides, 15.0, 40.0, 15.0)), "cylinder of {sides} sides");
            assert!(is_refused(&turned(sides, 10.0, 25.0, 0.001)), "cone of {sides} sides");
            assert!(is_refused(&turned(sides, 10.0, 25.0, 4.0)), "frustum of {sides} sides");
        }
        // a plate with many bores: its faces are flat, its triangles small beside it
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        for bore in 0..100 {
            let (place, begin) = (f64::from(bore) * 20.0, points.len() as u32);
            let (corners, corner_faces) = turned(64, 5.0, 30.0, 5.0);
            points.extend(corners.iter().map(|p| p + Vec3::new(place, 0.0, 0.0)));
            faces.extend(corner_faces.iter().map(|f| f.map(|i| i + begin)));
        }
        assert!(is_refused(&(points, faces)));
    }

    #[test]
    fn meshes_of_scans_are_taken_however_uneven() {
        let even = |step: f64| move |i: u32| f64::from(i) * step;
        for noise in [0.0, 0.01, 0.5] {
            assert!(!is_refused(&scan(60, 60, 1.0, even(1.0), noise)));
        }
        // lines far apart, and points that thin out with the distance from the scanner
        assert!(!is_refused(&scan(20, 600, 1.0, even(0.02), 0.002)));
        assert!(!is_refused(&scan(40, 200, 0.5, |i| 1.03f64.powi(i as i32), 0.002)));
        assert!(!is_refused(&scan(3, 20, 0.1, even(0.1), 0.001)));
    }

    #[test]
    fn scans_with_large_triangles_over_gaps_and_flat_floors_are_taken() {
        // two patches far apart, and the strip between them
        let (mut points, mut faces) = scan(50, 50, 1.0, f64::from, 0.01);
        let (other, others) = scan(50, 50, 1.0, |i| f64::from(i) + 200.0, 0.01);
        let begin = points.len() as u32;
        points.extend(other);
        faces.extend(others.iter().map(|face| face.map(|i| i + begin)));
        for row in 0..49 {
            let (low, far) = (row * 50 + 49, begin + row * 50);
            faces.extend([[low, far, low + 50], [far, far + 50, low + 50]]);
        }
        assert!(!is_refused(&(points, faces)));
        // a floor that is exact, thinning out with the distance
        assert!(!is_refused(&scan(60, 120, 0.5, |i| 1.04f64.powi(i as i32), 0.0)));
    }

    #[test]
    fn a_cloud_with_a_few_large_faces_is_a_cloud() {
        let (points, _) = scan(60, 60, 1.0, f64::from, 0.01);
        assert!(!is_refused(&(points, vec![[0, 59, 3599], [0, 3599, 3540]])));
    }

    #[test]
    fn a_fine_mesh_of_a_sphere_samples_it() {
        let (rings, sides) = (30u32, 60u32);
        let points = (0..rings * sides).map(|i| {
            let (theta, phi) = (
                TAU / 2.0 * (f64::from(i / sides) + 0.5) / f64::from(rings),
                TAU * f64::from(i % sides) / f64::from(sides),
            );
            Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
        });
        let next = |i: u32| i - i % sides + (i + 1) % sides;
        let faces = (0..(rings - 1) * sides)
            .flat_map(|i| [[i, i + sides, next(i)], [next(i), i + sides, next(i) + sides]]);
        assert!(!is_refused(&(points.collect(), faces.collect())));
    }

    #[test]
    fn faces_that_are_none_are_passed_over() {
        let (points, _) = turned(64, 15.0, 40.0, 15.0);
        for faces in [vec![], vec![[0, 0, 0]], vec![[0, 1, u32::MAX]]] {
            assert!(!is_refused(&(points.clone(), faces)));
        }
        assert!(!is_refused(&(vec![Vec3::repeat(f64::NAN); 3], vec![[0, 1, 2]])));
        assert!(!is_refused(&(vec![], vec![[0, 1, 2]])));
    }
}

//! Which triangles touch, and which of them are one flat facet.

use super::polygons::Triangle;
use crate::geometry::Vec3;

/// No triangle.
pub(super) const NONE: u32 = u32::MAX;

/// The triangles of a mesh with their neighbours and flat facets.
pub(super) struct Sheet<'a> {
    pub(super) points: &'a [Vec3],
    pub(super) triangles: &'a [Triangle],
    /// Across the side behind each corner (side k runs from corner k to the next): the other triangle, where there is
    /// exactly one.
    pub(super) across: Vec<[u32; 3]>,
    /// The facet of each triangle.
    pub(super) facet_of: Vec<u32>,
    pub(super) facets: Vec<Facet>,
}

/// Triangles that touch in one plane.
#[derive(Clone, Debug)]
pub(super) struct Facet {
    /// Unit normal; its sign means nothing.
    pub(super) normal: Vec3,
    pub(super) centroid: Vec3,
    /// How many triangles it has.
    pub(super) triangles: u32,
}

impl<'a> Sheet<'a> {
    /// `thickness` is how far a facet's corners may be from its plane.
    pub(super) fn of(points: &'a [Vec3], triangles: &'a [Triangle], thickness: f64) -> Self {
        let across = neighbours(triangles);
        let mut sheet =
            Self { points, triangles, across, facet_of: Vec::new(), facets: Vec::new() };
        sheet.gather(thickness);
        sheet
    }

    /// The ends of a triangle's side.
    pub(super) fn side(&self, t: u32, k: usize) -> [u32; 2] {
        let corners = self.triangles[t as usize].corners;
        [corners[k], corners[(k + 1) % 3]]
    }

    pub(super) fn at(&self, corner: u32) -> Vec3 {
        self.points[corner as usize]
    }

    /// The corner of a triangle that is not on its side `k`.
    fn opposite(&self, t: u32, k: usize) -> Vec3 {
        self.at(self.triangles[t as usize].corners[(k + 2) % 3])
    }

    /// Which side of `t` lies at the edge of two corners.
    pub(super) fn side_at(&self, t: u32, [a, b]: [u32; 2]) -> Option<usize> {
        (0..3).find(|&k| {
            let [i, j] = self.side(t, k);
            [i, j] == [a, b] || [j, i] == [a, b]
        })
    }

    fn gather(&mut self, thickness: f64) {
        self.facet_of = vec![NONE; self.triangles.len()];
        let mut stack = Vec::new();
        for first in 0..self.triangles.len() as u32 {
            if self.facet_of[first as usize] != NONE {
                continue;
            }
            let number = self.facets.len() as u32;
            let own = self.triangles[first as usize].normal;
            let (mut area, mut normal, mut centroid, mut count) =
                (0.0, Vec3::zeros(), Vec3::zeros(), 0);
            self.facet_of[first as usize] = number;
            stack.push(first);
            while let Some(t) = stack.pop() {
                let triangle = &self.triangles[t as usize];
                let [a, b, c] = triangle.corners.map(|i| self.at(i));
                let sign = if triangle.normal.dot(&own) < 0.0 { -1.0 } else { 1.0 };
                area += triangle.area;
                normal += sign * triangle.area * triangle.normal;
                centroid += triangle.area * (a + b + c) / 3.0;
                count += 1;
                for k in 0..3 {
                    let other = self.across[t as usize][k];
                    if other != NONE
                        && self.facet_of[other as usize] == NONE
                        && self.is_flat(t, k, other, thickness)
                    {
                        self.facet_of[other as usize] = number;
                        stack.push(other);
                    }
                }
            }
            let normal = normal.try_normalize(0.0).unwrap_or(own);
            let centroid = centroid / area;
            self.facets.push(Facet { normal, centroid, triangles: count });
        }
    }

    /// Whether two triangles lie in one plane, on either side of their edge.
    fn is_flat(&self, t: u32, k: usize, other: u32, thickness: f64) -> bool {
        let edge = self.side(t, k);
        let Some(l) = self.side_at(other, edge) else { return false };
        let [start, end] = edge.map(|i| self.at(i));
        let (mine, its) = (self.opposite(t, k) - start, self.opposite(other, l) - start);
        let (n, m) = (self.triangles[t as usize].normal, self.triangles[other as usize].normal);
        let length = (end - start).norm();
        let high = |t: u32| 2.0 * self.triangles[t as usize].area / length;
        // a corner's rounding turns the plane of a low triangle by more
        let (low, tall) = (high(t), high(other));
        let along = (end - start) / length;
        let flat = |v: Vec3| v - v.dot(&along) * along;
        its.dot(&n).abs() <= thickness * (tall / low).max(1.0)
            && mine.dot(&m).abs() <= thickness * (low / tall).max(1.0)
            && flat(mine).dot(&flat(its)) < 0.0
    }
}

/// For each side of each triangle the triangle across, where there is exactly one.
fn neighbours(triangles: &[Triangle]) -> Vec<[u32; 3]> {
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * triangles.len());
    for (t, triangle) in (0u32..).zip(triangles) {
        for k in 0..3 {
            let (a, b) = (triangle.corners[k], triangle.corners[(k + 1) % 3]);
            sides.push(([a.min(b), a.max(b)], t));
        }
    }
    sides.sort_unstable();
    let mut across = vec![[NONE; 3]; triangles.len()];
    for at_edge in sides.chunk_by(|a, b| a.0 == b.0) {
        let &[(edge, t), (_, u)] = at_edge else { continue };
        for (t, u) in [(t, u), (u, t)] {
            let corners = triangles[t as usize].corners;
            let is_at = |k: &usize| {
                let (a, b) = (corners[*k], corners[(*k + 1) % 3]);
                [a.min(b), a.max(b)] == edge
            };
            if let Some(k) = (0..3).find(is_at) {
                across[t as usize][k] = u;
            }
        }
    }
    across
}

//! Faces to triangles.

use std::collections::HashSet;

use crate::geometry::Vec3;

/// Corners up to which a face is cut by its ears, which takes a time that grows with their square or more; others are
/// cut as a fan.
const MOST_EARS: usize = 512;

/// The faces of a file: the places of their corners among the vertices.
#[derive(Debug, Default)]
pub(in crate::formats) struct Faces {
    corners: Vec<u32>,
    /// Where each face's corners end.
    ends: Vec<u32>,
    /// How many faces there are, kept or not.
    count: usize,
    too_many: bool,
}

impl Faces {
    /// Corners of all faces that are kept: of two million triangles.
    pub(in crate::formats) const MOST_CORNERS: usize = 6 << 20;

    /// Whether more faces are of use.
    pub(in crate::formats) fn are_wanted(&self) -> bool {
        !self.too_many
    }

    /// Adds a face with its corners in their order.
    pub(in crate::formats) fn push(&mut self, face: &[u32]) {
        self.count += 1;
        self.too_many |= self.corners.len() + face.len() > Self::MOST_CORNERS;
        if !self.too_many {
            self.corners.extend(face);
            self.ends.push(self.corners.len() as u32);
        }
    }

    /// Notes how many faces there are where not all are added.
    pub(in crate::formats) fn set_count(&mut self, count: u64) {
        self.count = usize::try_from(count).unwrap_or(usize::MAX);
    }

    /// How many faces there are.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Whether there are more than are kept.
    pub(super) fn too_many(&self) -> bool {
        self.too_many
    }

    /// The corners of each face.
    pub(super) fn each(&self) -> impl Iterator<Item = &[u32]> {
        let begins = std::iter::once(0).chain(self.ends.iter().copied());
        begins.zip(&self.ends).map(|(begin, end)| &self.corners[begin as usize..*end as usize])
    }

    /// The triangles of the faces that have an area, each once; corners are the first vertices at their places.
    pub(super) fn triangles(&self, points: &[Vec3], places: &[u32]) -> Vec<Triangle> {
        let mut triangles =
            Vec::with_capacity(self.corners.len().saturating_sub(2 * self.ends.len()));
        let mut seen = HashSet::with_capacity(self.ends.len());
        let mut corners = Vec::new();
        for (face, places_of) in (0..).zip(self.each()) {
            corners.clear();
            corners.extend(places_of.iter().filter_map(|&i| places.get(i as usize).copied()));
            if corners.len() < places_of.len() {
                continue;
            }
            corners.dedup();
            cut(&mut corners, points, |corners| {
                let mut sorted = corners;
                sorted.sort_unstable();
                let triangle = Triangle::of(corners, face, points);
                if let Some(triangle) = triangle.filter(|_| seen.insert(sorted)) {
                    triangles.push(triangle);
                }
            });
        }
        triangles
    }
}

/// A triangle with an area.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub(super) corners: [u32; 3],
    /// Which face of the file it is of.
    pub(super) face: u32,
    pub(super) area: f64,
    pub(super) normal: Vec3,
}

impl Triangle {
    fn of(corners: [u32; 3], face: u32, points: &[Vec3]) -> Option<Self> {
        let [a, b, c] = corners.map(|i| points[i as usize]);
        let normal = (b - a).cross(&(c - a));
        let twice = normal.norm();
        let whole = twice > 0.0 && twice.is_finite();
        whole.then(|| Self { corners, face, area: twice / 2.0, normal: normal / twice })
    }
}

/// Cuts a polygon into triangles. `corners` are used up.
fn cut(corners: &mut Vec<u32>, points: &[Vec3], mut triangle: impl FnMut([u32; 3])) {
    let at = |i: u32| points[i as usize];
    let whole: Vec3 = (1..corners.len().max(1) - 1)
        .map(|k| {
            let [a, b, c] = [0, k, k + 1].map(|k| at(corners[k]));
            (b - a).cross(&(c - a))
        })
        .sum();
    while corners.len() > 3 && corners.len() <= MOST_EARS {
        let n = corners.len();
        let ear = (0..n).find(|&k| {
            let ear = [corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]];
            let [a, b, c] = ear.map(at);
            let turn = (b - a).cross(&(c - b)).dot(&whole);
            let inside = |i: &u32| !ear.contains(i) && holds([a, b, c], &whole, at(*i));
            turn > 0.0 && !corners.iter().any(inside)
        });
        // a polygon that crosses itself has none
        let Some(k) = ear else { break };
        triangle([corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]]);
        corners.remove(k);
    }
    for k in 1..corners.len().max(1) - 1 {
        triangle([corners[0], corners[k], corners[k + 1]]);
    }
}

/// Whether a place lies within a triangle, seen along `up`.
fn holds([a, b, c]: [Vec3; 3], up: &Vec3, p: Vec3) -> bool {
    [(a, b), (b, c), (c, a)].iter().all(|(s, e)| (e - s).cross(&(p - s)).dot(up) >= 0.0)
}

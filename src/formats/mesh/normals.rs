//! The surface's normal at each corner of each triangle.
//!
//! Around a vertex the facets that belong to one smooth surface make a fan. The normal is the sum of theirs by N. Max's
//! weights (Weights for computing vertex normals from facet normals, Journal of Graphics Tools 4, 1999), sine of the
//! corner over the product of its edges: exact on spheres, and on cylinders where facets are of unlike width.

use super::bends::Curved;
use super::sheet::{NONE, Sheet};
use crate::geometry::Vec3;

/// How many times the largest bend a facet may be turned from the normal: at a cone's apex it is by far more.
const TURNED: f64 = 1.2;
/// Least turn, in radians, of a facet from the normal at an apex: less is rounding.
const LEAST: f64 = 1e-6;
/// Cosine of a corner that is a straight angle.
const STRAIGHT: f64 = -0.99;

/// What is known of the surface at a triangle's corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Unit normal, on the side of the triangle's own.
    pub(super) normal: Vec3,
    pub(super) kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// One facet alone: its own normal.
    Alone,
    /// Several facets.
    Fan,
    /// The tip of a cone.
    Apex,
}

/// The corners of all triangles, and the directions of the edges that leave each fan's vertex.
pub(super) struct Corners {
    pub(super) of: Vec<[Corner; 3]>,
    fans: Vec<[u32; 3]>,
    directions: Vec<Vec<Vec3>>,
    /// How the surface is curved at each facet.
    pub(super) facets: Vec<Curved>,
}

impl Corners {
    /// Whether the fan reaches to the other side of its vertex than `towards`.
    pub(super) fn is_covered(&self, t: usize, k: usize, towards: &Vec3) -> bool {
        let fan = self.fans[t][k] as usize;
        self.directions[fan].iter().any(|d| d.dot(towards) < -0.5)
    }

    pub(super) fn of(sheet: &Sheet, smooth: &[[bool; 3]], facets: Vec<Curved>) -> Self {
        let alone = |t: usize| Corner { normal: sheet.triangles[t].normal, kind: Kind::Alone };
        let n = sheet.triangles.len();
        let mut corners = Self {
            of: (0..n).map(|t| [alone(t); 3]).collect(),
            fans: vec![[NONE; 3]; n],
            directions: Vec::new(),
            facets,
        };
        let mut fan = Vec::new();
        for t in 0..n {
            for k in 0..3 {
                if corners.fans[t][k] == NONE {
                    corners.spread(sheet, smooth, (t, k), &mut fan);
                    corners.settle(sheet, smooth, &fan);
                }
            }
        }
        corners
    }

    /// Collects the fan of a corner: triangles, their corner, and whether they look the other way than the first.
    fn spread(
        &mut self,
        sheet: &Sheet,
        smooth: &[[bool; 3]],
        (t, k): (usize, usize),
        fan: &mut Vec<(usize, usize, bool)>,
    ) {
        let number = self.directions.len() as u32;
        let vertex = sheet.triangles[t].corners[k];
        self.directions.push(Vec::new());
        self.fans[t][k] = number;
        fan.clear();
        fan.push((t, k, false));
        let mut next = 0;
        while let Some(&(t, k, turned)) = fan.get(next) {
            next += 1;
            // the sides that begin and end at the corner
            for side in [k, (k + 2) % 3] {
                let other = sheet.across[t][side];
                if other == NONE || !smooth[t][side] {
                    continue;
                }
                let its = &sheet.triangles[other as usize];
                let Some(l) = its.corners.iter().position(|c| *c == vertex) else { continue };
                if self.fans[other as usize][l] == NONE {
                    self.fans[other as usize][l] = number;
                    let flips = its.normal.dot(&sheet.triangles[t].normal) < 0.0;
                    fan.push((other as usize, l, turned ^ flips));
                }
            }
        }
    }

    /// Works out the normal of a fan.
    fn settle(&mut self, sheet: &Sheet, smooth: &[[bool; 3]], fan: &[(usize, usize, bool)]) {
        let Some(&(t, k, _)) = fan.first() else { return };
        let number = self.fans[t][k] as usize;
        let vertex = sheet.triangles[t].corners[k];
        let first = sheet.facet_of[t];
        if fan.iter().all(|&(t, _, _)| sheet.facet_of[t] == first) {
            return;
        }
        let mut sum = Vec3::zeros();
        let mut facets: Vec<(u32, Vec<Vec3>, Vec3)> = Vec::new();
        for &(t, k, turned) in fan {
            let corners = sheet.triangles[t].corners;
            let sign = if turned { -1.0 } else { 1.0 };
            let normal = sign * sheet.triangles[t].normal;
            let facet = sheet.facet_of[t];
            let place = facets.iter().position(|f| f.0 == facet).unwrap_or_else(|| {
                facets.push((facet, Vec::new(), normal));
                facets.len() - 1
            });
            for (side, end) in [(k, corners[(k + 1) % 3]), ((k + 2) % 3, corners[(k + 2) % 3])] {
                let edge = sheet.at(end) - sheet.at(vertex);
                self.directions[number].push(edge.normalize());
                let other = sheet.across[t][side];
                if other == NONE || sheet.facet_of[other as usize] != facet {
                    facets[place].1.push(edge);
                }
            }
        }
        for (facet, edges, normal) in &facets {
            sum += weight(sheet, *facet, sheet.at(vertex), edges) * normal;
        }
        let Some(normal) = sum.try_normalize(0.0) else { return };
        let turn = |n: &Vec3| libm::acos(n.dot(&normal).clamp(-1.0, 1.0));
        let most = facets.iter().map(|f| turn(&f.2)).fold(0.0, f64::max);
        let is_apex = most > (TURNED * largest_bend(sheet, smooth, fan)).max(LEAST);
        for &(t, k, turned) in fan {
            let sign = if turned { -1.0 } else { 1.0 };
            self.of[t][k] = if is_apex {
                Corner { normal: sheet.triangles[t].normal, kind: Kind::Apex }
            } else {
                Corner { normal: sign * normal, kind: Kind::Fan }
            };
        }
    }
}

/// Max's weight of a facet's corner between its two edges there.
fn weight(sheet: &Sheet, facet: u32, vertex: Vec3, edges: &[Vec3]) -> f64 {
    let &[a, b] = edges else { return 0.0 };
    let product = a.norm() * b.norm();
    if a.dot(&b) > STRAIGHT * product {
        return a.cross(&b).norm() / (product * product);
    }
    // a vertex on a straight edge: two corners of a facet cut in two there
    let along = a / a.norm();
    let v = sheet.facets[facet as usize].centroid - vertex;
    let width = 2.0 * (v - v.dot(&along) * along).norm();
    if width > 0.0 { 4.0 / ((a.norm() + b.norm()) * width) } else { 0.0 }
}

/// The largest angle of a fan's triangle to one across a smooth side.
fn largest_bend(sheet: &Sheet, smooth: &[[bool; 3]], fan: &[(usize, usize, bool)]) -> f64 {
    let bends = fan.iter().flat_map(|&(t, _, _)| {
        (0..3).filter(move |&k| smooth[t][k]).map(move |k| {
            let other = sheet.triangles[sheet.across[t][k] as usize].normal;
            libm::acos(sheet.triangles[t].normal.dot(&other).abs().min(1.0))
        })
    });
    bends.fold(0.0, f64::max)
}

//! Faces that vertices are too few for: flat ones without any inside, and curved ones crossed from rim to rim.

use super::corners;
use super::polygons::Triangle;
use super::sheet::{NONE, Sheet};

/// Share of the area in facets without vertices inside from which on a mesh is coarse.
const STARVED: f64 = 0.25;
/// Share of a facet's corners that may be inside of it: the middle of a disc.
const INSIDE: f64 = 0.1;
/// Triangles in one plane without a corner inside that rounding hardly leaves of a scan.
const MANY: u32 = 12;
/// How many times as long as the shortest sides at its corners a triangle is that reaches across a face.
const RIB: f64 = 6.0;
/// The same beside the median triangle.
const LONG: f64 = 3.0;
/// Share of the triangles that do so in a CAD mesh; over the gaps of a scan it is a hundredth.
const RIBS: f64 = 0.04;
/// Squares of the shortest side, for each corner, that a facet must be larger than.
const LARGE: f64 = 3.0;

/// Whether a good part of the area is in flat facets without a vertex inside, of many triangles or large beside their
/// sides: no measurement leaves those.
pub(super) fn is_starved(sheet: &Sheet, whole: f64) -> bool {
    let mut corners: Vec<[u32; 2]> = Vec::with_capacity(3 * sheet.triangles.len());
    let mut outline: Vec<[u32; 2]> = Vec::new();
    let mut facets =
        vec![FlatFacet { shortest: f64::INFINITY, ..Default::default() }; sheet.facets.len()];
    for (t, triangle) in sheet.triangles.iter().enumerate() {
        let f = sheet.facet_of[t];
        let facet = &mut facets[f as usize];
        facet.area += triangle.area;
        facet.triangles += 1;
        for (k, corner) in triangle.corners.into_iter().enumerate() {
            let next = triangle.corners[(k + 1) % 3];
            facet.shortest = facet.shortest.min((sheet.at(next) - sheet.at(corner)).norm_squared());
            corners.push([f, corner]);
            let other = sheet.across[t][k];
            if other == NONE || sheet.facet_of[other as usize] != f {
                outline.extend([[f, corner], [f, next]]);
            }
        }
    }
    for list in [&mut corners, &mut outline] {
        list.sort_unstable();
        list.dedup();
    }
    corners.iter().for_each(|[f, _]| facets[*f as usize].corners += 1);
    outline.iter().for_each(|[f, _]| facets[*f as usize].outline += 1);
    let area =
        |of: &dyn Fn(&&FlatFacet) -> bool| facets.iter().filter(of).map(|f| f.area).sum::<f64>();
    let many = area(&|facet| facet.is_hollow() && facet.triangles >= MANY);
    let few = |facet: &&FlatFacet| facet.is_hollow() && (2..MANY).contains(&facet.triangles);
    let large = area(&|facet| few(facet) && facet.is_large());
    // by chance some large triangles of a scan lie in one plane with another, and more do not
    let single = area(&|facet| facet.triangles == 1 && facet.is_large());
    many + if large > 2.0 * single { large } else { 0.0 } > STARVED * whole
}

/// What is counted of a flat facet.
#[derive(Clone, Copy, Default)]
struct FlatFacet {
    area: f64,
    /// Square of the shortest side.
    shortest: f64,
    triangles: u32,
    corners: u32,
    /// Corners on its outline.
    outline: u32,
}

impl FlatFacet {
    /// Whether there is hardly a corner inside.
    fn is_hollow(&self) -> bool {
        f64::from(self.corners - self.outline) <= INSIDE * f64::from(self.corners)
    }

    fn is_large(&self) -> bool {
        self.area > LARGE * f64::from(self.corners) * self.shortest
    }
}

/// Whether a good part of the area, and more than a few triangles, are long beside their neighbours' sides and beside most
/// triangles, with all corners on sharp edges: those that reach across a curved face from rim to rim.
pub(super) fn is_ribbed(sheet: &Sheet, whole: f64) -> bool {
    let longest = |t: &Triangle| {
        let [a, b, c] = t.corners.map(|i| sheet.at(i));
        (b - a).norm().max((c - b).norm()).max((a - c).norm())
    };
    let lengths: Vec<f64> = sheet.triangles.iter().map(longest).collect();
    let mut shortest = vec![f64::INFINITY; sheet.points.len()];
    let mut is_sharp = vec![false; sheet.points.len()];
    for (t, triangle) in sheet.triangles.iter().enumerate() {
        for k in 0..3 {
            let ends = [triangle.corners[k], triangle.corners[(k + 1) % 3]];
            let length = (sheet.at(ends[0]) - sheet.at(ends[1])).norm();
            let other = sheet.triangles.get(sheet.across[t][k] as usize);
            let sharp = other
                .is_some_and(|other| triangle.normal.dot(&other.normal).abs() < corners::SHARP);
            for i in ends.map(|i| i as usize) {
                shortest[i] = shortest[i].min(length);
                is_sharp[i] |= sharp;
            }
        }
    }
    let mut sorted = lengths.clone();
    let middle = sorted.len() / 2;
    let median = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
    let (mut area, mut count) = (0.0, 0);
    for (triangle, length) in sheet.triangles.iter().zip(lengths) {
        let own = triangle.corners.map(|i| shortest[i as usize]).into_iter().fold(0.0, f64::max);
        let sharp = triangle.corners.iter().all(|&i| is_sharp[i as usize]);
        if sharp && length > RIB * own && length > LONG * median {
            area += triangle.area;
            count += 1;
        }
    }
    area > STARVED * whole && f64::from(count) > RIBS * sheet.triangles.len() as f64
}

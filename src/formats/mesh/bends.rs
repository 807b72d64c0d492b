//! Which edges of a mesh run across a curved surface.
//!
//! A curved surface comes as facets whose edges all bend the same way and by about as much a length: the bend is the
//! surface's curvature times the distance of the two facets' middles. An edge of the part bends by more than a facet
//! may, or bends alone. Where a curved surface runs smoothly into a flat one, the last edge bends by half of a facet's
//! angle only, and the flat facet is wider than those beside it, so the bend a length is at most half of theirs.

use super::sheet::{NONE, Sheet};
use crate::geometry::Vec3;

/// The largest bend within a surface, in radians: round parts have eight sides or more.
const SHARPEST: f64 = 46.0 * std::f64::consts::PI / 180.0;
/// The largest bend that needs its like on one side only, in radians: twelve sides a turn.
const EASY: f64 = 31.0 * std::f64::consts::PI / 180.0;
/// The largest bend, in radians, that needs no like between two triangles, which are of any width where vertices lie in no
/// order: thirty sides a turn.
const GENTLE: f64 = 12.0 * std::f64::consts::PI / 180.0;
/// How many times the bend a length may differ between parallel edges of one surface: less than the two of a flat facet
/// as wide as the curved one beside it.
const ALIKE: f64 = 1.8;
/// The same across a triangle, whose middle lies anywhere along the edge.
const ALIKE_TRIANGLE: f64 = 6.0;
/// How many times as wide as the next one a facet of a curved surface may be.
const WIDER: f64 = 3.0;
/// The same of two triangles, which may be slivers.
const WIDER_TRIANGLE: f64 = 5.0;
/// Share of its facets' larger bends below which an edge may be within a surface whatever its bend a length is: four
/// corners happen to lie nearly in one plane. Half of them is what an edge to a flat facet has.
const SLIGHT: f64 = 0.25;
/// How many times what the bends of a facet explain its surface may rise above a chord.
const MOST_RISE: f64 = 2.0;
/// Cosine of the angle up to which edges run in about one direction.
const BESIDE: f64 = 0.5;
/// Cosine of the angle from which on edges run across each other, and how many times the bends a length of
/// edges in between may differ: those of triangles with like sides are like.
const ACROSS: f64 = 0.25;
const ALIKE_ACROSS: f64 = 1.8;
/// Cosine of the angle up to which they are parallel.
const PARALLEL: f64 = 0.9;

/// An edge between two facets.
#[derive(Clone, Debug)]
pub(super) struct Bend {
    facets: [u32; 2],
    direction: Vec3,
    /// A place on it.
    place: Vec3,
    /// The bend, in radians.
    angle: f64,
    /// Distances of the facets' middles.
    reach: [f64; 2],
    /// For each facet whether the bend is to the side of its normal.
    up: [bool; 2],
}

impl Bend {
    fn of(sheet: &Sheet, t: u32, k: usize, other: u32) -> Self {
        let facets = [t, other].map(|t| sheet.facet_of[t as usize]);
        let [start, end] = sheet.side(t, k).map(|i| sheet.at(i));
        let direction = (end - start).normalize();
        // unit vectors into the triangles, at right angles to the edge
        let into = |t: u32| {
            let triangle = &sheet.triangles[t as usize];
            let middle = triangle.corners.map(|i| sheet.at(i)).iter().sum::<Vec3>() / 3.0;
            let v = middle - start;
            (v - v.dot(&direction) * direction).try_normalize(0.0).unwrap_or(v)
        };
        let [mine, its] = [into(t), into(other)];
        let towards = mine + its;
        let angle = 2.0 * libm::asin((towards.norm() / 2.0).min(1.0));
        let reach = facets.map(|f| {
            let v = sheet.facets[f as usize].centroid - start;
            (v - v.dot(&direction) * direction).norm()
        });
        let up = facets.map(|f| sheet.facets[f as usize].normal.dot(&towards) > 0.0);
        Self { facets, direction, place: start, angle, reach, up }
    }

    fn curvature(&self) -> f64 {
        self.angle / (self.reach[0] + self.reach[1])
    }

    fn side_of(&self, facet: u32) -> usize {
        usize::from(self.facets[1] == facet)
    }
}

/// Where a mesh is smooth.
pub(super) struct Smooth {
    /// Whether each side of each triangle is inside of a smooth surface, flat or curved.
    pub(super) sides: Vec<[bool; 3]>,
    /// How the surface is curved at each facet.
    pub(super) facets: Vec<Curved>,
}

/// Looks where a mesh is smooth.
pub(super) fn smooth(sheet: &Sheet) -> Smooth {
    let (bends, bend_at) = bends(sheet);
    let mut of_facet: Vec<Vec<u32>> = vec![Vec::new(); sheet.facets.len()];
    for (b, bend) in (0..).zip(&bends) {
        if bend.angle <= SHARPEST {
            bend.facets.iter().for_each(|&f| of_facet[f as usize].push(b));
        }
    }
    let curved: Vec<bool> =
        (0..bends.len()).map(|b| is_curved(sheet, &bends, &of_facet, b)).collect();
    let smooth = |t: usize, k: usize| {
        let other = sheet.across[t][k];
        other != NONE
            && (sheet.facet_of[t] == sheet.facet_of[other as usize]
                || bend_at[t][k] != NONE && curved[bend_at[t][k] as usize])
    };
    let sides = (0..sheet.triangles.len()).map(|t| [0, 1, 2].map(|k| smooth(t, k))).collect();
    Smooth { sides, facets: curved_facets(sheet, &bends, &curved) }
}

/// How much the bends of a facet say that the surface is curved: the direction of each edge, and its bend a length.
#[derive(Clone, Debug, Default)]
pub(super) struct Curved(Vec<(Vec3, f64)>);

impl Curved {
    /// The most that the surface may rise above a chord: an eighth of the curvature times the square of the length across
    /// the edge, and some more, for a bend a length is a mean.
    pub(super) fn most_rise(&self, chord: &Vec3) -> f64 {
        let rise = |(edge, curvature): &(Vec3, f64)| edge.cross(chord).norm_squared() * curvature;
        MOST_RISE / 8.0 * self.0.iter().map(rise).fold(0.0, f64::max)
    }
}

fn curved_facets(sheet: &Sheet, bends: &[Bend], curved: &[bool]) -> Vec<Curved> {
    let mut facets = vec![Curved::default(); sheet.facets.len()];
    for (bend, _) in bends.iter().zip(curved).filter(|(_, curved)| **curved) {
        for &facet in &bend.facets {
            facets[facet as usize].0.push((bend.direction, bend.curvature()));
        }
    }
    facets
}

/// The edges between facets, and the number of that at each side.
fn bends(sheet: &Sheet) -> (Vec<Bend>, Vec<[u32; 3]>) {
    let mut bends = Vec::new();
    let mut at = vec![[NONE; 3]; sheet.triangles.len()];
    for t in 0..sheet.triangles.len() as u32 {
        for k in 0..3 {
            let other = sheet.across[t as usize][k];
            if other == NONE
                || other < t
                || sheet.facet_of[t as usize] == sheet.facet_of[other as usize]
            {
                continue;
            }
            let number = bends.len() as u32;
            bends.push(Bend::of(sheet, t, k, other));
            at[t as usize][k] = number;
            if let Some(l) = sheet.side_at(other, sheet.side(t, k)) {
                at[other as usize][l] = number;
            }
        }
    }
    (bends, at)
}

/// Whether a bend is within a curved surface.
fn is_curved(sheet: &Sheet, bends: &[Bend], of_facet: &[Vec<u32>], number: usize) -> bool {
    let bend = &bends[number];
    let [near, far] = bend.reach;
    let triangles = bend.facets.map(|f| sheet.facets[f as usize].triangles == 1);
    let is_gentle = triangles == [true; 2] && bend.angle < GENTLE;
    let wider = if is_gentle { WIDER_TRIANGLE } else { WIDER };
    if bend.angle > SHARPEST || near > wider * far || far > wider * near {
        return false;
    }
    if is_gentle {
        return true;
    }
    let others = |facet: u32| {
        let others = of_facet[facet as usize].iter().filter(|b| **b as usize != number);
        others.map(|b| bends[*b as usize].angle).fold(0.0, f64::max)
    };
    if bend.facets.iter().all(|f| bend.angle < SLIGHT * others(*f)) {
        return true;
    }
    let mut likes = 0;
    for (side, &facet) in bend.facets.iter().enumerate() {
        let alike = if triangles[side] { ALIKE_TRIANGLE } else { ALIKE };
        let mut has_like = false;
        for &b in &of_facet[facet as usize] {
            let other = &bends[b as usize];
            let turn = bend.direction.dot(&other.direction).abs();
            let same_way = other.up[other.side_of(facet)] == bend.up[side];
            let aside = turn < ACROSS;
            if b as usize == number || aside || !same_way || on_one_line(bend, other) {
                continue;
            }
            let ratio = other.curvature() / bend.curvature();
            if turn > PARALLEL && ratio > alike {
                return false;
            }
            let most = if turn < BESIDE { ALIKE_ACROSS } else { ALIKE_TRIANGLE };
            has_like |= (1.0 / most..=most).contains(&ratio);
        }
        likes += u32::from(has_like);
    }
    likes == 2 || likes == 1 && bend.angle <= EASY
}

/// Whether two edges of a facet are parts of one straight line.
fn on_one_line(a: &Bend, b: &Bend) -> bool {
    let v = b.place - a.place;
    let off = (v - v.dot(&a.direction) * a.direction).norm();
    // far less than to the facet's middle
    off < 0.1 * a.reach[0].min(a.reach[1]).min(b.reach[0]).min(b.reach[1])
}

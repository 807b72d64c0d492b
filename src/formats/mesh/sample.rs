//! Points spread evenly over the surface that a mesh stands for.

use super::{
    lift::Lift,
    normals::Corners,
    sheet::{NONE, Sheet},
};
use crate::geometry::Vec3;

/// Points that the smallest surfaces are to have: three times as many as a region needs by default.
const ENOUGH: f64 = 150.0;
/// Share of the surfaces, smallest first, that may get fewer.
const SMALLEST: f64 = 0.1;
/// Fewest points, where the spacing is not given.
const FEWEST: f64 = 20_000.0;
/// The plastic number's first two powers, inverted: the even sequence in two dimensions (M. Roberts, The unreasonable
/// effectiveness of quasirandom sequences, 2018).
const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];

/// Scatter of the samples, as a share of the chord error. What the surface over a facet is off the true one is the same all
/// over the facet, and a method that tells surfaces by how their residuals hang together sees edges in it. By trial on
/// 36 meshes of nine parts: with half of it large surfaces fall to pieces.
const SCATTER: f64 = 0.2;
/// Share of the samples whose facets say what the chord error is: the rest may be misjudged.
const MOST: f64 = 0.95;

/// The samples and what each is of.
pub(super) struct Samples {
    pub(super) points: Vec<Vec3>,
    /// The triangle of each.
    pub(super) triangle_of: Vec<u32>,
    /// Distance of a point to the next, were they on squares.
    pub(super) spacing: f64,
    /// The largest height of the surface over its triangles, but for a few.
    pub(super) chord_error: f64,
}

/// The spacing that gives the smaller surfaces enough points, and the whole not more than `most`.
pub(super) fn spacing(sheet: &Sheet, smooth: &[[bool; 3]], most: usize) -> f64 {
    let mut areas = surfaces(sheet, smooth);
    areas.sort_unstable_by(f64::total_cmp);
    let whole: f64 = areas.iter().sum();
    let small = areas.get((SMALLEST * areas.len() as f64) as usize).copied().unwrap_or(whole);
    let wanted = ENOUGH * whole / small;
    let count = wanted.max(FEWEST).min(most as f64);
    (whole / count).sqrt()
}

/// The areas of the smooth pieces of the mesh.
fn surfaces(sheet: &Sheet, smooth: &[[bool; 3]]) -> Vec<f64> {
    let mut seen = vec![false; smooth.len()];
    let mut areas = Vec::new();
    let mut stack = Vec::new();
    for first in 0..smooth.len() {
        if std::mem::replace(&mut seen[first], true) {
            continue;
        }
        let mut area = 0.0;
        stack.push(first);
        while let Some(t) = stack.pop() {
            area += sheet.triangles[t].area;
            for (other, goes_on) in sheet.across[t].into_iter().zip(smooth[t]) {
                let goes_on = goes_on && other != NONE;
                if goes_on && !std::mem::replace(&mut seen[other as usize], true) {
                    stack.push(other as usize);
                }
            }
        }
        areas.push(area);
    }
    areas
}

/// Samples the mesh with one point for each square of that side. The number for each triangle is its share, fractions
/// going on to the next.
pub(super) fn samples(sheet: &Sheet, corners: &Corners, spacing: f64) -> Samples {
    let mut samples =
        Samples { points: Vec::new(), triangle_of: Vec::new(), spacing, chord_error: 0.0 };
    let (mut owed, mut place, mut heights) = (0.5, [0.5; 2], Vec::new());
    for (t, triangle) in sheet.triangles.iter().enumerate() {
        owed += triangle.area / (spacing * spacing);
        if owed < 1.0 {
            continue;
        }
        let lift = Lift::of(sheet, corners, t);
        while owed >= 1.0 {
            owed -= 1.0;
            for (x, step) in place.iter_mut().zip(STEPS) {
                *x = (*x + step) % 1.0;
            }
            let [mut u, mut v] = place;
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            samples.points.push(lift.at([1.0 - u - v, u, v]));
            samples.triangle_of.push(t as u32);
            heights.extend(Some(lift.height()).filter(|height| *height > 0.0));
        }
    }
    if !heights.is_empty() {
        let most = (MOST * heights.len() as f64) as usize;
        samples.chord_error = *heights.select_nth_unstable_by(most, f64::total_cmp).1;
        samples.scatter(sheet);
    }
    samples
}

impl Samples {
    /// Moves the samples off the surface, along the normals of their triangles.
    fn scatter(&mut self, sheet: &Sheet) {
        let mut state = 0_u64;
        for (point, &t) in self.points.iter_mut().zip(&self.triangle_of) {
            let normal = sheet.triangles[t as usize].normal;
            *point += SCATTER * self.chord_error * nearly_normal(&mut state) * normal;
        }
    }
}

/// A random number with mean 0, deviation 1 and nearly a normal distribution, the same on every machine: the sum of twelve
/// even ones, from G. Steele's SplitMix generator (Fast splittable pseudorandom number generators, OOPSLA 2014).
fn nearly_normal(state: &mut u64) -> f64 {
    let mut sum = -6.0;
    for _ in 0..12 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = *state;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^= bits >> 31;
        sum += (bits >> 11) as f64 / (1_u64 << 53) as f64;
    }
    sum
}

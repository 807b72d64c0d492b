//! From the flat facets to the surface that they stand for.
//!
//! Vertices lie on the surface; a facet is below it by up to the chord error. Each side of a triangle is the chord of an
//! arc whose ends have known normals: with the angle `2 a` between these its height is `L / 2 tan(a / 2)`. Between the
//! three arcs the surface is the quadratic one, which differs from a circle by `R a^4 / 32`, a sixteenth of `a^2` of the
//! chord error.

use super::normals::{Corner, Corners, Kind};
use super::sheet::Sheet;
use crate::geometry::Vec3;

/// Largest angle between a chord and its arc, in radians: that of a quarter turn.
const STEEPEST: f64 = std::f64::consts::FRAC_PI_4;

/// The surface over a triangle.
pub(super) struct Lift {
    corners: [Vec3; 3],
    /// From the middle of each side to its arc.
    sides: [Vec3; 3],
    /// The corner that is a cone's tip.
    tip: Option<usize>,
}

impl Lift {
    pub(super) fn of(sheet: &Sheet, corners: &Corners, t: usize) -> Self {
        // directions at the ends of a long side may be off by little, and its height by much
        let facet = &corners.facets[sheet.facet_of[t] as usize];
        let places = sheet.triangles[t].corners.map(|i| sheet.at(i));
        let normal = sheet.triangles[t].normal;
        let known = &corners.of[t];
        let sides = [0, 1, 2].map(|k| {
            let ends = [k, (k + 1) % 3];
            let chord = places[ends[1]] - places[ends[0]];
            let along = chord.normalize();
            let angle = |end: usize, along: Vec3| {
                let Corner { normal, kind } = known[ends[end]];
                let sure = match kind {
                    Kind::Alone | Kind::Apex => 0,
                    Kind::Fan if corners.is_covered(t, ends[end], &along) => 2,
                    Kind::Fan => 1,
                };
                (sure, -libm::asin(normal.dot(&along).clamp(-1.0, 1.0)))
            };
            let (first, second) = (angle(0, along), angle(1, -along));
            let bend = match first.0.cmp(&second.0) {
                std::cmp::Ordering::Greater => first.1,
                std::cmp::Ordering::Less => second.1,
                std::cmp::Ordering::Equal => (first.1 + second.1) / 2.0,
            };
            let bend = bend.clamp(-STEEPEST, STEEPEST);
            let most = facet.most_rise(&chord) / (chord.norm() / 2.0);
            let bend = bend.clamp(-2.0 * libm::atan(most), 2.0 * libm::atan(most));
            let up = known[ends[0]].normal + known[ends[1]].normal;
            let up = (up - up.dot(&along) * along).try_normalize(0.0).unwrap_or(normal);
            chord.norm() / 2.0 * libm::tan(bend / 2.0) * up
        });
        let tip = known.iter().position(|corner| corner.kind == Kind::Apex);
        Self { corners: places, sides, tip }
    }

    /// The place on the surface at barycentric coordinates.
    pub(super) fn at(&self, weights: [f64; 3]) -> Vec3 {
        let mut place = Vec3::zeros();
        for k in 0..3 {
            place += weights[k] * self.corners[k];
            let next = (k + 1) % 3;
            // towards a cone's tip arcs shrink as their chords do
            let scale = match self.tip {
                Some(tip) if tip != k && tip != next => 1.0 / (weights[k] + weights[next]),
                _ => 1.0,
            };
            if scale.is_finite() {
                place += 4.0 * weights[k] * weights[next] * scale * self.sides[k];
            }
        }
        place
    }

    /// How far the surface is from the triangle's plane.
    pub(super) fn height(&self) -> f64 {
        self.sides.iter().map(|side| side.norm()).fold(0.0, f64::max)
    }
}

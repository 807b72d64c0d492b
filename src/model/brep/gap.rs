//! Which loops of an outline are borders with nothing beyond.

use super::bound::Draft;
use super::edge::Use;
use super::outline::{Loop, twice_area};
use crate::fit::constant::constants;
use crate::geometry::{Surface, Vec3};

constants! {
    /// Holes smaller than this many cells are gaps between points.
    LEAST_HOLE: f64 = 12.0, Trial(12.0, 12.0);
    /// The rim of a ball's chart is within this many cells of the far end where there is no border.
    FAR: f64 = 8.0, Trial(8.0, 8.0);
    /// A cone has its apex, and a ball its far end, where there are points within this many spacings.
    APEX: f64 = 2.5, Trial(2.5, 2.5);
}

impl Draft<'_> {
    /// Whether a loop of the outline is one on which no shared edge lies, and not just a gap between points.
    pub fn is_free(&self, line: &Loop, shared: &[(Use, [i32; 2])]) -> bool {
        let [a, b] = self.outline.cell;
        let area = twice_area(&line.places) / 2.0;
        if line.turns == [0, 0] {
            if area < 0.0 && -area < LEAST_HOLE.get() * a * b {
                return false;
            }
            if area > 0.0 && self.is_far_end(line) {
                return false;
            }
        } else if self.is_apex(line) {
            return false;
        }
        let reach = 3.0 * a.max(b);
        let stride = line.places.len().div_ceil(60).max(1);
        let few: Vec<Vec3> =
            line.places.iter().step_by(stride).map(|c| self.sheet.at(*c)).collect();
        let beside = |x: &&Vec3| {
            // Lines that close around an axis stand for those of the outline that do so the same way.
            shared
                .iter()
                .filter(|(_, turns)| {
                    line.turns == [0, 0] || *turns == [0, 0] || *turns == line.turns
                })
                .any(|(u, _)| {
                    let edge = &self.edges[u.edge];
                    let reach = reach
                        + self.part.reach([edge.regions[0], edge.regions[edge.regions.len() - 1]]);
                    let (t, off) = edge.curve.locate(x);
                    let total = edge.curve.length();
                    let on = |t: f64| t > edge.span[0] - reach && t < edge.span[1] + reach;
                    off < reach && (on(t) || edge.curve.closed && on(t + total))
                })
        };
        few.iter().filter(beside).count() * 2 < few.len()
    }

    /// Whether a loop is the rim of a ball's chart where all around there are points: the far end, in truth one place.
    fn is_far_end(&self, line: &Loop) -> bool {
        let (Surface::Sphere(_) | Surface::Ellipsoid(_)) = &self.sheet.surface else {
            return false;
        };
        let far = self.sheet.at([2.0 * self.sheet.scale[0], 0.0]);
        let near = APEX.get() * self.part.spacing[self.region];
        let most = FAR.get() * self.outline.cell[0];
        self.part.points[self.region].iter().any(|p| (p - far).norm() < near)
            && line.places.iter().all(|c| (self.sheet.at(*c) - far).norm() < most)
    }

    /// Whether a line around a cone's axis is the one next to an apex up to which there are points.
    fn is_apex(&self, line: &Loop) -> bool {
        let Surface::Cone(s) = &self.sheet.surface else { return false };
        let sin = s.half_angle.sin();
        let lowest = |line: &Loop| line.places.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
        let nearest = self.part.points[self.region].iter().map(|p| self.sheet.parameters(p)[1]);
        line.turns[0] > 0
            && nearest.fold(f64::INFINITY, f64::min) * sin
                < APEX.get() * self.part.spacing[self.region]
            && self.outline.loops.iter().all(|l| lowest(l) >= lowest(line))
    }
}

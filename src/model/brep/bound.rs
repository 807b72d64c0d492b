//! The closed lines around one region: chains of shared edges, and free ones where they leave off.

use super::curve::Curve;
use super::edge::{Chain, Edge, Use, chains, in_chart};
use super::face::{Bound, Face, faces};
use super::free::{Piece, around, between};
use super::outline::{Loop, Outline, outline, twice_area};
use super::part::Part;
use super::sheet::{Sheet, Uv};
use crate::geometry::{Surface, Vec3};

/// Points that tell a region's outline, at most.
const OUTLINED: usize = 60_000;
/// Share of the points that must lie within a region's faces.
const INSIDE: f64 = 0.9;
/// The same where a border is a smooth joint: labels beside it may be off by its resolution.
const INSIDE_SMOOTH: f64 = 0.7;
/// Points that are asked for that.
const ASKED: usize = 400;
/// Holes smaller than this many cells are gaps between points.
const LEAST_HOLE: f64 = 12.0;
/// A chain's end lies within this many cells of the outline.
const NEAR: f64 = 6.0;
/// A cone has its apex where there are points within this many spacings of the axis.
const APEX: f64 = 2.5;
/// Marks vertices and edges of a region's own until they have their place among all.
pub const OWN: usize = 1 << 40;

/// What one region adds: faces, and edges and vertices of their own, counted from [`OWN`] on.
pub struct Bounded {
    /// The faces.
    pub faces: Vec<Face>,
    /// Free edges and their vertices.
    pub own: Vec<(Curve, [usize; 2])>,
    /// Places of free vertices.
    pub vertices: Vec<Vec3>,
    /// Why the region shares no edges, where it does not.
    pub apart: Option<&'static str>,
}

/// A region while its lines are put together.
struct Draft<'a> {
    part: &'a Part,
    edges: &'a [Edge],
    shared: &'a [Vec3],
    region: usize,
    sheet: &'a Sheet,
    outline: &'a Outline,
    own: Vec<(Curve, [usize; 2])>,
    vertices: Vec<Vec3>,
}

/// The faces of a region: with the edges shared with its neighbours where their chains close, else all along its outline.
pub fn bounded(part: &Part, edges: &[Edge], shared: &[Vec3], region: usize) -> Option<Bounded> {
    let sheet = part.sheets[region].as_ref()?;
    let points = &part.points[region];
    let stride = points.len().div_ceil(OUTLINED).max(1);
    let few: Vec<Vec3> = points.iter().step_by(stride).copied().collect();
    let outline = outline(sheet, &few, part.spacing[region] * (stride as f64).sqrt())?;
    let draft = || Draft {
        part,
        edges,
        shared,
        region,
        sheet,
        outline: &outline,
        own: Vec::new(),
        vertices: Vec::new(),
    };
    let chains = chains(part, edges, region, sheet);
    match draft().finish(chains, None) {
        Ok(done) => Some(done),
        Err(why) => draft().finish(Vec::new(), Some(why)).ok(),
    }
}

impl Draft<'_> {
    fn finish(
        mut self,
        chains: Vec<Chain>,
        apart: Option<&'static str>,
    ) -> Result<Bounded, &'static str> {
        let shared: Vec<(Use, [i32; 2])> = chains
            .iter()
            .flat_map(|c| {
                let turns =
                    if c.closed { in_chart(self.edges, &c.uses, self.sheet).1 } else { [0, 0] };
                c.uses.iter().map(move |u| (*u, turns))
            })
            .collect();
        let (closed, open): (Vec<Chain>, Vec<Chain>) = chains.into_iter().partition(|c| c.closed);
        let mut lines: Vec<Vec<Use>> = closed.into_iter().map(|c| c.uses).collect();
        let mut used = vec![false; self.outline.loops.len()];
        lines.extend(self.close(open, &mut used)?);
        for (k, line) in self.outline.loops.iter().enumerate() {
            if !used[k] && self.is_free(line, &shared) {
                let pieces = around(self.sheet, line, self.outline.cell)
                    .ok_or("its outline is not simple")?;
                lines.push(self.add(pieces, None));
            }
        }
        let all = self.all_edges();
        let bound = |uses: Vec<Use>| {
            let (places, turns) = in_chart(&all, &uses, self.sheet);
            Bound { uses, places, turns }
        };
        let bounds: Vec<Bound> = lines
            .into_iter()
            .map(|uses| {
                bound(uses.iter().map(|u| Use { edge: self.local(u.edge), ..*u }).collect())
            })
            .collect();
        let mut faces =
            faces(self.region, self.sheet, bounds).ok_or("its borders do not fit together")?;
        if apart.is_none() {
            self.check(&faces)?;
        }
        let n = self.edges.len();
        for u in faces.iter_mut().flat_map(|f| &mut f.bounds).flat_map(|b| &mut b.uses) {
            if u.edge >= n {
                u.edge = u.edge - n + OWN;
            }
        }
        Ok(Bounded { faces, own: self.own, vertices: self.vertices, apart })
    }

    /// Place of an edge where the region's own follow all others.
    fn local(&self, edge: usize) -> usize {
        if edge >= OWN { edge - OWN + self.edges.len() } else { edge }
    }

    fn all_edges(&self) -> Vec<Edge> {
        let own = self.own.iter().map(|(curve, ends)| Edge {
            span: [0.0, curve.length()],
            curve: curve.clone(),
            ends: *ends,
            regions: vec![self.region],
        });
        self.edges.iter().cloned().chain(own).collect()
    }

    /// Adds free edges one behind the other, between two vertices or closed.
    fn add(&mut self, pieces: Vec<Piece>, ends: Option<[usize; 2]>) -> Vec<Use> {
        let n = pieces.len();
        let mut uses = Vec::new();
        let mut vertex = |x: Vec3| {
            self.vertices.push(x);
            OWN + self.vertices.len() - 1
        };
        let first = ends.map_or_else(|| vertex(pieces[0].ends[0]), |e| e[0]);
        let mut from = first;
        for (k, piece) in pieces.into_iter().enumerate() {
            let to = match (k + 1 == n, ends) {
                (true, Some(e)) => e[1],
                (true, None) => first,
                (false, _) => vertex(piece.ends[1]),
            };
            uses.push(Use { edge: OWN + self.own.len(), forward: true });
            self.own.push((piece.curve, [from, to]));
            from = to;
        }
        uses
    }

    /// Joins open chains by free edges along the outline, from the end of each to the next beginning.
    fn close(
        &mut self,
        open: Vec<Chain>,
        used: &mut [bool],
    ) -> Result<Vec<Vec<Use>>, &'static str> {
        let vertex = |u: &Use, k: usize| self.edges[u.edge].end(u.forward, k);
        let mut ends = Vec::new();
        for chain in &open {
            let (first, last) = (&chain.uses[0], &chain.uses[chain.uses.len() - 1]);
            let places = [vertex(first, 0), vertex(last, 1)];
            let at = |v: usize| self.on_outline(&self.shared[v]).ok_or("its border has a gap");
            ends.push((places, at(places[0])?, at(places[1])?));
        }
        // From each chain's end the way along the outline to the nearest beginning.
        let mut next = vec![None; open.len()];
        for (k, (_, _, end)) in ends.iter().enumerate() {
            let n = self.outline.loops[end.0].places.len();
            let way = |start: &(usize, usize)| (start.1 + n - end.1) % n;
            let nearest =
                (0..open.len()).filter(|&j| ends[j].1.0 == end.0).min_by_key(|&j| way(&ends[j].1));
            next[k] = Some(nearest.ok_or("its border has a gap")?);
        }
        let mut taken = vec![false; open.len()];
        for j in next.iter().flatten() {
            if std::mem::replace(&mut taken[*j], true) {
                return Err("its border has a gap");
            }
        }
        let mut links = Vec::new();
        for (k, (places, _, end)) in ends.iter().enumerate() {
            let j = next[k].unwrap_or(k);
            let start = ends[j].1;
            let line = &self.outline.loops[end.0].places;
            let n = line.len();
            let steps = (start.1 + n - end.1) % n;
            let mut way: Vec<Uv> = Vec::new();
            for s in 0..=steps {
                let c = line[(end.1 + s) % n];
                way.push(way.last().map_or(c, |near| self.sheet.beside(c, near)));
            }
            let vertices = [places[1], ends[j].0[0]];
            used[end.0] = true;
            let pieces = if vertices[0] == vertices[1] {
                Vec::new()
            } else {
                let places = vertices.map(|v| self.shared[v]);
                between(self.sheet, &way, self.outline.cell, places)
                    .ok_or("its outline is not simple")?
            };
            links.push((pieces, vertices));
        }
        let links: Vec<Vec<Use>> = links
            .into_iter()
            .map(
                |(pieces, ends)| {
                    if pieces.is_empty() { Vec::new() } else { self.add(pieces, Some(ends)) }
                },
            )
            .collect();
        let mut seen = vec![false; open.len()];
        let mut lines = Vec::new();
        for first in 0..open.len() {
            let (mut line, mut k) = (Vec::new(), first);
            while !std::mem::replace(&mut seen[k], true) {
                line.extend(&open[k].uses);
                line.extend(&links[k]);
                k = next[k].unwrap_or(k);
            }
            if !line.is_empty() {
                lines.push(line);
            }
        }
        Ok(lines)
    }

    /// The loop of the outline and the place on it nearest to a vertex.
    fn on_outline(&self, x: &Vec3) -> Option<(usize, usize)> {
        let c = self.sheet.chart(x);
        let [a, b] = self.outline.cell;
        let mut best = (f64::INFINITY, (0, 0));
        for (l, line) in self.outline.loops.iter().enumerate() {
            for (k, p) in line.places.iter().enumerate() {
                let q = self.sheet.beside(c, p);
                let off = ((q[0] - p[0]) / a).hypot((q[1] - p[1]) / b);
                if off < best.0 {
                    best = (off, (l, k));
                }
            }
        }
        let cell = a.max(b);
        let smooth = self
            .part
            .smooth
            .iter()
            .filter(|(pair, _)| pair.contains(&self.region))
            .map(|(_, r)| *r);
        let reach = NEAR + smooth.fold(0.0, f64::max) / cell;
        (best.0 <= reach).then_some(best.1)
    }

    /// Whether a loop of the outline is one on which no shared edge lies, and not just a gap between points.
    fn is_free(&self, line: &Loop, shared: &[(Use, [i32; 2])]) -> bool {
        let [a, b] = self.outline.cell;
        let area = twice_area(&line.places) / 2.0;
        if line.turns == [0, 0] {
            if area < 0.0 && -area < LEAST_HOLE * a * b {
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
        let most = 4.0 * self.outline.cell[0];
        line.places.iter().all(|c| (self.sheet.at(*c) - far).norm() < most)
    }

    /// Whether a line around a cone's axis is the one next to an apex up to which there are points.
    fn is_apex(&self, line: &Loop) -> bool {
        let Surface::Cone(s) = &self.sheet.surface else { return false };
        let sin = s.half_angle.sin();
        let lowest = |line: &Loop| line.places.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
        let nearest = self.part.points[self.region].iter().map(|p| self.sheet.parameters(p)[1]);
        line.turns[0] > 0
            && nearest.fold(f64::INFINITY, f64::min) * sin < APEX * self.part.spacing[self.region]
            && self.outline.loops.iter().all(|l| lowest(l) >= lowest(line))
    }

    /// Whether the region's points lie within its faces, and these hold no more than its points cover.
    fn check(&self, faces: &[Face]) -> Result<(), &'static str> {
        let points = &self.part.points[self.region];
        let stride = points.len().div_ceil(ASKED).max(1);
        let (mut inside, mut all) = (0usize, 0usize);
        for p in points.iter().step_by(stride) {
            let c = self.sheet.chart(p);
            all += 1;
            inside += usize::from(faces.iter().any(|f| f.holds(self.sheet, &c)));
        }
        let smooth = self.part.smooth.keys().any(|pair| pair.contains(&self.region));
        let share = if smooth { INSIDE_SMOOTH } else { INSIDE };
        if (inside as f64) < share * all as f64 {
            return Err("its points do not lie within its borders");
        }
        Ok(())
    }
}

//! Chains of shared edges that do not close by themselves: free edges along the outline join them.

use super::bound::Draft;
use super::chain::Chain;
use super::edge::Use;
use super::free::between;
use super::sheet::Uv;
use crate::fit::constant::constants;
use crate::geometry::Vec3;

constants! {
    /// A chain's end lies within this many cells of the outline.
    NEAR: f64 = 6.0, Trial(6.0, 6.0);
}

/// Why chains do not close.
const GAP: &str = "its border has a gap";

/// A loop of the outline, and a place on it.
type Spot = (usize, usize);

/// An open chain's first and last vertices, and where they are on the outline.
struct Ends {
    vertices: [usize; 2],
    spots: [Spot; 2],
}

impl Draft<'_> {
    /// Joins open chains by free edges along the outline, from the end of each to the next beginning; marks the loops that it
    /// follows as `used`.
    pub fn close(
        &mut self,
        open: &[Chain],
        used: &mut [bool],
    ) -> Result<Vec<Vec<Use>>, &'static str> {
        let ends: Vec<Ends> =
            open.iter().map(|c| self.ends(c)).collect::<Option<_>>().ok_or(GAP)?;
        let next = self.next(&ends).ok_or(GAP)?;
        let mut links = Vec::new();
        for (k, &j) in next.iter().enumerate() {
            let (from, to) = (ends[k].spots[1], ends[j].spots[0]);
            used[from.0] = true;
            links.push(self.link([ends[k].vertices[1], ends[j].vertices[0]], from, to)?);
        }
        let mut seen = vec![false; open.len()];
        let mut lines = Vec::new();
        for first in 0..open.len() {
            let (mut line, mut k) = (Vec::new(), first);
            while !std::mem::replace(&mut seen[k], true) {
                line.extend(&open[k].uses);
                line.extend(&links[k]);
                k = next[k];
            }
            if !line.is_empty() {
                lines.push(line);
            }
        }
        Ok(lines)
    }

    fn ends(&self, chain: &Chain) -> Option<Ends> {
        let end = |u: &Use, k: usize| self.edges[u.edge].end(u.forward, k);
        let vertices = [end(chain.uses.first()?, 0), end(chain.uses.last()?, 1)];
        let [a, b] = vertices.map(|v| self.on_outline(&self.shared[v]));
        Some(Ends { vertices, spots: [a?, b?] })
    }

    /// For each chain the one whose beginning comes first on the way along the outline; none where two share one.
    fn next(&self, ends: &[Ends]) -> Option<Vec<usize>> {
        let mut taken = vec![false; ends.len()];
        let mut next = Vec::new();
        for own in ends {
            let (line, from) = own.spots[1];
            let n = self.outline.loops[line].places.len();
            let way = |j: &usize| (ends[*j].spots[0].1 + n - from) % n;
            let j = (0..ends.len()).filter(|&j| ends[j].spots[0].0 == line).min_by_key(way)?;
            if std::mem::replace(&mut taken[j], true) {
                return None;
            }
            next.push(j);
        }
        Some(next)
    }

    /// The free edges from one vertex to another along the outline.
    fn link(
        &mut self,
        vertices: [usize; 2],
        from: Spot,
        to: Spot,
    ) -> Result<Vec<Use>, &'static str> {
        if vertices[0] == vertices[1] {
            return Ok(Vec::new());
        }
        let line = &self.outline.loops[from.0].places;
        let n = line.len();
        let mut way: Vec<Uv> = Vec::new();
        for s in 0..=(to.1 + n - from.1) % n {
            let c = line[(from.1 + s) % n];
            way.push(way.last().map_or(c, |near| self.sheet.beside(c, near)));
        }
        let places = vertices.map(|v| self.shared[v]);
        let pieces = between(self.sheet, &way, self.outline.cell, places)
            .ok_or("its outline is not simple")?;
        Ok(self.add(pieces, Some(vertices)))
    }

    /// The loop of the outline and the place on it nearest to a vertex.
    fn on_outline(&self, x: &Vec3) -> Option<Spot> {
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
        let reach = NEAR.get() + smooth.fold(0.0, f64::max) / cell;
        (best.0 <= reach).then_some(best.1)
    }
}

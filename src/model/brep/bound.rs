//! The closed lines around one region: chains of shared edges, and free ones where they leave off.

use super::chain::{Chain, chains, in_chart};
use super::curve::Curve;
use super::edge::{Edge, Edges, OWN, Use};
use super::face::{Bound, Face, faces};
use super::free::{Piece, around};
use super::measure::measure;
use super::outline::{Outline, outline};
use super::part::Part;
use super::sheet::Sheet;
use crate::fit::constant::constants;
use crate::geometry::{Surface, Vec3};

constants! {
    /// Points that tell a region's outline, at most.
    OUTLINED: usize = 60_000, Effort("work of the boundary representation");
    /// Share of the points that must lie within a region's faces.
    INSIDE: f64 = 0.9, Trial(0.9, 0.9);
    /// The same where a border is a smooth joint: labels beside it may be off by its resolution.
    INSIDE_SMOOTH: f64 = 0.7, Trial(0.7, 0.7);
    /// Points that are asked for that.
    ASKED: usize = 400, Effort("work of the boundary representation");
    /// Share by which the area of a region's faces may differ from that of its cells, beside half a cell along its border.
    LIKE: f64 = 0.3, Trial(0.3, 0.3);
}

/// What one region adds: faces, and edges and vertices of their own, counted from [`OWN`] on.
pub struct Bounded {
    /// The faces.
    pub faces: Vec<Face>,
    /// Free edges.
    pub own: Vec<Edge>,
    /// Places of free vertices.
    pub vertices: Vec<Vec3>,
    /// Why the region shares no edges, where it does not.
    pub apart: Option<&'static str>,
}

/// A region while its lines are put together.
pub struct Draft<'a> {
    /// The part.
    pub part: &'a Part,
    /// Edges that regions share.
    pub edges: &'a [Edge],
    /// Places of their vertices.
    pub shared: &'a [Vec3],
    /// The region.
    pub region: usize,
    /// Its surface.
    pub sheet: &'a Sheet,
    /// The lines around its points.
    pub outline: &'a Outline,
    own: Vec<Edge>,
    vertices: Vec<Vec3>,
}

/// The faces of a region: with the edges shared with its neighbours where their chains close, else all along its outline.
pub fn bounded(part: &Part, edges: &[Edge], shared: &[Vec3], region: usize) -> Option<Bounded> {
    let sheet = part.sheets[region].as_ref()?;
    let points = &part.points[region];
    let stride = points.len().div_ceil(OUTLINED.get()).max(1);
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
    match draft().finish(&chains, None) {
        Ok(done) => Some(done),
        Err(why) => draft().finish(&[], Some(why)).ok(),
    }
}

impl Draft<'_> {
    fn finish(
        mut self,
        chains: &[Chain],
        apart: Option<&'static str>,
    ) -> Result<Bounded, &'static str> {
        let mut shared: Vec<(Use, [i32; 2])> = Vec::new();
        for chain in chains {
            let turns = match chain.closed {
                true => in_chart(&Edges::all(self.edges), &chain.uses, self.sheet).1,
                false => [0, 0],
            };
            shared.extend(chain.uses.iter().map(|u| (*u, turns)));
        }
        let (closed, open): (Vec<Chain>, Vec<Chain>) =
            chains.iter().cloned().partition(|c| c.closed);
        let mut lines: Vec<Vec<Use>> = closed.into_iter().map(|c| c.uses).collect();
        let mut used = vec![false; self.outline.loops.len()];
        lines.extend(self.close(&open, &mut used)?);
        for (k, line) in self.outline.loops.iter().enumerate() {
            if !used[k] && self.is_free(line, &shared) {
                let pieces = around(self.sheet, line, self.outline.cell)
                    .ok_or("its outline is not simple")?;
                lines.push(self.add(pieces, None));
            }
        }
        let bound = |uses: Vec<Use>| {
            let (places, turns) = in_chart(&self.all(), &uses, self.sheet);
            Bound { uses, places, turns }
        };
        let bounds: Vec<Bound> = lines.into_iter().map(bound).collect();
        let faces =
            faces(self.region, self.sheet, bounds).ok_or("its borders do not fit together")?;
        let faces = self.halved(faces);
        if apart.is_none() {
            self.check_points(&faces)?;
        }
        self.check_area(&faces, apart.is_none())?;
        Ok(Bounded { faces, own: self.own, vertices: self.vertices, apart })
    }

    /// A whole ellipsoid in two halves: no spline goes all round it without a pole.
    fn halved(&mut self, faces: Vec<Face>) -> Vec<Face> {
        let Surface::Ellipsoid(_) = &self.sheet.surface else { return faces };
        let Some(curve) = faces[0].bounds.is_empty().then(|| equator(self.sheet)).flatten() else {
            return faces;
        };
        let start = curve.points[0];
        let line = self.add(vec![Piece { curve, ends: [start; 2] }], None);
        let half = |forward: bool| {
            let uses: Vec<Use> = line.iter().map(|u| Use { forward, ..*u }).collect();
            let (places, turns) = in_chart(&self.all(), &uses, self.sheet);
            let bound = Bound { uses, places, turns };
            let has_outer = bound.is_outer();
            Face { region: self.region, bounds: vec![bound], has_outer, flipped: false }
        };
        vec![half(true), half(false)]
    }

    fn all(&self) -> Edges<'_> {
        Edges { shared: self.edges, own: &self.own }
    }

    /// Adds free edges one behind the other, between two vertices or closed.
    pub fn add(&mut self, pieces: Vec<Piece>, ends: Option<[usize; 2]>) -> Vec<Use> {
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
            let span = [0.0, piece.curve.length()];
            self.own.push(Edge {
                curve: piece.curve,
                span,
                ends: [from, to],
                regions: vec![self.region],
            });
            from = to;
        }
        uses
    }

    /// Whether the region's points lie within its faces.
    fn check_points(&self, faces: &[Face]) -> Result<(), &'static str> {
        let points = &self.part.points[self.region];
        let stride = points.len().div_ceil(ASKED.get()).max(1);
        let (mut inside, mut all) = (0usize, 0usize);
        for p in points.iter().step_by(stride) {
            let c = self.sheet.chart(p);
            all += 1;
            inside += usize::from(faces.iter().any(|f| f.holds(self.sheet, &c)));
        }
        let smooth = self.part.smooth.keys().any(|pair| pair.contains(&self.region));
        let share = if smooth { INSIDE_SMOOTH.get() } else { INSIDE.get() };
        if (inside as f64) < share * all as f64 {
            return Err("its points do not lie within its borders");
        }
        Ok(())
    }

    /// Whether each face has an area, and all together about as much as there are points, where that is asked for.
    fn check_area(&self, faces: &[Face], like: bool) -> Result<(), &'static str> {
        let areas = faces.iter().map(|f| measure(self.sheet, &self.all(), f).area);
        let mut sum = 0.0;
        for area in areas {
            if area.is_nan() || area <= 0.0 {
                return Err("its borders enclose no area");
            }
            sum += area;
        }
        let [a, b] = self.outline.cell;
        let length: usize = self.outline.loops.iter().map(|l| l.places.len()).sum();
        let most = LIKE.get() * self.outline.area + 0.5 * length as f64 * a * b;
        if like && (sum - self.outline.area).abs() > most {
            return Err("its area is not that of its points");
        }
        Ok(())
    }
}

/// The ellipse around an ellipsoid halfway between the middle of its chart and the far end.
fn equator(sheet: &Sheet) -> Option<Curve> {
    let start = sheet.at([2f64.sqrt() * sheet.scale[0], 0.0]);
    let other = sheet.at([0.0, 2f64.sqrt() * sheet.scale[1]]);
    let normal = (start - sheet.origin).cross(&(other - sheet.origin)).normalize();
    let across = Sheet::plane(sheet.origin, normal);
    let most = sheet.radius() / 4.0;
    Curve::through(sheet, &across, start, most, |_| true).filter(|c| c.closed)
}

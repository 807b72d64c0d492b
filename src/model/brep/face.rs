//! Which closed lines of a region bound one face together.

use super::sheet::{Sheet, Uv};
use crate::geometry::Surface;

use super::edge::Use;
use super::outline::twice_area;

/// A closed line of edges, the face on its left.
#[derive(Clone, Debug)]
pub struct Bound {
    /// Its edges in order.
    pub uses: Vec<Use>,
    /// Its places in the chart, unrolled.
    pub places: Vec<Uv>,
    /// How often it goes around each parameter.
    pub turns: [i32; 2],
}

/// A piece of a region's surface.
#[derive(Clone, Debug)]
pub struct Face {
    /// The region.
    pub region: usize,
    /// The lines around it; the first is the outer one where one is.
    pub bounds: Vec<Bound>,
    /// Whether the first line is around all others.
    pub has_outer: bool,
    /// Whether the material is on the side of the surface's normal.
    pub flipped: bool,
}

impl Bound {
    fn winds(&self) -> bool {
        self.turns != [0, 0]
    }

    /// Whether it closes in the chart, counter-clockwise.
    pub fn is_outer(&self) -> bool {
        !self.winds() && twice_area(&self.places) > 0.0
    }

    /// Whether it goes around a place, in any round of the chart.
    fn is_around(&self, sheet: &Sheet, c: &Uv) -> bool {
        let rounds = |k: usize| if sheet.angular()[k] { -2..=2 } else { 0..=0 };
        let period = |k: usize| std::f64::consts::TAU * sheet.scale[k];
        rounds(0).any(|i| {
            rounds(1).any(|j| {
                is_within(
                    &self.places,
                    &[c[0] + f64::from(i) * period(0), c[1] + f64::from(j) * period(1)],
                )
            })
        })
    }

    /// The mean of a parameter.
    fn mean(&self, k: usize) -> f64 {
        self.places.iter().map(|p| p[k]).sum::<f64>() / self.places.len().max(1) as f64
    }

    /// Of a line around parameter `k`: how far the other parameter of a place is above the line there.
    fn above(&self, sheet: &Sheet, k: usize, c: &Uv) -> f64 {
        let period = std::f64::consts::TAU * sheet.scale[k];
        let apart = |p: &Uv| {
            let d = (p[k] - c[k]).rem_euclid(period);
            d.min(period - d)
        };
        let nearest = self.places.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        nearest.map_or(0.0, |p| c[1 - k] - p[1 - k])
    }
}

/// Whether a polygon goes around a place.
pub fn is_within(polygon: &[Uv], c: &Uv) -> bool {
    let next = polygon.iter().cycle().skip(1);
    let crosses = |(a, b): &(&Uv, &Uv)| {
        (a[1] > c[1]) != (b[1] > c[1])
            && c[0] < a[0] + (c[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    };
    polygon.iter().zip(next).filter(crosses).count() % 2 == 1
}

/// The faces that a region's lines bound; none where they do not fit together.
pub fn faces(region: usize, sheet: &Sheet, bounds: Vec<Bound>) -> Option<Vec<Face>> {
    let whole = matches!(sheet.surface, Surface::Sphere(_) | Surface::Ellipsoid(_));
    let face =
        |bounds: Vec<Bound>, has_outer: bool| Face { region, bounds, has_outer, flipped: false };
    let (winding, others): (Vec<Bound>, Vec<Bound>) = bounds.into_iter().partition(Bound::winds);
    let (outer, holes): (Vec<Bound>, Vec<Bound>) = others.into_iter().partition(Bound::is_outer);
    let mut out: Vec<Face> = bands(sheet, winding)?.into_iter().map(|b| face(b, false)).collect();
    let banded = out.len();
    out.extend(outer.into_iter().map(|b| face(vec![b], true)));
    for hole in holes {
        let c = hole.places[0];
        let size = |f: &Face| twice_area(&f.bounds[0].places);
        let around = |f: &&mut Face| f.bounds[0].is_around(sheet, &c);
        let smallest =
            out[banded..].iter_mut().filter(around).min_by(|a, b| size(a).total_cmp(&size(b)));
        match smallest {
            Some(f) => f.bounds.push(hole),
            None => {
                let Some(f) = out[..banded].iter_mut().find(|f| f.holds(sheet, &c)) else {
                    if whole && (out.is_empty() || !out[0].has_outer) {
                        if out.is_empty() {
                            out.push(face(Vec::new(), false));
                        }
                        out[0].bounds.push(hole);
                        continue;
                    }
                    return None;
                };
                f.bounds.push(hole);
            }
        }
    }
    if out.is_empty() && (whole || sheet.wraps == [true, true]) {
        out.push(face(Vec::new(), false));
    }
    (!out.is_empty()).then_some(out)
}

/// Lines around an axis in pairs: one with the face above it, the next one with the face below. A cone's may end at its apex,
/// a torus' go on over the chart's end.
fn bands(sheet: &Sheet, mut lines: Vec<Bound>) -> Option<Vec<Vec<Bound>>> {
    if lines.is_empty() {
        return Some(Vec::new());
    }
    let k = usize::from(lines[0].turns[0] == 0);
    if lines.iter().any(|l| l.turns[1 - k] != 0 || l.turns[k].abs() != 1) {
        return None;
    }
    // Left of a line that goes up in u is larger v; left of one that goes up in v is smaller u.
    let is_lower = |l: &Bound| (l.turns[k] > 0) == (k == 0);
    lines.sort_by(|a, b| a.mean(1 - k).total_cmp(&b.mean(1 - k)));
    let cyclic = sheet.angular()[1 - k];
    if cyclic && !is_lower(&lines[0]) {
        lines.rotate_left(1);
    }
    let mut out = Vec::new();
    let mut lines = lines.into_iter().peekable();
    while let Some(first) = lines.next() {
        if !is_lower(&first) {
            // Only a cone goes on to its apex.
            if out.is_empty() && matches!(sheet.surface, Surface::Cone(_)) {
                out.push(vec![first]);
                continue;
            }
            return None;
        }
        let second = lines.next().filter(|l| !is_lower(l))?;
        out.push(vec![first, second]);
    }
    Some(out)
}

impl Face {
    /// Whether a place of the chart lies in it.
    pub fn holds(&self, sheet: &Sheet, c: &Uv) -> bool {
        let mut inside = true;
        for b in &self.bounds {
            if b.winds() {
                let k = usize::from(b.turns[0] == 0);
                let lower = (b.turns[k] > 0) == (k == 0);
                // On a torus both sides of a line are above it.
                if !sheet.angular()[1 - k] {
                    inside &= (b.above(sheet, k, c) >= 0.0) == lower;
                }
            } else {
                inside &= b.is_around(sheet, c) == b.is_outer();
            }
        }
        if let [a, b] = &self.bounds[..] {
            let k = usize::from(a.turns[0] == 0);
            if a.winds() && b.winds() && sheet.angular()[1 - k] {
                let period = std::f64::consts::TAU * sheet.scale[1 - k];
                let height = (b.mean(1 - k) - a.mean(1 - k)).rem_euclid(period);
                inside &= a.above(sheet, k, c).rem_euclid(period) <= height;
            }
        }
        inside
    }
}

//! Borders with nothing beyond: they follow the outline of the points along the surface's own curves.

use super::curve::{Curve, meet};
use super::outline::Loop;
use super::sheet::{Sheet, Uv};
use crate::fit::constant::constants;
use crate::geometry::{Surface, Vec3};

constants! {
    /// How far a border may leave the outline, in cells: the outline's own scatter.
    SIMPLER: f64 = 1.0, Trial(1.0, 1.0);
    /// A side is along a parameter where the other changes by no more than this share of it.
    ALONG: f64 = 0.2, Trial(0.2, 0.2);
    /// An edge's greatest turn about an axis, in radians: its plane is chosen by its middle.
    MOST_TURN: f64 = 1.0, Trial(1.0, 1.0);
    /// A line around the axis lies at one height where the outline scatters by no more than this many cells.
    LEVEL: f64 = 4.0, Trial(4.0, 4.0);
}

/// One free edge: its curve, from its first point to its last.
pub struct Piece {
    /// The curve.
    pub curve: Curve,
    /// Its first and last places; the same for a closed one.
    pub ends: [Vec3; 2],
}

/// The free edges along a part of an outline from one fixed place to another.
pub fn between(sheet: &Sheet, outline: &[Uv], cell: Uv, ends: [Vec3; 2]) -> Option<Vec<Piece>> {
    let first = outline.first().copied().unwrap_or_else(|| sheet.chart(&ends[0]));
    let from = sheet.beside(sheet.chart(&ends[0]), &first);
    let last = outline.last().copied().unwrap_or(from);
    let to = sheet.beside(sheet.chart(&ends[1]), &last);
    let far = |p: &Uv, q: &Uv| ((p[0] - q[0]) / cell[0]).hypot((p[1] - q[1]) / cell[1]);
    let mut line = vec![from];
    // Next to the ends the outline is rounded.
    line.extend(outline.iter().filter(|p| far(p, &from) > 1.5 && far(p, &to) > 1.5));
    line.push(to);
    let kept = simplified(&line, cell);
    let corners = straightened(sheet, &line, &kept, cell, true);
    pieces(sheet, &corners, Some(ends))
}

/// The free edges along a whole outline.
pub fn around(sheet: &Sheet, line: &Loop, cell: Uv) -> Option<Vec<Piece>> {
    if line.turns != [0, 0] {
        return level(sheet, line, cell).map(|p| vec![p]).or_else(|| winding(sheet, line, cell));
    }
    let n = line.places.len();
    if n < 3 {
        return None;
    }
    // From the corner furthest out on, so that it is a corner.
    let middle: Uv =
        std::array::from_fn(|k| line.places.iter().map(|p| p[k]).sum::<f64>() / n as f64);
    let out = |p: &Uv| (p[0] - middle[0]).hypot(p[1] - middle[1]);
    let start = (0..n).max_by(|&a, &b| out(&line.places[a]).total_cmp(&out(&line.places[b])))?;
    let closed: Vec<Uv> = (0..=n).map(|k| line.places[(start + k) % n]).collect();
    let mut kept = simplified(&closed, cell);
    if kept.len() < 4 {
        kept = (0..=4).map(|k| k * n / 4).collect();
    }
    let corners = straightened(sheet, &closed, &kept, cell, false);
    pieces(sheet, &corners, None)
}

/// A closed curve at one height around the axis, or around a tube.
fn level(sheet: &Sheet, line: &Loop, cell: Uv) -> Option<Piece> {
    let k = if line.turns[0] != 0 { 0 } else { 1 };
    if line.turns[1 - k] != 0 || line.turns[k].abs() != 1 {
        return None;
    }
    let heights = || line.places.iter().map(|p| p[1 - k]);
    let (low, high) =
        heights().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), h| (a.min(h), b.max(h)));
    if high - low > LEVEL.get() * cell[1 - k] {
        return None;
    }
    let mean = heights().sum::<f64>() / line.places.len() as f64;
    let mut c = line.places[0];
    c[1 - k] = mean;
    let start = sheet.at(c);
    let across = own_plane(sheet, k, &start)?;
    let sign = f64::from(line.turns[k]);
    let mut ahead = c;
    ahead[k] += sign * 1e-3 * sheet.scale[k];
    let toward = sheet.at(ahead) - start;
    closed_curve(sheet, &across, start, toward).map(|curve| Piece { curve, ends: [start; 2] })
}

fn closed_curve(f: &Sheet, g: &Sheet, start: Vec3, toward: Vec3) -> Option<Curve> {
    let start = meet(f, g, &start)?;
    let most = f.radius().min(1e6) * 0.2;
    let curve = Curve::through(f, g, start, most, |_| true).filter(|c| c.closed)?;
    // Its first points go the way that is asked for.
    let along = curve.points.get(1)? - curve.points[0];
    if along.dot(&toward) >= 0.0 {
        return Some(curve);
    }
    let mut points = curve.points.clone();
    points[1..].reverse();
    Some(Curve::of(curve.sheets, points, true))
}

/// The plane that cuts a surface along the curve of its parameter `k` through a place; none for balls and planes.
fn own_plane(sheet: &Sheet, k: usize, x: &Vec3) -> Option<Sheet> {
    let w = sheet.frame.column(2).into_owned();
    match (&sheet.surface, k) {
        (Surface::Plane(_) | Surface::Sphere(_) | Surface::Ellipsoid(_), _) => None,
        (_, 0) => Some(Sheet::plane(*x, w)),
        _ => {
            let out = x - sheet.origin;
            Some(Sheet::plane(sheet.origin, w.cross(&out).try_normalize(1e-9)?))
        }
    }
}

/// A line around the axis that is not level: corners all the way round.
fn winding(sheet: &Sheet, line: &Loop, cell: Uv) -> Option<Vec<Piece>> {
    let first = *line.places.first()?;
    let mut closed = line.places.clone();
    let over: Uv = std::array::from_fn(|k| {
        first[k] + f64::from(line.turns[k]) * std::f64::consts::TAU * sheet.scale[k]
    });
    closed.push(over);
    let kept = simplified(&closed, cell);
    let corners: Vec<Uv> = kept.into_iter().map(|k| closed[k]).collect();
    pieces(sheet, &corners, None)
}

/// The places of an open line that a polygon within `SIMPLER.get()` cells of it needs (Douglas and Peucker 1973).
fn simplified(line: &[Uv], cell: Uv) -> Vec<usize> {
    let p = |k: usize| [line[k][0] / cell[0], line[k][1] / cell[1]];
    let mut kept = vec![false; line.len()];
    let last = line.len() - 1;
    (kept[0], kept[last]) = (true, true);
    let mut spans = vec![(0, last)];
    while let Some((from, to)) = spans.pop() {
        let (a, b) = (p(from), p(to));
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = dx.hypot(dy);
        let off = |k: usize| {
            let q = p(k);
            let (x, y) = (q[0] - a[0], q[1] - a[1]);
            if length > 1e-9 { (x * dy - y * dx).abs() / length } else { x.hypot(y) }
        };
        let worst = (from + 1..to).max_by(|&i, &j| off(i).total_cmp(&off(j)));
        if let Some(w) = worst.filter(|&w| off(w) > SIMPLER.get()) {
            kept[w] = true;
            spans.extend([(from, w), (w, to)]);
        }
    }
    (0..line.len()).filter(|&k| kept[k]).collect()
}

/// The corners of a simplified line; sides along a parameter of a surface with an axis are put on one value of the other.
/// The first and last place are kept where they are `fixed`; else they are the same corner.
fn straightened(sheet: &Sheet, line: &[Uv], kept: &[usize], cell: Uv, fixed: bool) -> Vec<Uv> {
    let mut corners: Vec<Uv> = kept.iter().map(|&k| line[k]).collect();
    if !sheet.angular()[0] {
        return corners;
    }
    let n = corners.len() - 1;
    // The parameter that a side keeps, and its value.
    let side = |s: usize| -> Option<(usize, f64)> {
        let (a, b) = (line[kept[s]], line[kept[s + 1]]);
        let (du, dv) = ((b[0] - a[0]).abs() / cell[0], (b[1] - a[1]).abs() / cell[1]);
        let k = if dv <= ALONG.get() * du {
            1
        } else if du <= ALONG.get() * dv {
            0
        } else {
            return None;
        };
        let inner = &line[kept[s]..=kept[s + 1]];
        // Without what is rounded at its ends.
        let from = inner.len() / 6;
        let inner = &inner[from..inner.len() - from];
        Some((k, inner.iter().map(|p| p[k]).sum::<f64>() / inner.len() as f64))
    };
    let sides: Vec<Option<(usize, f64)>> = (0..n).map(side).collect();
    for c in 0..=n {
        if fixed && (c == 0 || c == n) {
            continue;
        }
        let before = if c > 0 { sides[c - 1] } else { sides[n - 1] };
        let after = if c < n { sides[c] } else { sides[0] };
        for (k, value) in before.into_iter().chain(after) {
            corners[c][k] = value;
        }
    }
    if fixed {
        // A side from a fixed end goes on at that end's value.
        if let Some((k, _)) = sides[0].filter(|_| n > 1) {
            corners[1][k] = corners[0][k];
        }
        if let Some((k, _)) = sides[n - 1].filter(|_| n > 1) {
            corners[n - 1][k] = corners[n][k];
        }
    }
    corners
}

/// The edges through corners in a chart; the first and last place are `ends` where these are given, else they are one.
fn pieces(sheet: &Sheet, corners: &[Uv], ends: Option<[Vec3; 2]>) -> Option<Vec<Piece>> {
    let mut stops: Vec<Uv> = Vec::new();
    for pair in corners.windows(2) {
        let turn = (0..2)
            .filter(|&k| sheet.angular()[k])
            .map(|k| ((pair[1][k] - pair[0][k]) / sheet.scale[k]).abs());
        let length = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
        if length < 1e-9 {
            continue;
        }
        let round = match &sheet.surface {
            Surface::Sphere(_) | Surface::Ellipsoid(_) => length / sheet.scale[0],
            _ => turn.fold(0.0, f64::max),
        };
        let parts = (round / MOST_TURN.get()).ceil().max(1.0) as usize;
        for k in 0..parts {
            let t = k as f64 / parts as f64;
            stops.push([
                pair[0][0] + t * (pair[1][0] - pair[0][0]),
                pair[0][1] + t * (pair[1][1] - pair[0][1]),
            ]);
        }
    }
    stops.push(*corners.last()?);
    let mut places: Vec<Vec3> = stops.iter().map(|c| sheet.at(*c)).collect();
    let n = places.len() - 1;
    match ends {
        Some([a, b]) => (places[0], places[n]) = (sheet.foot(&a), sheet.foot(&b)),
        None => places[n] = places[0],
    }
    let mut out = Vec::new();
    for k in 0..n {
        let level = (0..2)
            .find(|&j| sheet.angular()[j] && (stops[k][1 - j] - stops[k + 1][1 - j]).abs() < 1e-9);
        out.push(section(sheet, [places[k], places[k + 1]], level)?);
    }
    (!out.is_empty()).then_some(out)
}

/// The edge between two places in the plane through them and the normal between them; in the surface's own plane where both
/// lie `level`.
fn section(sheet: &Sheet, ends: [Vec3; 2], level: Option<usize>) -> Option<Piece> {
    let chord = ends[1] - ends[0];
    let across = match level.and_then(|k| own_plane(sheet, k, &ends[0])) {
        Some(plane) if plane.value(&ends[1]).abs() < 1e-9 * chord.norm().max(1.0) => plane,
        _ => {
            let middle = sheet.foot(&((ends[0] + ends[1]) / 2.0));
            Sheet::plane(ends[0], chord.cross(&sheet.normal(&middle)).try_normalize(1e-300)?)
        }
    };
    let parts = match &sheet.surface {
        Surface::Plane(_) => 1,
        _ => 24,
    };
    let points: Option<Vec<Vec3>> = (0..=parts)
        .map(|k| meet(sheet, &across, &(ends[0] + chord * (f64::from(k) / f64::from(parts)))))
        .collect();
    let points = points?;
    // Steps forth only: else the surface turns more than a plane can follow.
    points
        .windows(2)
        .all(|p| (p[1] - p[0]).dot(&chord) > 0.0)
        .then(|| Piece { curve: Curve::of([*sheet, across], points, false), ends })
}

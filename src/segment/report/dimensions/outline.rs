//! The polygons around the points of a plane.

use crate::fit::constant::constants;
use crate::segment::report::dimensions::contour::contours;

constants! {
    /// Side of a cell in spacings of the points: about five points fall into one.
    CELL: f64 = 2.0, Derived("the fourth neighbour stands at the radius of a disc with four points: a cell holds five");
    /// Cells are doubled this often at most, until points in rows fill them.
    DOUBLINGS: usize = 4, Derived("rows up to 32 spacings apart");
    /// Share of the cells with points that have points on three sides or more, where cells are large enough.
    FILLED: f64 = 0.7, Trial(0.7, 0.7);
    /// Cells along the longer side, at most.
    MOST_CELLS: f64 = 400.0, Effort("cells along a plane");
    /// The same, at least, before they are doubled.
    FEWEST_CELLS: f64 = 8.0, Trial(8.0, 8.0);
    /// Loops of less than this many cells are noise.
    LEAST_CELLS: f64 = 4.0, Trial(4.0, 4.0);
    /// How far the polygon may leave the contour, in cells: the largest of its own scatter, three times a third.
    SIMPLER: f64 = 1.0, Trial(1.0, 1.0);
}

/// A place in the plane.
pub type Uv = [f64; 2];

/// The polygons around points of a plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// Closed loops, the outer ones counter-clockwise and holes clockwise, the largest first.
    pub loops: Vec<Vec<Uv>>,
    /// The area they enclose.
    pub area: f64,
    /// The sides of the smallest rectangle around them, the longer first.
    pub size: [f64; 2],
    /// The unit direction of the longer side.
    pub along: Uv,
}

/// The outline of points that lie `spacing` apart; none where they are too few to have one.
///
/// Points are counted in square cells; the edge is where their blurred number falls to half of that inside, by marching
/// squares, which is right on straight edges and rounds corners by half a cell.
pub fn outline(points: &[Uv], spacing: f64) -> Option<Outline> {
    let low = |k: usize| points.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min);
    let high = |k: usize| points.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
    let (low, high) = ([low(0), low(1)], [high(0), high(1)]);
    let extent = (high[0] - low[0]).max(high[1] - low[1]);
    let mut cell = (CELL.get() * spacing).max(extent / MOST_CELLS.get());
    if !(cell > 0.0 && extent.is_finite()) {
        return None;
    }
    let mut grid = Grid::of(points, low, high, cell);
    for _ in 0..DOUBLINGS.get() {
        if grid.is_filled() || cell > extent / FEWEST_CELLS.get() {
            break;
        }
        cell *= 2.0;
        grid = Grid::of(points, low, high, cell);
    }
    let mut loops = contours(&grid.blurred()?, grid.width);
    loops.retain(|l| area(l).abs() > LEAST_CELLS.get());
    loops.sort_by(|a, b| area(b).abs().total_cmp(&area(a).abs()));
    let place = |p: &Uv| [grid.low[0] + p[0] * cell, grid.low[1] + p[1] * cell];
    let hull = hull(loops.iter().flatten().map(place).collect());
    let (along, across) = rectangle(&hull)?;
    let size = [along, across].map(|d| reach(points, &hull, d));
    Some(Outline {
        area: loops.iter().map(|l| area(l)).sum::<f64>() * cell * cell,
        loops: loops
            .iter()
            .map(|l| simplified(l, SIMPLER.get()).iter().map(place).collect())
            .collect(),
        size,
        along,
    })
}

/// Points counted in square cells, with two empty ones all round.
struct Grid {
    counts: Vec<usize>,
    width: usize,
    /// The middle of the first cell.
    low: Uv,
}

impl Grid {
    fn of(points: &[Uv], low: Uv, high: Uv, cell: f64) -> Self {
        let cells = |k: usize| ((high[k] - low[k]) / cell) as usize + 5;
        let (width, height) = (cells(0), cells(1));
        let mut counts = vec![0; width * height];
        for p in points {
            let at = |k: usize| ((p[k] - low[k]) / cell) as usize + 2;
            counts[at(1) * width + at(0)] += 1;
        }
        Self { counts, width, low: low.map(|x| x - 1.5 * cell) }
    }

    /// The cells with points, all of which have neighbours on every side.
    fn occupied(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.counts.len()).filter(|&i| self.counts[i] > 0)
    }

    fn is_filled(&self) -> bool {
        let w = self.width;
        let sides =
            |i: usize| [i - 1, i + 1, i - w, i + w].map(|j| usize::from(self.counts[j] > 0));
        let among = self.occupied().filter(|&i| sides(i).iter().sum::<usize>() >= 3).count();
        among as f64 >= FILLED.get() * self.occupied().count() as f64
    }

    /// The numbers blurred over three cells each way, half of that inside being 0; none where there is no point.
    fn blurred(&self) -> Option<Vec<f64>> {
        let w = self.width;
        let mut out = vec![0.0; self.counts.len()];
        let mut inner = Vec::new();
        let inside = self.counts.len() - 2 * (w + 1);
        for (i, out) in out.iter_mut().enumerate().skip(w + 1).take(inside) {
            let mut full = true;
            for (row, share) in [(i - w, 1), (i, 2), (i + w, 1)] {
                let three = [row - 1, row, row + 1].map(|j| self.counts[j]);
                full &= three.iter().all(|c| *c > 0);
                *out += (share * (three[0] + 2 * three[1] + three[2])) as f64 / 16.0;
            }
            if full {
                inner.push(*out);
            }
        }
        if inner.is_empty() {
            inner.extend(self.occupied().map(|i| out[i]));
        }
        let middle = inner.len() / 2;
        let inside = *inner
            .get_mut(..)
            .filter(|v| !v.is_empty())?
            .select_nth_unstable_by(middle, f64::total_cmp)
            .1;
        out.iter_mut().for_each(|v| *v = v.min(inside) - inside / 2.0);
        Some(out)
    }
}

/// Area of a loop, positive where it goes counter-clockwise.
fn area(polygon: &[Uv]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>() / 2.0
}

/// The corners of a closed loop that a polygon within `tolerance` of it needs (Douglas and Peucker 1973).
fn simplified(polygon: &[Uv], tolerance: f64) -> Vec<Uv> {
    let first = polygon.first().copied().unwrap_or_default();
    let far = |a: &Uv| (a[0] - first[0]).hypot(a[1] - first[1]);
    let opposite =
        (0..polygon.len()).max_by(|&a, &b| far(&polygon[a]).total_cmp(&far(&polygon[b])));
    let Some(opposite) = opposite.filter(|o| *o > 0) else { return polygon.to_vec() };
    let mut kept = vec![false; polygon.len() + 1];
    (kept[0], kept[opposite]) = (true, true);
    let mut spans = vec![(0, opposite), (opposite, polygon.len())];
    while let Some((from, to)) = spans.pop() {
        let (a, b) = (polygon[from], polygon[to % polygon.len()]);
        let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
        let length = dx.hypot(dy).max(1e-300);
        let off = |p: &Uv| ((p[0] - a[0]) * dy - (p[1] - a[1]) * dx).abs() / length;
        let worst = (from + 1..to).max_by(|&i, &j| off(&polygon[i]).total_cmp(&off(&polygon[j])));
        if let Some(worst) = worst.filter(|&w| off(&polygon[w]) > tolerance) {
            kept[worst] = true;
            spans.extend([(from, worst), (worst, to)]);
        }
    }
    polygon.iter().zip(kept).filter(|(_, k)| *k).map(|(p, _)| *p).collect()
}

/// The convex hull, counter-clockwise (Andrew's monotone chain).
fn hull(mut points: Vec<Uv>) -> Vec<Uv> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let turns = |a: &Uv, b: &Uv, c: &Uv| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
    };
    let half = |points: &mut dyn Iterator<Item = Uv>| {
        let mut chain: Vec<Uv> = Vec::new();
        for p in points {
            while chain.len() > 1 && !turns(&chain[chain.len() - 2], &chain[chain.len() - 1], &p) {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut all = half(&mut points.iter().copied());
    all.extend(half(&mut points.iter().rev().copied()));
    all
}

/// How far points within a hull reach in a direction: the contour's own bumps would add to it.
fn reach(points: &[Uv], hull: &[Uv], d: Uv) -> f64 {
    let along = |p: &Uv| p[0] * d[0] + p[1] * d[1];
    let ends = |places: &mut dyn Iterator<Item = f64>| {
        places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| (low.min(t), high.max(t)))
    };
    let (low, high) = ends(&mut hull.iter().map(along));
    let (first, last) = ends(&mut points.iter().map(along).filter(|t| (low..=high).contains(t)));
    (last - first).max(0.0)
}

/// The directions of the longer and the shorter sides of the smallest rectangle around a convex polygon, one of whose
/// edges it has.
fn rectangle(hull: &[Uv]) -> Option<(Uv, Uv)> {
    let next = hull.iter().cycle().skip(1);
    let boxes = hull.iter().zip(next).filter_map(|(a, b)| {
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        if length == 0.0 {
            return None;
        }
        let u = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
        let v = [-u[1], u[0]];
        let (along, across) = (reach(hull, hull, u), reach(hull, hull, v));
        Some((along * across, if along >= across { (u, v) } else { (v, u) }))
    });
    boxes.min_by(|a, b| a.0.total_cmp(&b.0)).map(|b| b.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fits::Random;

    /// Points of a rectangle of 40 by 20, turned by half a radian, outside a hole of radius 5 in it.
    fn plate(n: usize) -> (Vec<Uv>, f64) {
        let mut random = Random::new(3);
        let (sin, cos) = 0.5f64.sin_cos();
        let mut points = Vec::new();
        while points.len() < n {
            let (x, y) = (random.uniform(-20.0, 20.0), random.uniform(-10.0, 10.0));
            if f64::hypot(x - 8.0, y) > 5.0 {
                points.push([x * cos - y * sin, x * sin + y * cos]);
            }
        }
        let area = 800.0 - std::f64::consts::PI * 25.0;
        // The fourth neighbour stands at the radius of a disc with four points.
        (points, (4.0 * area / (n as f64 * std::f64::consts::PI)).sqrt())
    }

    #[test]
    fn a_plate_has_its_corners_its_hole_and_its_area() {
        let (points, spacing) = plate(10_000);
        let found = outline(&points, spacing).unwrap();
        let truth = 800.0 - std::f64::consts::PI * 25.0;
        assert!((found.area / truth - 1.0).abs() < 0.01, "{}", found.area);
        assert!((found.size[0] - 40.0).abs() < 0.6 && (found.size[1] - 20.0).abs() < 0.6);
        let turned = found.along[1].atan2(found.along[0]).rem_euclid(std::f64::consts::PI);
        assert!((turned - 0.5).abs() < 0.02, "{turned}");
        let [outer, hole] = &found.loops[..] else { panic!("{} loops", found.loops.len()) };
        assert!(area(outer) > 780.0 && outer.len() < 14, "{outer:?}");
        assert!((area(hole) + 78.5).abs() < 12.0 && hole.len() < 24, "{}", area(hole));
    }

    #[test]
    fn points_in_rows_have_one_outline() {
        let points: Vec<Uv> =
            (0..8000).map(|k| [0.1 * f64::from(k % 400), f64::from(k / 400)]).collect();
        let found = outline(&points, 0.2).unwrap();
        assert_eq!(found.loops.len(), 1);
        assert!((found.area / 800.0 - 1.0).abs() < 0.1, "{}", found.area);
    }

    #[test]
    fn too_few_points_have_none() {
        assert_eq!(outline(&[], 1.0), None);
        assert_eq!(outline(&[[1.0, 2.0]; 3], 0.0), None);
    }
}

//! Distances of parallel surfaces, and angles of touching ones.

use std::collections::BTreeMap;

use super::estimate::{Direction, Estimate, Gap, Place};
use super::positions::Line;
use super::search::{Bundle, Search};
use super::told::{Measure, MeasureKind};

/// The planes of a bundle, each with its place along the bundle's direction.
pub type Planes = Vec<(usize, Place<1>)>;

fn distance<const D: usize>(search: &Search, faces: [usize; 2], gap: &Gap<D>) -> Measure {
    let (value, uncertainty) = gap.length();
    let unit = search.frame.unit;
    let mut regions = faces.map(|f| search.faces[f].region);
    regions.sort_unstable();
    let kind = MeasureKind::Distance;
    Measure { kind, regions, value: value * unit, uncertainty: uncertainty * unit }
}

/// Distances of each plane of a bundle from the next along its direction.
pub fn of_planes(search: &Search, planes: &Planes) -> Vec<Measure> {
    let mut order: Vec<&(usize, Place<1>)> = planes.iter().collect();
    order.sort_by(|a, b| a.1.x[0].total_cmp(&b.1.x[0]));
    let next = |w: &[&(usize, Place<1>)]| {
        let gap = w[0].1.gap(&w[1].1)?;
        Some(distance(search, [w[0].0, w[1].0], &gap))
    };
    order.windows(2).filter_map(next).collect()
}

/// Distances of the axes of a bundle along the shortest tree that joins all: each from a near one.
pub fn of_lines(search: &Search, lines: &[Line]) -> Vec<Measure> {
    let mut out = Vec::new();
    let mut left: Vec<usize> = (1..lines.len()).collect();
    let away = |a: usize, b: usize| (lines[a].place.x - lines[b].place.x).norm();
    // the nearest line of the tree, for each that is not in it
    let mut nearest = vec![0; lines.len()];
    while let Some(k) = (0..left.len()).min_by(|&a, &b| {
        away(left[a], nearest[left[a]]).total_cmp(&away(left[b], nearest[left[b]]))
    }) {
        let line = left.swap_remove(k);
        let [a, b] = [&lines[nearest[line]], &lines[line]];
        out.extend(a.place.gap(&b.place).map(|gap| distance(search, [a.hub, b.hub], &gap)));
        for &other in &left {
            if away(other, line) < away(other, nearest[other]) {
                nearest[other] = line;
            }
        }
    }
    out
}

/// Angles of touching surfaces with directions that are neither parallel nor perpendicular.
pub fn angles(
    search: &Search,
    bundles: &[Bundle],
    square: &BTreeMap<[usize; 2], usize>,
    touching: &[[usize; 2]],
) -> Vec<Measure> {
    let bundle = |face: usize| bundles.iter().position(|b| b.faces.contains(&face));
    let angle = |&[a, b]: &[usize; 2]| {
        let (p, q) = (bundle(a)?, bundle(b)?);
        if p == q || square.contains_key(&[p.min(q), p.max(q)]) {
            return None;
        }
        let [d, e] = [&bundles[p].direction, &bundles[q].direction];
        let (sine, cosine) = (d.w.cross(&e.w).norm(), d.w.dot(&e.w).abs());
        let between = sine.atan2(cosine);
        // each turns the angle by its component along the other
        let turn = |from: &Direction, to: &Direction| {
            let along = to.w - from.w * from.w.dot(&to.w);
            from.variance_along(&along.try_normalize(0.0).unwrap_or_default())
        };
        let kinds = [a, b].map(|f| search.faces[f].has_axis());
        let right = std::f64::consts::FRAC_PI_2;
        Some(Measure {
            kind: MeasureKind::Angle,
            regions: [a, b].map(|f| search.faces[f].region),
            value: if kinds[0] == kinds[1] { between } else { right - between },
            uncertainty: (turn(d, e) + turn(e, d)).sqrt(),
        })
    };
    touching.iter().filter_map(angle).collect()
}

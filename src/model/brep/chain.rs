//! The lines that edges make around a region's faces.

use super::edge::{Edge, Edges, Use};
use super::part::Part;
use super::sheet::{Sheet, Uv};

/// A chain of uses: closed, or with a free end at either side.
#[derive(Clone, Debug)]
pub struct Chain {
    /// The uses in order.
    pub uses: Vec<Use>,
    /// Whether the last is followed by the first.
    pub closed: bool,
}

/// The chains that edges make around a region's faces, which lie on the left of each.
pub fn chains(part: &Part, edges: &[Edge], region: usize, sheet: &Sheet) -> Vec<Chain> {
    let own = edges.iter().enumerate().filter(|(_, e)| e.regions.contains(&region));
    let mut uses: Vec<Use> =
        own.map(|(k, e)| Use { edge: k, forward: e.has_left(part, region, sheet) }).collect();
    let mut out = Vec::new();
    // Those that close by themselves.
    uses.retain(|u| {
        let closed = edges[u.edge].is_closed();
        if closed {
            out.push(Chain { uses: vec![*u], closed: true });
        }
        !closed
    });
    let start = |u: &Use| edges[u.edge].end(u.forward, 0);
    let end = |u: &Use| edges[u.edge].end(u.forward, 1);
    let mut next: Vec<Option<usize>> = vec![None; uses.len()];
    let mut has_before = vec![false; uses.len()];
    for (k, u) in uses.iter().enumerate() {
        let arriving = edges[u.edge].direction(u.forward, true);
        let candidates = (0..uses.len()).filter(|&j| j != k && start(&uses[j]) == end(u));
        let turn = |j: usize| {
            let v = &uses[j];
            let leaving = edges[v.edge].direction(v.forward, false);
            let place = edges[u.edge].curve.at(edges[u.edge].span[usize::from(u.forward)]);
            let normal = sheet.normal(&place);
            let back = -arriving;
            // Clockwise from the way back to the way on.
            (-normal.dot(&back.cross(&leaving)))
                .atan2(back.dot(&leaving))
                .rem_euclid(std::f64::consts::TAU)
        };
        let mut sorted: Vec<(f64, usize)> = candidates.map(|j| (turn(j), j)).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, j)) = sorted.into_iter().find(|(_, j)| !has_before[*j]) {
            next[k] = Some(j);
            has_before[j] = true;
        }
    }
    let mut seen = vec![false; uses.len()];
    let firsts = (0..uses.len()).filter(|&k| !has_before[k]).chain(0..uses.len());
    for first in firsts {
        let (mut chain, mut at) = (Vec::new(), Some(first));
        while let Some(k) = at.filter(|k| !seen[*k]) {
            seen[k] = true;
            chain.push(uses[k]);
            at = next[k];
        }
        if !chain.is_empty() {
            let closed = at == Some(first);
            out.push(Chain { uses: chain, closed });
        }
    }
    out
}

/// The places of a closed line of uses in a chart, unrolled, and how often it goes around each parameter.
pub fn in_chart(edges: &Edges, uses: &[Use], sheet: &Sheet) -> (Vec<Uv>, [i32; 2]) {
    let mut places: Vec<Uv> = Vec::new();
    for u in uses {
        let mut points = edges.get(u.edge).points();
        if !u.forward {
            points.reverse();
        }
        points.pop();
        for p in points {
            let c = sheet.chart(&p);
            let c = places.last().map_or(c, |near| sheet.beside(c, near));
            places.push(c);
        }
    }
    let mut turns = [0; 2];
    if let (Some(first), Some(last)) = (places.first(), places.last()) {
        let back = sheet.beside(*first, last);
        for k in 0..2 {
            if sheet.angular()[k] {
                let period = std::f64::consts::TAU * sheet.scale[k];
                turns[k] = ((back[k] - first[k]) / period).round() as i32;
            }
        }
    }
    (places, turns)
}

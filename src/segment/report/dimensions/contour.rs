//! Lines of level nought on a grid: marching squares.

use std::collections::BTreeMap;

/// A side of a square of the grid.
#[derive(Clone, Copy)]
enum Edge {
    Below,
    Right,
    Above,
    Left,
}

/// The closed lines on which `values` on a grid of that `width` are nought, higher ones to the left of each line;
/// coordinates are in steps of the grid. Values at its border must be below nought.
pub fn contours(values: &[f64], width: usize) -> Vec<Vec<[f64; 2]>> {
    let mut next: BTreeMap<(usize, bool), (usize, bool)> = BTreeMap::new();
    for i in (0..values.len().saturating_sub(width + 1)).filter(|i| (i + 1) % width > 0) {
        let corners = [i, i + 1, i + 1 + width, i + width];
        for (from, to) in steps(corners.map(|c| values[c])) {
            next.insert(side(i, width, *from), side(i, width, *to));
        }
    }
    let mut loops = Vec::new();
    while let Some((&first, _)) = next.first_key_value() {
        let (mut line, mut at) = (Vec::new(), first);
        while let Some(to) = next.remove(&at) {
            line.push(crossing(values, width, at));
            at = to;
        }
        loops.push(line);
    }
    loops
}

/// A side of the square whose lower left corner is `i`: its first corner, and whether it goes up from there.
fn side(i: usize, width: usize, of: Edge) -> (usize, bool) {
    match of {
        Edge::Below => (i, false),
        Edge::Right => (i + 1, true),
        Edge::Above => (i + width, false),
        Edge::Left => (i, true),
    }
}

/// Where the line crosses a side.
fn crossing(values: &[f64], width: usize, (i, up): (usize, bool)) -> [f64; 2] {
    let (a, b) = (values[i], values[if up { i + width } else { i + 1 }]);
    let (x, y, t) = ((i % width) as f64, (i / width) as f64, a / (a - b));
    if up { [x, y + t] } else { [x + t, y] }
}

/// From which side to which the line goes through a square, from the values at its corners, counter-clockwise from the
/// lower left. Where two lines may go either way the mean of the corners decides.
fn steps(corners: [f64; 4]) -> &'static [(Edge, Edge)] {
    use Edge::{Above, Below, Left, Right};
    let inside = corners.map(|v| v >= 0.0);
    let joined = corners.iter().sum::<f64>() >= 0.0;
    match inside {
        [false, false, false, false] | [true, true, true, true] => &[],
        [true, false, false, false] => &[(Below, Left)],
        [false, true, false, false] => &[(Right, Below)],
        [false, false, true, false] => &[(Above, Right)],
        [false, false, false, true] => &[(Left, Above)],
        [true, true, false, false] => &[(Right, Left)],
        [false, true, true, false] => &[(Above, Below)],
        [false, false, true, true] => &[(Left, Right)],
        [true, false, false, true] => &[(Below, Above)],
        [true, true, true, false] => &[(Above, Left)],
        [false, true, true, true] => &[(Left, Below)],
        [true, false, true, true] => &[(Below, Right)],
        [true, true, false, true] => &[(Right, Above)],
        [true, false, true, false] if joined => &[(Above, Left), (Below, Right)],
        [true, false, true, false] => &[(Below, Left), (Above, Right)],
        [false, true, false, true] if joined => &[(Left, Below), (Right, Above)],
        [false, true, false, true] => &[(Right, Below), (Left, Above)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_around_a_disc_and_its_hole_is_two_circles() {
        let width = 41;
        let height = |i: usize| {
            let r = ((i % width) as f64 - 20.0).hypot((i / width) as f64 - 20.0);
            (15.0 - r).min(r - 6.0)
        };
        let values: Vec<f64> = (0..width * width).map(height).collect();
        let mut loops = contours(&values, width);
        loops.sort_by_key(Vec::len);
        let [inner, outer] = &loops[..] else { panic!("{} loops", loops.len()) };
        for (line, radius, turn) in [(inner, 6.0, -1.0), (outer, 15.0, 1.0)] {
            let (mut area, n) = (0.0, line.len());
            for (k, p) in line.iter().enumerate() {
                let q = line[(k + 1) % n];
                assert!(((p[0] - 20.0).hypot(p[1] - 20.0) - radius).abs() < 0.1);
                area += ((p[0] - 20.0) * (q[1] - 20.0) - (p[1] - 20.0) * (q[0] - 20.0)) / 2.0;
            }
            assert!((turn * area / (std::f64::consts::PI * radius * radius) - 1.0).abs() < 0.03);
        }
    }

    #[test]
    fn corners_that_touch_are_joined_where_the_middle_is_inside() {
        for (low, lines) in [(-0.5, 1), (-2.0, 2)] {
            let values = [
                [-3.0, -3.0, -3.0, -3.0],
                [-3.0, 1.0, low, -3.0],
                [-3.0, low, 1.0, -3.0],
                [-3.0, -3.0, -3.0, -3.0],
            ];
            assert_eq!(contours(&values.concat(), 4).len(), lines, "{low}");
        }
    }
}

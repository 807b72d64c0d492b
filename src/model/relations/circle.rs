//! Spots that stand evenly on a circle.

use std::f64::consts::TAU;

use nalgebra::Vector2;

use super::spot::Spot;
use crate::fit::constant::constants;

constants! {
    /// Axes of one direction of which all circles through three are tried; of more, only those about another axis.
    TRIED: usize = 24, Effort("circles through three axes");
    /// Standard deviations within which a spot may stand on its place; whether it does is decided by its chi-squared.
    pub NEAR: f64 = 5.0, Effort("patterns tried");
    /// Three axes whose triangle covers less than this share of the square of its longest side tell no circle.
    FLAT: f64 = 0.05, Effort("circles tried");
    /// Places that a circle may have.
    PLACES: usize = 72, Effort("even divisions of a circle, down to five degrees");
}

/// Spots that stand evenly on a circle.
pub struct Circle {
    /// Spots and their places, counter-clockwise from the first.
    pub at: Vec<(usize, i32)>,
    /// How many places there are.
    pub places: usize,
    /// What stands in the middle.
    pub centre: Option<Spot>,
    /// How many circles it was chosen from.
    pub trials: f64,
}

/// The circle with the most spots; about an axis before about none.
pub fn circle(spots: &[Spot], axes: &[Spot]) -> Option<Circle> {
    let about = |centre: &Spot| best_about(spots, &centre.z, centre.deviation, Some(*centre));
    let mut all: Vec<Circle> = axes.iter().filter_map(about).collect();
    let mut trials = axes.len() as f64;
    if spots.len() <= TRIED.get() {
        for c in 2..spots.len() {
            for (a, b) in (1..c).flat_map(|b| (0..b).map(move |a| (a, b))) {
                trials += 1.0;
                let Some((centre, deviation)) = middle([a, b, c].map(|k| &spots[k])) else {
                    continue;
                };
                all.extend(best_about(spots, &centre, deviation, None));
            }
        }
    }
    let rank = |c: &Circle| (c.at.len(), c.centre.is_some(), std::cmp::Reverse(c.places));
    let best = all.into_iter().reduce(|a, b| if rank(&b) > rank(&a) { b } else { a })?;
    Some(Circle { trials: trials * PLACES.get() as f64, ..best })
}

/// The middle of the circle through three spots, and how exactly it is known; none where they stand in a row.
fn middle([a, b, c]: [&Spot; 3]) -> Option<(Vector2<f64>, f64)> {
    let (p, q) = (b.z - a.z, c.z - a.z);
    let area = p.perp(&q);
    let longest = p.norm().max(q.norm()).max((p - q).norm());
    // flatter than this, the middle is too uncertain to say where other places are
    if area.abs() < FLAT.get() * longest * longest {
        return None;
    }
    let (pp, qq) = (p.norm_squared(), q.norm_squared());
    let centre = a.z + Vector2::new(q.y * pp - p.y * qq, p.x * qq - q.x * pp) / (2.0 * area);
    let deviation = a.deviation.max(b.deviation).max(c.deviation);
    Some((centre, deviation * longest * longest / area.abs()))
}

/// The most spots that stand evenly about a centre, at least three.
fn best_about(
    spots: &[Spot],
    centre: &Vector2<f64>,
    deviation: f64,
    axis: Option<Spot>,
) -> Option<Circle> {
    let arms: Vec<(usize, f64, f64)> = (0..spots.len())
        .map(|k| (k, spots[k].z - centre))
        .filter(|(k, d)| d.norm() > NEAR.get() * (spots[*k].deviation + deviation))
        .map(|(k, d)| (k, d.norm(), d.y.atan2(d.x)))
        .collect();
    let mut best: Option<Circle> = None;
    for &(first, radius, start) in &arms {
        let near =
            |k: usize| NEAR.get() * (spots[k].deviation + spots[first].deviation + 2.0 * deviation);
        let same: Vec<(usize, f64)> = arms
            .iter()
            .filter(|a| (a.1 - radius).abs() < near(a.0))
            .map(|a| (a.0, (a.2 - start).rem_euclid(TAU)))
            .collect();
        if same.len() < 3.max(best.as_ref().map_or(0, |b| b.at.len() + 1)) {
            continue;
        }
        let even = (same.len()..=PLACES.get()).find_map(|places| {
            let step = TAU / places as f64;
            let at = same.iter().map(|&(k, angle)| {
                let place = (angle / step).round();
                let off = (angle - place * step).abs() * radius;
                (off < near(k)).then_some((k, place as i32 % places as i32))
            });
            let mut at: Vec<(usize, i32)> = at.collect::<Option<_>>()?;
            at.sort_by_key(|a| a.1);
            let distinct = at.windows(2).all(|w| w[0].1 != w[1].1);
            distinct.then_some((at, places))
        });
        if let Some((at, places)) = even {
            best = Some(Circle { at, places, centre: axis, trials: 1.0 });
        }
    }
    best
}

/// Middle and radius of the circle on which places stand at known angles, by least squares.
pub fn about(places: &[(Vector2<f64>, f64)]) -> (Vector2<f64>, f64) {
    let n = places.len() as f64;
    let unit = |angle: f64| Vector2::new(angle.cos(), angle.sin());
    let mean = places.iter().map(|p| p.0).sum::<Vector2<f64>>() / n;
    let turn = places.iter().map(|p| unit(p.1)).sum::<Vector2<f64>>() / n;
    let (mut arm, mut square) = (Vector2::zeros(), 0.0);
    for (z, angle) in places {
        let (e, d) = (unit(*angle) - turn, z - mean);
        arm += Vector2::new(e.dot(&d), e.perp(&d));
        square += e.norm_squared();
    }
    arm /= square;
    let turned = Vector2::new(arm.x * turn.x - arm.y * turn.y, arm.x * turn.y + arm.y * turn.x);
    (mean - turned, arm.norm())
}

//! Axes that stand evenly on a circle or in rows.

use std::f64::consts::TAU;

use nalgebra::Vector2;

use super::cluster::ODDS;
use super::constraint::Constraint;
use super::lattice::{Lattice, largest};
use super::positions::Line;
use super::search::{Accepted, Bundle, Search};
use super::told::{Relation, RelationKind};
use crate::fit::constant::constants;
use crate::geometry::Vec3;

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

/// One place of a pattern: where an axis stands across the direction, how exactly that is known, and its face.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Where it stands.
    pub z: Vector2<f64>,
    /// The larger standard deviation of that.
    pub deviation: f64,
    /// The face.
    pub face: usize,
}

/// Accepts the patterns of the axes of a bundle: of those with equal radii first, then of all that are left.
pub fn patterns(search: &mut Search, bundle: &Bundle, lines: &[Line], radii: &[Vec<usize>]) {
    let spot = |line: &Line, face: usize| Spot {
        z: bundle.direction.across.transpose() * line.point,
        deviation: line.place.covariance.symmetric_eigenvalues().max().max(0.0).sqrt(),
        face,
    };
    let mut used: Vec<usize> = Vec::new();
    let centres: Vec<Spot> = lines.iter().map(|l| spot(l, l.hub)).collect();
    let alike = radii.iter().map(|radius| {
        let belongs = |f: &usize| radius.contains(f) && search.faces[*f].is_round;
        let with = |l: &Line| l.faces.iter().copied().find(belongs);
        lines.iter().filter_map(|l| Some(spot(l, with(l)?))).collect::<Vec<Spot>>()
    });
    let sets: Vec<Vec<Spot>> = alike.collect();
    for mut spots in sets {
        while let Some(taken) = one(search, bundle, &spots, &centres) {
            spots.retain(|s| !taken.contains(&s.face));
            used.extend(taken);
        }
    }
    let in_use = |l: &&Line| !l.faces.iter().any(|f| used.contains(f));
    let free = lines.iter().filter(in_use);
    // the face with the best known axis that goes round stands for all on that axis
    let round = |l: &Line| {
        let hub = search.faces[l.hub].is_round.then_some(l.hub);
        hub.or_else(|| l.faces.iter().copied().find(|&f| search.faces[f].is_round))
    };
    let mut spots: Vec<Spot> = free.filter_map(|l| Some(spot(l, round(l)?))).collect();
    while let Some(taken) = one(search, bundle, &spots, &centres) {
        spots.retain(|s| !taken.contains(&s.face));
    }
}

/// Accepts the largest pattern of some spots; gives its faces.
fn one(
    search: &mut Search,
    bundle: &Bundle,
    spots: &[Spot],
    centres: &[Spot],
) -> Option<Vec<usize>> {
    let round = circle(spots, centres);
    let rows = largest(spots);
    let of_round = round.as_ref().map_or(0, |c| c.at.len());
    let of_rows = rows.as_ref().map_or(0, |l| l.at.len());
    // four holes of a square stand on a circle too, which is meant where something stands in its middle
    let is_round = round.as_ref().is_some_and(|c| c.centre.is_some() || c.at.len() != 4);
    let round_first = of_round > of_rows || of_round == of_rows && is_round;
    let tell_round =
        |search: &mut Search| round.as_ref().and_then(|c| c.take(search, bundle, spots));
    let tell_rows = |search: &mut Search| take(rows.as_ref()?, search, bundle, spots);
    if round_first {
        tell_round(search).or_else(|| tell_rows(search))
    } else {
        tell_rows(search).or_else(|| tell_round(search))
    }
}

/// Spots that stand evenly on a circle.
struct Circle {
    /// Spots and their places, counter-clockwise from the first.
    at: Vec<(usize, i32)>,
    /// How many places there are.
    places: usize,
    /// What stands in the middle.
    centre: Option<Spot>,
    /// How many circles it was chosen from.
    trials: f64,
}

/// The circle with the most spots; about an axis before about none.
fn circle(spots: &[Spot], axes: &[Spot]) -> Option<Circle> {
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

impl Circle {
    fn take(&self, search: &mut Search, bundle: &Bundle, spots: &[Spot]) -> Option<Vec<usize>> {
        let step = TAU / self.places as f64;
        let members: Vec<usize> = self.at.iter().map(|a| spots[a.0].face).collect();
        let places: Vec<i32> = self.at.iter().map(|a| a.1).collect();
        // counter-clockwise about the bundle's direction is clockwise about that of a face that points the other way
        let first = search.faces[members[0]].shape.w();
        let sense = if first.dot(&bundle.direction.w) < 0.0 { -1.0 } else { 1.0 };
        let centre = self.centre.filter(|c| !members.contains(&c.face));
        let faces = members.iter().copied().chain(centre.map(|c| c.face)).collect();
        let centred = centre.is_some();
        let constraint =
            Constraint::Circle { faces, at: places.clone(), step: step * sense, centred };
        let equations = 2 * (members.len() - 2) + 2 * usize::from(centred);
        let mut relation =
            accept(search, &constraint, equations, self.trials, RelationKind::CirclePattern)?;
        relation.regions = search.regions(&members);
        if let Some(centre) = centre {
            relation.to = search.regions(&[centre.face]);
        }
        let (c, arm) = about(
            &self.at.iter().map(|a| (spots[a.0].z, step * f64::from(a.1))).collect::<Vec<_>>(),
        );
        relation.point =
            Some(search.frame.world_point(&in_space(bundle, &c, search, &members)).into());
        relation.direction = Some(bundle.direction.w.into());
        relation.value = Some(arm * search.frame.unit);
        relation.count = Some(self.places);
        relation.spacing = Some(step);
        let needs = bundle.accepted.into_iter().collect();
        search.tell(Accepted::one(relation, vec![constraint], needs));
        Some(members)
    }
}

/// Middle and radius of the circle on which places stand at known angles, by least squares.
fn about(places: &[(Vector2<f64>, f64)]) -> (Vector2<f64>, f64) {
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

/// A place across the direction, at the mean height of some faces.
fn in_space(bundle: &Bundle, z: &Vector2<f64>, search: &Search, faces: &[usize]) -> Vec3 {
    let d = &bundle.direction;
    let heights = faces.iter().map(|&f| search.faces[f].shape.origin.dot(&d.w));
    d.across * z + d.w * (heights.sum::<f64>() / faces.len() as f64)
}

/// Accepts a pattern that was chosen from so many.
fn accept(
    search: &mut Search,
    constraint: &Constraint,
    equations: usize,
    trials: f64,
    kind: RelationKind,
) -> Option<Relation> {
    // each equation of a place is a distance that may be anything within the scene
    let volume = search.frame.size.powi(equations as i32);
    let innovation = search.ask(constraint);
    let odds = innovation.evidence(equations, volume) - trials.ln();
    if !(odds > ODDS.get()) || search.take(constraint).is_none() {
        return None;
    }
    let unit = search.frame.unit;
    Some(Relation {
        deviation: innovation.largest.0.abs() * unit,
        uncertainty: innovation.largest.1 * unit,
        p_value: innovation.probability(),
        log_odds: odds,
        ..Relation::new(kind, Vec::new())
    })
}

/// Accepts rows of spots.
fn take(
    lattice: &Lattice,
    search: &mut Search,
    bundle: &Bundle,
    spots: &[Spot],
) -> Option<Vec<usize>> {
    let members: Vec<usize> = lattice.at.iter().map(|a| spots[a.0].face).collect();
    let at: Vec<[i32; 2]> = lattice.at.iter().map(|a| a.1).collect();
    let is_row = lattice.counts[1] == 1;
    let n = members.len();
    let equations = if is_row { 2 * (n - 2) } else { 2 * (n - 3) + 1 };
    let constraint = Constraint::Grid { faces: members.clone(), at };
    let kind = RelationKind::GridPattern;
    let relation = accept(search, &constraint, equations, lattice.trials, kind)?;
    let d = &bundle.direction;
    let [first, a, b] = lattice.fitted(spots);
    let unit = search.frame.unit;
    let along = d.across * a.try_normalize(0.0).unwrap_or_default();
    let across = if is_row {
        d.w.cross(&along)
    } else {
        d.across * b.try_normalize(0.0).unwrap_or_default()
    };
    let point = in_space(bundle, &first, search, &members);
    let relation = Relation {
        regions: search.regions(&members),
        direction: Some(d.w.into()),
        point: Some(search.frame.world_point(&point).into()),
        counts: Some(lattice.counts),
        pitches: Some([a.norm() * unit, b.norm() * unit]),
        grid_directions: Some([along.into(), across.into()]),
        ..relation
    };
    let needs = bundle.accepted.into_iter().collect();
    search.tell(Accepted::one(relation, vec![constraint], needs));
    Some(members)
}

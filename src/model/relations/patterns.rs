//! Axes that stand evenly on a circle or in rows.

use std::f64::consts::TAU;

use nalgebra::Vector2;

use super::circle::{Circle, about, circle};
use super::cluster::ODDS;
use super::constraint::Constraint;
use super::lattice::{Lattice, largest};
use super::positions::Line;
use super::search::{Accepted, Bundle, Search};
use super::spot::Spot;
use super::told::{Relation, RelationKind};
use crate::geometry::Vec3;

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
    let sure = odds > ODDS.get();
    if !sure || search.take(constraint).is_none() {
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

//! Common directions, and directions at right angles.

use std::collections::BTreeMap;

use super::chi2::{ln_density, survival};
use super::cluster::{COMPATIBLE, Group, ODDS, cluster};
use super::constraint::Constraint;
use super::estimate::{Direction, Estimate};
use super::face::Face;
use super::search::{Accepted, Bundle, Search, learned_share, log_odds, spread};
use super::told::{Relation, RelationKind};

/// A face's direction.
fn direction(face: &Face) -> Direction {
    Direction { w: face.shape.w(), across: face.across(), covariance: face.direction_covariance() }
}

/// The places of the faces that have a direction, and these.
fn directed(faces: &[Face]) -> (Vec<usize>, Vec<Direction>) {
    let has = (0..faces.len()).filter(|&k| faces[k].is_directed());
    has.map(|k| (k, direction(&faces[k]))).unzip()
}

/// Natural logarithm of how much more likely the directions of `faces` are with all that they have in common than without.
pub fn weight(faces: &[Face]) -> f64 {
    let groups = cluster(&directed(faces).1);
    let values: Vec<Direction> = groups.iter().map(|g| g.value).collect();
    let (pairs, prior) = right_angles(&values);
    let square: f64 =
        pairs.iter().map(|p| p.evidence + prior).filter(|odds| *odds > ODDS.get()).sum();
    groups.iter().map(|g| g.weight).sum::<f64>() + square
}

/// The bundles of faces with a common direction, those of one face too; accepts that they are parallel.
pub fn parallel(search: &mut Search) -> Vec<Bundle> {
    let (places, items) = directed(search.faces);
    let mut bundles = Vec::new();
    for group in cluster(&items) {
        bundles.extend(bundle(search, &places, &items, &group));
    }
    bundles.sort_by_key(|b| b.faces[0]);
    bundles
}

/// A group as a bundle; members that the others' positions turn out to contradict stand alone.
fn bundle(
    search: &mut Search,
    places: &[usize],
    items: &[Direction],
    group: &Group<Direction>,
) -> Vec<Bundle> {
    let spread_of = |m: &usize| items[*m].covariance.trace();
    let hub = group.members.iter().copied().min_by(|a, b| spread_of(a).total_cmp(&spread_of(b)));
    let Some(hub) = hub else { return Vec::new() };
    let bind = |m: usize| vec![Constraint::Parallel([places[hub], places[m]])];
    let (stayed, constraints) = search.take_group(group, hub, bind);
    let accepted = tell_parallel(search, items, places, &stayed, group.odds, constraints);
    let alone = group.members.iter().filter(|m| !stayed.contains(m)).map(|&m| vec![m]);
    let mut out: Vec<Bundle> = Vec::new();
    for members in alone.chain([stayed.clone()]) {
        let all = members.iter().map(|&m| Some(items[m]));
        let Some(direction) = all.reduce(|a, b| a?.joined(&b?)).flatten() else { continue };
        let hub = if members.contains(&hub) { hub } else { members[0] };
        let faces = members.iter().map(|&m| places[m]).collect();
        let accepted = accepted.filter(|_| members.len() > 1);
        out.push(Bundle { faces, hub: places[hub], direction, accepted });
    }
    out
}

/// Tells of a group's planes that they are parallel, of its axes too, and that its axes stand perpendicular to its planes.
fn tell_parallel(
    search: &mut Search,
    items: &[Direction],
    places: &[usize],
    members: &[usize],
    odds: f64,
    constraints: Vec<Constraint>,
) -> Option<usize> {
    let is_axis = |m: &&usize| search.faces[places[**m]].has_axis();
    let (axes, planes): (Vec<usize>, Vec<usize>) = members.iter().partition(is_axis);
    let mut told = Vec::new();
    let name = |all: &[usize]| -> Vec<usize> {
        all.iter().map(|&m| search.faces[places[m]].region).collect()
    };
    for alike in [&planes, &axes] {
        if alike.len() > 1
            && let Some(spread) = spread(items, alike)
        {
            told.push(spread.relation(RelationKind::Parallel, name(alike), odds, 1.0));
        }
    }
    if let (false, false) = (axes.is_empty(), planes.is_empty())
        && let [Some(a), Some(b)] = [&axes, &planes]
            .map(|all| all.iter().map(|&m| Some(items[m])).reduce(|a, b| a?.joined(&b?)).flatten())
        && let Some(gap) = a.gap(&b)
    {
        let (deviation, uncertainty) = gap.length();
        let p_value = gap.chi2().map_or(0.0, |x| survival(x, 2));
        let mut relation = Relation::new(RelationKind::Perpendicular, name(&axes));
        relation = Relation { to: name(&planes), deviation, uncertainty, p_value, ..relation };
        told.push(Relation { log_odds: odds, ..relation });
    }
    let common = members.iter().map(|&m| Some(items[m])).reduce(|a, b| a?.joined(&b?)).flatten();
    let direction = common.map(|d| d.w.into());
    let relations: Vec<Relation> =
        told.into_iter().map(|relation| Relation { direction, ..relation }).collect();
    let any = !relations.is_empty();
    any.then(|| search.tell(Accepted { relations, constraints, needs: Vec::new() }))
}

/// Two bundles that may stand at right angles.
struct Pair {
    bundles: [usize; 2],
    chi2: f64,
    evidence: f64,
    deviation: f64,
    uncertainty: f64,
}

/// Accepts which bundles are at right angles to each other. Gives these pairs, and where each stands among what was found.
pub fn perpendicular(search: &mut Search, bundles: &[Bundle]) -> BTreeMap<[usize; 2], usize> {
    let directions: Vec<Direction> = bundles.iter().map(|b| b.direction).collect();
    let (pairs, prior) = right_angles(&directions);
    let mut sure: Vec<&Pair> = pairs.iter().filter(|p| p.evidence + prior > ODDS.get()).collect();
    sure.sort_by(|a, b| b.evidence.total_cmp(&a.evidence).then(a.bundles.cmp(&b.bundles)));
    let mut accepted = BTreeMap::new();
    for pair in sure {
        let constraint = Constraint::Perpendicular(pair.bundles.map(|b| bundles[b].hub));
        if search.take(&constraint).is_some() {
            let odds = pair.evidence + prior;
            let told = tell_perpendicular(search, bundles, pair, odds, constraint);
            accepted.insert(pair.bundles, told);
        }
    }
    accepted
}

/// The pairs of directions that may be at right angles, and the odds of that without their evidence.
fn right_angles(directions: &[Direction]) -> (Vec<Pair>, f64) {
    let pairs: Vec<Pair> = (0..directions.len())
        .flat_map(|b| (0..b).map(move |a| [a, b]))
        .filter_map(|pair| right_angle(directions, pair))
        .collect();
    let all = (directions.len() * directions.len().saturating_sub(1) / 2) as f64;
    let evidence: Vec<f64> = pairs.iter().map(|p| p.evidence).collect();
    let prior = log_odds(learned_share(&evidence, all));
    (pairs, prior)
}

fn right_angle(directions: &[Direction], pair: [usize; 2]) -> Option<Pair> {
    let [a, b] = pair.map(|k| &directions[k]);
    let cosine = a.w.dot(&b.w);
    let variance = a.variance_along(&b.w) + b.variance_along(&a.w);
    let uncertainty = variance.sqrt();
    let chi2 = cosine * cosine / variance;
    let possible = survival(chi2, 1) >= COMPATIBLE.get();
    // the cosine of the angle between two random directions is anything from -1 to 1
    let evidence = ln_density(chi2, 1, uncertainty.ln()) + 2_f64.ln();
    let deviation = cosine.abs().asin();
    possible.then_some(Pair { bundles: pair, chi2, evidence, deviation, uncertainty })
}

/// Tells it of planes with planes and of axes with axes; an axis whose direction is perpendicular to a plane's normal is
/// parallel to the plane.
fn tell_perpendicular(
    search: &mut Search,
    bundles: &[Bundle],
    pair: &Pair,
    odds: f64,
    constraint: Constraint,
) -> usize {
    let split = |b: usize| -> [Vec<usize>; 2] {
        let of = |axes: bool| {
            let alike = bundles[b].faces.iter().filter(|f| search.faces[**f].has_axis() == axes);
            alike.map(|&f| search.faces[f].region).collect()
        };
        [of(false), of(true)]
    };
    let [first, second] = pair.bundles.map(split);
    let mut told = Vec::new();
    for (k, regions) in first.iter().enumerate() {
        for (l, to) in second.iter().enumerate() {
            let kind = if k == l { RelationKind::Perpendicular } else { RelationKind::Parallel };
            if !regions.is_empty() && !to.is_empty() {
                told.push(Relation {
                    to: to.clone(),
                    deviation: pair.deviation,
                    uncertainty: pair.uncertainty,
                    p_value: survival(pair.chi2, 1),
                    log_odds: odds,
                    ..Relation::new(kind, regions.clone())
                });
            }
        }
    }
    let needs = pair.bundles.iter().filter_map(|&b| bundles[b].accepted).collect();
    search.tell(Accepted { relations: told, constraints: vec![constraint], needs })
}

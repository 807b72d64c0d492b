//! Pairs of surfaces that one plane mirrors.

use nalgebra::{RowVector2, Vector1};

use super::cluster::{Group, cluster};
use super::constraint::Constraint;
use super::estimate::Place;
use super::measures::Planes;
use super::positions::Line;
use super::search::{Accepted, Bundle, Search, spread};
use super::told::{Relation, RelationKind};
use crate::fit::Family;
use crate::fit::constant::constants;
use crate::geometry::Vec3;

constants! {
    /// Share by which the areas of two plane faces, and the middles of the two in the lengths of their sides, may differ
    /// where one mirrors the other.
    ALIKE: f64 = 0.03, Trial(0.02, 0.05);
    /// Standard deviations within which what a pair differs by may lie along the mirror's normal.
    NEAR: f64 = 5.0, Effort("pairs tried; their chi-squared decides");
    /// Pairs that are looked at for one direction; more are none that a person meant.
    MOST: usize = 2_000, Effort("pairs of one direction");
    /// Pairs that make a mirror: any two alike surfaces are mirrored by some plane.
    LEAST: usize = 2, Derived("the second is the first that could be otherwise");
}

/// What a mirror may be found by.
pub struct Scene<'a> {
    /// Common directions.
    pub bundles: &'a [Bundle],
    /// Planes of each, with their place along it.
    pub planes: &'a [Planes],
    /// Axes of each.
    pub lines: &'a [Vec<Line>],
    /// Faces with equal radii.
    pub radii: &'a [Vec<usize>],
}

/// A pair that some plane across a direction mirrors, and the place of that along it.
struct Pair {
    faces: [usize; 2],
    middle: Place<1>,
}

/// Accepts the mirrors across the direction of a bundle: the one with the most pairs.
pub fn symmetric(search: &mut Search, scene: &Scene, bundle: usize) {
    let mut pairs = of_planes(search, &scene.planes[bundle]);
    pairs.extend(of_axes(search, scene, bundle));
    pairs.extend(of_balls(search, scene, bundle));
    if pairs.len() > MOST.get() {
        return;
    }
    let items: Vec<Place<1>> = pairs.iter().map(|p| p.middle).collect();
    let groups = cluster(&items);
    let apart = |g: &Group<Place<1>>| distinct(&pairs, &g.members);
    let largest = groups.iter().map(|g| (apart(g), g)).max_by_key(|(members, _)| members.len());
    let Some((members, group)) = largest else { return };
    // what lies in the mirror is no pair
    let true_pair = |m: &&usize| pairs[**m].faces[0] != pairs[**m].faces[1];
    if members.len() >= LEAST.get() && members.iter().any(|m| true_pair(&m)) {
        take(search, &scene.bundles[bundle], &pairs, &items, members, group);
    }
}

/// Members of which no two share a face.
fn distinct(pairs: &[Pair], members: &[usize]) -> Vec<usize> {
    let mut used: Vec<usize> = Vec::new();
    let mut out = Vec::new();
    for &m in members {
        if !pairs[m].faces.iter().any(|f| used.contains(f)) {
            used.extend(pairs[m].faces);
            out.push(m);
        }
    }
    out
}

fn middle(a: &Place<1>, b: &Place<1>) -> Place<1> {
    Place {
        x: (a.x + b.x) / 2.0,
        covariance: (a.covariance + b.covariance) / 4.0,
        drift: (a.drift + b.drift) / 2.0,
        ..*a
    }
}

/// Parallel plane faces of one size, each opposite the other.
fn of_planes(search: &Search, planes: &Planes) -> Vec<Pair> {
    let mut out = Vec::new();
    for (k, (b, at_b)) in planes.iter().enumerate() {
        for (a, at_a) in &planes[..k] {
            let (Some(p), Some(q)) = (search.faces[*a].patch, search.faces[*b].patch) else {
                continue;
            };
            let side = p.area.max(q.area).sqrt();
            let w = search.faces[*a].shape.w();
            let lateral = (q.middle - p.middle) - w * w.dot(&(q.middle - p.middle));
            let alike = (p.area - q.area).abs() < ALIKE.get() * p.area.max(q.area);
            if alike && lateral.norm() < ALIKE.get() * side {
                out.push(Pair { faces: [*a, *b], middle: middle(at_a, at_b) });
            }
        }
    }
    out
}

/// Where an axis or a centre lies along the bundle's direction.
fn along(search: &Search, bundle: &Bundle, point: &Vec3, variance: f64) -> Place<1> {
    let d = &bundle.direction;
    let lateral = d.across.transpose() * point;
    Place {
        x: Vector1::new(d.w.dot(point)),
        covariance: nalgebra::Matrix1::new(variance),
        drift: RowVector2::new(lateral.x, lateral.y),
        direction: d.covariance,
        volume: search.frame.size,
    }
}

/// Parallel axes across the direction, of surfaces with equal radii, that differ along it alone; and those in the mirror.
fn of_axes(search: &Search, scene: &Scene, bundle: usize) -> Vec<Pair> {
    let n = &scene.bundles[bundle].direction;
    let mut out = Vec::new();
    for (other, lines) in scene.bundles.iter().zip(scene.lines) {
        let tilt =
            (n.variance_along(&other.direction.w) + other.direction.variance_along(&n.w)).sqrt();
        if n.w.dot(&other.direction.w).abs() > NEAR.get() * tilt {
            continue;
        }
        let across = other.direction.across.transpose() * n.w;
        let aside = other.direction.across.transpose() * n.w.cross(&other.direction.w);
        let place = |l: &Line| {
            let variance = across.dot(&(l.place.covariance * across));
            along(search, &scene.bundles[bundle], &l.point, variance)
        };
        for (k, b) in lines.iter().enumerate() {
            out.push(Pair { faces: [b.hub, b.hub], middle: place(b) });
            for a in &lines[..k] {
                let Some(faces) = equal(search, scene, a, b) else { continue };
                let apart = b.place.x - a.place.x;
                let both = a.place.covariance + b.place.covariance;
                let near = NEAR.get() * aside.dot(&(both * aside)).sqrt();
                if aside.dot(&apart).abs() < near {
                    out.push(Pair { faces, middle: middle(&place(a), &place(b)) });
                }
            }
        }
    }
    out
}

/// A face of one type about each of two axes, with equal radii.
fn equal(search: &Search, scene: &Scene, a: &Line, b: &Line) -> Option<[usize; 2]> {
    let family = |f: &usize| search.faces[*f].shape.family;
    let about = |l: &Line, radius: &[usize]| -> Vec<usize> {
        let of = |f: &&usize| radius.contains(f) && search.faces[**f].has_axis();
        l.faces.iter().filter(of).copied().collect()
    };
    scene.radii.iter().find_map(|radius| {
        let others = about(b, radius);
        let alike = |f: &usize| others.iter().find(|g| family(g) == family(f)).copied();
        about(a, radius).iter().find_map(|f| Some([*f, alike(f)?]))
    })
}

/// Balls with equal radii that differ along the direction alone.
fn of_balls(search: &Search, scene: &Scene, bundle: usize) -> Vec<Pair> {
    let n = scene.bundles[bundle].direction.w;
    let is_ball = |f: &&usize| search.faces[**f].shape.family == Family::Sphere;
    let place = |f: usize| {
        let face = &search.faces[f];
        let own = face.shape.frame.transpose() * n;
        let variance = own.dot(&(face.covariance.fixed_view::<3, 3>(0, 0) * own));
        along(search, &scene.bundles[bundle], &face.shape.origin, variance)
    };
    let mut out = Vec::new();
    for radius in scene.radii {
        let balls: Vec<usize> = radius.iter().filter(is_ball).copied().collect();
        for (k, &b) in balls.iter().enumerate() {
            for &a in &balls[..k] {
                let apart = search.faces[b].shape.origin - search.faces[a].shape.origin;
                let aside = apart - n * n.dot(&apart);
                let spread = |f: usize| search.faces[f].covariance.view((0, 0), (3, 3)).trace();
                if aside.norm() < NEAR.get() * (spread(a) + spread(b)).sqrt() {
                    out.push(Pair { faces: [a, b], middle: middle(&place(a), &place(b)) });
                }
            }
        }
    }
    out
}

fn take(
    search: &mut Search,
    bundle: &Bundle,
    pairs: &[Pair],
    items: &[Place<1>],
    members: Vec<usize>,
    group: &Group<Place<1>>,
) {
    let sorted = Group { members, ..group.clone() };
    let variance = |m: &usize| items[*m].covariance[0];
    let first = sorted.members.iter().copied().min_by(|a, b| variance(a).total_cmp(&variance(b)));
    let Some(first) = first else { return };
    let bind = |m: usize| {
        let pairs = [pairs[first].faces, pairs[m].faces];
        vec![Constraint::Mirror { along: bundle.hub, pairs }]
    };
    let (stayed, constraints) = search.take_group(&sorted, first, bind);
    if stayed.len() < LEAST.get() {
        return;
    }
    let Some(spread) = spread(items, &stayed) else { return };
    let faces: Vec<usize> = stayed.iter().flat_map(|&m| pairs[m].faces).collect();
    let unit = search.frame.unit;
    let relation =
        spread.relation(RelationKind::Symmetric, search.regions(&faces), group.odds, unit);
    let d = &bundle.direction;
    let point = d.w * group.value.x[0] + d.across * group.value.drift.transpose();
    let relation = Relation {
        direction: Some(d.w.into()),
        point: Some(search.frame.world_point(&point).into()),
        ..relation
    };
    let needs = bundle.accepted.into_iter().collect();
    search.tell(Accepted::one(relation, constraints, needs));
}

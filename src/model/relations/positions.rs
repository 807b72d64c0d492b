//! Common axes, planes and centres.

use nalgebra::{Matrix2, RowVector2, SMatrix, SVector, Vector1};

use super::cluster::{Group, cluster};
use super::constraint::Constraint;
use super::estimate::{Estimate, Place};
use super::face::Face;
use super::search::{Accepted, Bundle, Search, part, spread};
use super::told::{Relation, RelationKind};
use crate::fit::Family;
use crate::geometry::Vec3;

/// Faces with a common axis; a single one too.
pub struct Line {
    /// The faces, in order; spheres and ellipsoids centred on the axis too.
    pub faces: Vec<usize>,
    /// The face whose axis is known best.
    pub hub: usize,
    /// Where the relation stands among what was found; none of a single face.
    pub accepted: Option<usize>,
    /// A point of the axis.
    pub point: Vec3,
    /// Where it lies across the bundle's direction.
    pub place: Place<2>,
}

/// A face's position if it has the bundle's direction: a point, and its covariance.
fn placed(face: &Face, bundle: &Bundle) -> Option<(Vec3, SMatrix<f64, 3, 3>)> {
    let d = &bundle.direction;
    let columns: &[usize] = match face.shape.family {
        Family::Plane => &[2],
        Family::Cylinder | Family::Cone | Family::EllipticCylinder => &[0, 1],
        _ => &[0, 1, 2],
    };
    let basis = face.shape.frame.select_columns(columns);
    let n = columns.len();
    let (shift, covariance) = if face.has_axis() || face.shape.family == Family::Plane {
        face.placed(&d.w, &d.across, &d.covariance)?
    } else {
        (nalgebra::DVector::zeros(n), face.covariance.view((0, 0), (n, n)).into_owned())
    };
    let covariance = &basis * covariance * basis.transpose();
    let moved = &basis * shift;
    let covariance = SMatrix::from_fn(|i, j| (covariance[(i, j)] + covariance[(j, i)]) / 2.0);
    Some((face.shape.origin + Vec3::new(moved[0], moved[1], moved[2]), covariance))
}

/// Where a face's axis, or its centre, lies across the bundle's direction.
fn on_line(search: &Search, face: usize, bundle: &Bundle) -> Option<Place<2>> {
    let (point, covariance) = placed(&search.faces[face], bundle)?;
    let d = &bundle.direction;
    let b = d.across;
    Some(Place {
        x: b.transpose() * point,
        covariance: b.transpose() * covariance * b,
        drift: -Matrix2::identity() * point.dot(&d.w),
        direction: d.covariance,
        volume: search.frame.size.powi(2),
    })
}

/// How far along the bundle's direction a plane lies.
fn along(search: &Search, face: usize, bundle: &Bundle) -> Option<Place<1>> {
    let (point, covariance) = placed(&search.faces[face], bundle)?;
    let d = &bundle.direction;
    let lateral = d.across.transpose() * point;
    Some(Place {
        x: Vector1::new(d.w.dot(&point)),
        covariance: SMatrix::from_element(d.w.dot(&(covariance * d.w))),
        drift: RowVector2::new(lateral.x, lateral.y),
        direction: d.covariance,
        volume: search.frame.size,
    })
}

/// The member that `order` puts first.
fn best(members: &[usize], order: impl Fn(usize) -> f64) -> Option<usize> {
    members.iter().copied().min_by(|&a, &b| order(a).total_cmp(&order(b)))
}

/// Accepts which axes of a bundle are one, and which centres lie on them. Gives all axes.
pub fn coaxial(search: &mut Search, bundle: &Bundle) -> Vec<Line> {
    let faces = search.faces;
    let axes = bundle.faces.iter().copied().filter(|&f| faces[f].has_axis());
    let mut places: Vec<usize> = axes.collect();
    if places.is_empty() {
        return Vec::new();
    }
    let is_ball = |f: &usize| matches!(faces[*f].shape.family, Family::Sphere | Family::Ellipsoid);
    places.extend((0..faces.len()).filter(is_ball));
    let (places, items): (Vec<usize>, Vec<Place<2>>) =
        places.iter().filter_map(|&f| Some((f, on_line(search, f, bundle)?))).unzip();
    let mut lines = Vec::new();
    for group in cluster(&items) {
        let axes: Vec<usize> =
            group.members.iter().copied().filter(|&m| faces[places[m]].has_axis()).collect();
        let Some(hub) = best(&axes, |m| items[m].covariance.trace()) else { continue };
        let bind = |m: usize| vec![Constraint::OnAxis([places[hub], places[m]])];
        let (stayed, constraints) = search.take_group(&group, hub, bind);
        let left = group.members.iter().filter(|m| !stayed.contains(m)).map(|&m| vec![m]);
        for members in left.chain([stayed.clone()]) {
            lines.extend(line(&places, &items, &members, hub, bundle));
        }
        if let (true, Some(spread)) = (stayed.len() > 1, spread(&items, &stayed)) {
            let all: Vec<usize> = stayed.iter().map(|&m| places[m]).collect();
            let unit = search.frame.unit;
            let relation =
                spread.relation(RelationKind::Coaxial, search.regions(&all), group.odds, unit);
            let point = lines.last().map(|l| search.frame.world_point(&l.point).into());
            let direction = Some(bundle.direction.w.into());
            let relation = Relation { direction, point, ..relation };
            let needs = bundle.accepted.into_iter().collect();
            let told = search.tell(Accepted::one(relation, constraints, needs));
            if let Some(line) = lines.last_mut() {
                line.accepted = Some(told);
            }
        }
    }
    lines.retain(|l| l.faces.iter().any(|&f| faces[f].has_axis()));
    lines.sort_by_key(|l| l.faces[0]);
    lines
}

fn line(
    places: &[usize],
    items: &[Place<2>],
    members: &[usize],
    hub: usize,
    bundle: &Bundle,
) -> Option<Line> {
    let value = members.iter().map(|&m| Some(items[m])).reduce(|a, b| a?.joined(&b?))??;
    let mut faces: Vec<usize> = members.iter().map(|&m| places[m]).collect();
    faces.sort_unstable();
    let hub = if members.contains(&hub) { places[hub] } else { faces[0] };
    let d = &bundle.direction;
    // the drift is the height at which the place was told
    let height = -value.drift.trace() / 2.0;
    let point = d.across * value.x + height * d.w;
    Some(Line { faces, hub, accepted: None, point, place: value })
}

/// Accepts which planes of a bundle are one. Gives how far along the bundle's direction each lies.
pub fn coplanar(search: &mut Search, bundle: &Bundle) -> Vec<(usize, Place<1>)> {
    let planes = bundle.faces.iter().filter(|f| !search.faces[**f].has_axis());
    let (places, items): (Vec<usize>, Vec<Place<1>>) =
        planes.filter_map(|&f| Some((f, along(search, f, bundle)?))).unzip();
    for group in cluster(&items) {
        let bind = |hub, m| vec![Constraint::InPlane([places[hub], places[m]])];
        let told = common(search, RelationKind::Coplanar, &places, &items, &group, bind);
        if let Some(mut accepted) = told {
            let d = bundle.direction.w;
            let (x, lateral) = (group.value.x[0], group.value.drift);
            let point = d * x + bundle.direction.across * lateral.transpose();
            accepted.relations[0].direction = Some(d.into());
            accepted.relations[0].point = Some(search.frame.world_point(&point).into());
            accepted.needs.extend(bundle.accepted);
            search.tell(accepted);
        }
    }
    places.into_iter().zip(items).collect()
}

/// Accepts which centres are one.
pub fn concentric(search: &mut Search) {
    let faces = search.faces;
    let places: Vec<usize> = (0..faces.len()).filter(|&f| faces[f].has_center()).collect();
    let volume = search.frame.size.powi(3);
    let item = |&f: &usize| {
        let basis = faces[f].shape.frame;
        let own = part::<3>(&faces[f].covariance.view((0, 0), (3, 3)).into_owned());
        Place {
            x: faces[f].shape.origin,
            covariance: basis * own * basis.transpose(),
            drift: SMatrix::zeros(),
            direction: Matrix2::zeros(),
            volume,
        }
    };
    let items: Vec<Place<3>> = places.iter().map(item).collect();
    for group in cluster(&items) {
        let bind = |hub, m| vec![Constraint::Concentric([places[hub], places[m]])];
        let told = common(search, RelationKind::Concentric, &places, &items, &group, bind);
        if let Some(mut accepted) = told {
            let point: SVector<f64, 3> = group.value.x;
            accepted.relations[0].point = Some(search.frame.world_point(&point).into());
            search.tell(accepted);
        }
    }
}

/// Accepts a group of places that are one; `None` where it has one member, or the others contradict.
pub fn common<const D: usize>(
    search: &mut Search,
    kind: RelationKind,
    places: &[usize],
    items: &[Place<D>],
    group: &Group<Place<D>>,
    bind: impl Fn(usize, usize) -> Vec<Constraint>,
) -> Option<Accepted> {
    let hub = best(&group.members, |m| items[m].covariance.trace())?;
    let (stayed, constraints) = search.take_group(group, hub, |m| bind(hub, m));
    if stayed.len() < 2 {
        return None;
    }
    let all: Vec<usize> = stayed.iter().map(|&m| places[m]).collect();
    let unit = if kind == RelationKind::EqualAngle { 1.0 } else { search.frame.unit };
    let relation = spread(items, &stayed)?.relation(kind, search.regions(&all), group.odds, unit);
    Some(Accepted::one(relation, constraints, Vec::new()))
}

//! What true surfaces have to do with each other, by comparing them exactly.

use std::collections::BTreeSet;

use conicoid::{
    geometry::{Surface, Vec3},
    model::relations::{Relation, RelationKind as Kind},
};

/// Rounding of surfaces that were made, rotated and shifted.
const EXACT: f64 = 1e-7;

/// Direction of a plane's normal or an axis, and whether it is an axis.
pub fn direction(s: &Surface) -> Option<(Vec3, bool)> {
    match s {
        Surface::Plane(p) => Some((p.normal, false)),
        Surface::Cylinder(c) => Some((c.axis_direction, true)),
        Surface::EllipticCylinder(c) => Some((c.axis_direction, true)),
        Surface::Cone(c) => Some((c.axis_direction, true)),
        Surface::Torus(t) => Some((t.axis_direction, true)),
        Surface::Sphere(_) | Surface::Ellipsoid(_) => None,
    }
}

/// A point of a surface's plane or axis, its centre or apex.
pub fn place(s: &Surface) -> Vec3 {
    match s {
        Surface::Plane(p) => p.point,
        Surface::Cylinder(c) => c.axis_point,
        Surface::EllipticCylinder(c) => c.axis_point,
        Surface::Cone(c) => c.apex,
        Surface::Torus(t) => t.center,
        Surface::Sphere(s) => s.center,
        Surface::Ellipsoid(e) => e.center,
    }
}

fn has_center(s: &Surface) -> bool {
    matches!(s, Surface::Sphere(_) | Surface::Ellipsoid(_) | Surface::Torus(_))
}

fn radius(s: &Surface) -> Option<f64> {
    match s {
        Surface::Sphere(s) => Some(s.radius),
        Surface::Cylinder(c) => Some(c.radius),
        Surface::Torus(t) => Some(t.minor_radius),
        _ => None,
    }
}

/// How far two surfaces are from a relation; `None` where they cannot have it.
pub fn deviation(kind: Kind, a: &Surface, b: &Surface) -> Option<f64> {
    let apart = place(a) - place(b);
    match kind {
        Kind::Parallel | Kind::Perpendicular => {
            let ((u, x), (v, y)) = (direction(a)?, direction(b)?);
            // an axis is parallel to the planes that its direction is perpendicular to the normals of
            let along = (kind == Kind::Parallel) == (x == y);
            Some(if along { u.cross(&v).norm() } else { u.dot(&v).abs() })
        }
        Kind::Coaxial => match (direction(a), direction(b)) {
            (Some((u, true)), Some((v, true))) => {
                Some(u.cross(&v).norm().max(u.cross(&apart).norm()))
            }
            (Some((u, true)), None) | (None, Some((u, true))) => Some(u.cross(&apart).norm()),
            _ => None,
        },
        Kind::Coplanar => match (direction(a)?, direction(b)?) {
            ((u, false), (v, false)) => Some(u.cross(&v).norm().max(u.dot(&apart).abs())),
            _ => None,
        },
        Kind::Concentric => (has_center(a) && has_center(b)).then_some(apart.norm()),
        Kind::EqualRadius => Some((radius(a)? - radius(b)?).abs()),
        Kind::EqualAngle => match (a, b) {
            (Surface::Cone(a), Surface::Cone(b)) => Some((a.half_angle - b.half_angle).abs()),
            _ => None,
        },
        Kind::Tangent => tangent(a, b),
        _ => None,
    }
}

/// How far two surfaces are from touching along a line.
fn tangent(a: &Surface, b: &Surface) -> Option<f64> {
    let apart = place(a) - place(b);
    match (a, b) {
        (Surface::Plane(p), Surface::Cylinder(c)) | (Surface::Cylinder(c), Surface::Plane(p)) => {
            let tilt = p.normal.dot(&c.axis_direction).abs();
            Some(tilt.max((p.normal.dot(&apart).abs() - c.radius).abs()))
        }
        (Surface::Plane(p), Surface::Sphere(s)) | (Surface::Sphere(s), Surface::Plane(p)) => {
            Some((p.normal.dot(&apart).abs() - s.radius).abs())
        }
        (Surface::Cylinder(c), Surface::Sphere(s)) | (Surface::Sphere(s), Surface::Cylinder(c)) => {
            Some(c.axis_direction.cross(&apart).norm().max((c.radius - s.radius).abs()))
        }
        (Surface::Cylinder(c), Surface::Cylinder(d)) => {
            let away = c.axis_direction.cross(&apart).norm();
            let gap =
                (away - c.radius - d.radius).abs().min((away - (c.radius - d.radius).abs()).abs());
            Some(c.axis_direction.cross(&d.axis_direction).norm().max(gap))
        }
        _ => None,
    }
}

/// The kinds that two surfaces can have by themselves.
pub const KINDS: [Kind; 8] = [
    Kind::Parallel,
    Kind::Perpendicular,
    Kind::Coaxial,
    Kind::Coplanar,
    Kind::Concentric,
    Kind::EqualRadius,
    Kind::EqualAngle,
    Kind::Tangent,
];

/// The relations of two true surfaces, tangent only where they touch.
pub fn truth(a: &Surface, b: &Surface, touching: bool) -> BTreeSet<Kind> {
    let holds = |k: &Kind| {
        (*k != Kind::Tangent || touching) && deviation(*k, a, b).is_some_and(|d| d < EXACT)
    };
    KINDS.into_iter().filter(holds).collect()
}

/// The pairs of regions, the smaller first, that a relation holds between.
pub fn pairs(relation: &Relation) -> Vec<[usize; 2]> {
    let ordered = |a: usize, b: usize| [a.min(b), a.max(b)];
    let all = &relation.regions;
    if relation.to.is_empty() {
        let before = |(k, &a): (usize, &usize)| {
            all[..k].iter().map(move |&b| ordered(a, b)).collect::<Vec<_>>()
        };
        all.iter().enumerate().flat_map(before).collect()
    } else {
        all.iter().flat_map(|&a| relation.to.iter().map(move |&b| ordered(a, b))).collect()
    }
}

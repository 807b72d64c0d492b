//! Equal radii, semi-axes and angles.

use nalgebra::{Matrix2, SMatrix, SVector, Vector1};

use super::cluster::cluster;
use super::constraint::{Constraint, Slot};
use super::estimate::Place;
use super::face::sizes_of;
use super::positions::common;
use super::search::{Search, part};
use super::told::RelationKind;
use crate::fit::Family;
use crate::fit::constant::constants;

constants! {
    /// How many times longer than another a radius in one scene may be; it may be anything there, each decade as likely as
    /// another.
    pub DECADES: f64 = 1e3, Derived("from a fillet of a thousandth of the part to the part");
}

/// Where the radius that others are compared with stands among a shape's sizes.
pub fn radius(family: Family) -> Option<usize> {
    match family {
        Family::Cylinder | Family::Sphere => Some(0),
        Family::Torus => Some(1),
        _ => None,
    }
}

/// Accepts which radii and angles are equal. Gives the groups of faces with equal radii.
pub fn equal(search: &mut Search) -> Vec<Vec<usize>> {
    let radii = of_kind(search, RelationKind::EqualRadius, radius);
    of_kind(search, RelationKind::EqualMajorRadius, |f| (f == Family::Torus).then_some(0));
    of_kind(search, RelationKind::EqualAngle, |f| (f == Family::Cone).then_some(1));
    semi_axes::<2>(search, Family::EllipticCylinder);
    semi_axes::<3>(search, Family::Ellipsoid);
    radii
}

fn of_kind(
    search: &mut Search,
    kind: RelationKind,
    size: impl Fn(Family) -> Option<usize>,
) -> Vec<Vec<usize>> {
    let slots: Vec<Slot> = (0..search.faces.len())
        .filter_map(|face| Some(Slot { face, size: size(search.faces[face].shape.family)? }))
        .collect();
    let item = |s: &Slot| {
        let face = &search.faces[s.face];
        let at = face.covariance.nrows() - sizes_of(face.shape.family) + s.size;
        let value = face.shape.size[s.size].abs();
        let volume = if kind == RelationKind::EqualAngle {
            std::f64::consts::FRAC_PI_2
        } else {
            value * DECADES.get().ln()
        };
        Place {
            x: Vector1::new(value),
            covariance: SMatrix::from_element(face.covariance[(at, at)]),
            drift: SMatrix::zeros(),
            direction: Matrix2::zeros(),
            volume,
        }
    };
    let items: Vec<Place<1>> = slots.iter().map(item).collect();
    let places: Vec<usize> = slots.iter().map(|s| s.face).collect();
    let unit = if kind == RelationKind::EqualAngle { 1.0 } else { search.frame.unit };
    let mut groups = Vec::new();
    for group in cluster(&items) {
        let bind = |hub: usize, m: usize| vec![Constraint::Equal([slots[hub], slots[m]])];
        if let Some(mut accepted) = common(search, kind, &places, &items, &group, bind) {
            accepted.relations[0].value = Some(group.value.x[0] * unit);
            let stayed =
                |f: &&usize| accepted.relations[0].regions.contains(&search.faces[**f].region);
            groups.push(places.iter().filter(stayed).copied().collect());
            search.tell(accepted);
        }
    }
    groups
}

/// All semi-axes of two ellipses or ellipsoids, in their logarithms, as the covariance has them.
fn semi_axes<const D: usize>(search: &mut Search, family: Family) {
    let places: Vec<usize> =
        (0..search.faces.len()).filter(|&f| search.faces[f].shape.family == family).collect();
    let item = |&f: &usize| {
        let face = &search.faces[f];
        let from = face.covariance.nrows() - D;
        Place {
            x: SVector::<f64, D>::from_fn(|i, _| face.shape.size[i].ln()),
            covariance: part::<D>(&face.covariance.view((from, from), (D, D)).into_owned()),
            drift: SMatrix::zeros(),
            direction: Matrix2::zeros(),
            volume: DECADES.get().ln().powi(D as i32),
        }
    };
    let items: Vec<Place<D>> = places.iter().map(item).collect();
    for group in cluster(&items) {
        let bind = |hub: usize, m: usize| {
            let slot = |face: usize, size: usize| Slot { face: places[face], size };
            (0..D).map(|k| Constraint::Equal([slot(hub, k), slot(m, k)])).collect()
        };
        if let Some(mut accepted) =
            common(search, RelationKind::EqualSemiAxes, &places, &items, &group, bind)
        {
            // deviations of logarithms are shares of the size
            let size = group.value.x[0].exp();
            accepted.relations[0].deviation *= size;
            accepted.relations[0].uncertainty *= size;
            search.tell(accepted);
        }
    }
}

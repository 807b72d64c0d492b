//! How exactly a surface's engineering parameters are known.

use crate::fit::constant::constants;
use crate::segment::report::motion::falling;
use nalgebra::DMatrix;
use serde_json::{Map, Value, json};

use crate::fit::feature::{Fixed, Lobes, Pose, untold};
use crate::fit::{Family, Held, Shape, Spread};
use crate::geometry::Vec3;
use crate::segment::report::motion::motions;

constants! {
    /// Points of a region whose derivatives are worth summing; of more, every n-th may stand for the rest.
    pub SAMPLE: usize = 60_000, Effort("points of one sum");
    /// A size whose standard deviation is over this share of its value cannot be told from zero or from
    /// infinity; so cannot an angle of this many radians.
    IDENTIFIABLE: f64 = 1.0 / 3.0, Derived("three standard deviations reach zero");
}

/// Standard deviations of the engineering parameters of a surface.
///
/// A point of an axis or plane is the one beside the points' centroid, so its deviation along the axis or
/// in the plane is zero. They are propagated from the covariance of an orthogonal-distance fit to
/// the region's points: see [`Spread::covariance`].
pub struct Uncertainty {
    /// The engineering parameters, by name, with the width of each in `covariance`.
    names: Vec<(&'static str, usize)>,
    /// Covariance of all components of the parameters, in the order of `names`.
    covariance: DMatrix<f64>,
    /// Covariance of the degrees of freedom, in the order of [`Shape::distance_jacobian`].
    pub of_freedoms: DMatrix<f64>,
    /// Parameters that the points cannot tell.
    unknown: Vec<&'static str>,
}

impl Uncertainty {
    /// That of `shape` fitted to points with noise `sigma`, of which each of `points` stands for `share` like
    /// it; none for fewer points than degrees of freedom.
    ///
    /// Lobes round an axis that stand out count as form that may have moved the surface (see [`Lobes`]).
    ///
    /// `shape` should have its origin beside the centroid of `points` (see [`Shape::recentred`]).
    pub fn of(shape: &Shape, points: &[Vec3], share: f64, sigma: f64) -> Option<Self> {
        Self::with(shape, points, share, sigma, &Held::default())
    }

    /// The same where something of the surface is `held`, known beforehand: that has no uncertainty, and what the points
    /// tell of the rest is the more.
    pub fn with(
        shape: &Shape,
        points: &[Vec3],
        share: f64,
        sigma: f64,
        held: &Held,
    ) -> Option<Self> {
        if points.len() <= shape.family.dof() {
            return None;
        }
        let free = held.freedoms(shape.family).map(|held| !held);
        let is_free = free.iter().take(shape.family.dof()).all(|free| *free);
        // lobes are taken out before the rest is asked what it has in common
        let lobes = if is_free { Lobes::about(shape, points) } else { None };
        let without = lobes.as_ref().map(|lobes| lobes.without(points));
        let points = without.as_deref().unwrap_or(points);
        let sigma = lobes.as_ref().map_or(sigma, |lobes| sigma.min(lobes.deviation));
        let spread = Spread::of(shape, points);
        let mut of_freedoms = spread.covariance_of(&free, sigma, share);
        if let Some(lobes) = &lobes {
            of_freedoms += &lobes.moved;
        }
        let names = names(shape.family);
        let columns: Vec<_> = motions(shape).iter().map(|m| m.parameters(shape)).collect();
        let change = DMatrix::from_columns(&columns);
        let covariance = &change * &of_freedoms * change.transpose();
        let finite = covariance.iter().all(|v| v.is_finite());
        let mut this = Self { names, covariance, of_freedoms, unknown: Vec::new() };
        this.unknown = this.not_told(shape);
        if is_free {
            let sq = sigma * sigma * spread.inflation(sigma, share) / share;
            let bent = this.bent(shape, points, sq);
            this.unknown.extend(
                bent.into_iter().filter(|name| !this.unknown.contains(name)).collect::<Vec<_>>(),
            );
        }
        finite.then_some(this)
    }

    /// The entry of a result: for each parameter its standard deviation (a number for a length or an angle
    /// and for the angle of a direction, one for each coordinate of a point and for each of a list),
    /// `covariance` with `covariance_of`, the parameters whose components its rows are, and
    /// `identifiable`, false where a radius, a semi-axis or an angle is not three standard deviations
    /// away from zero, a direction is known to no better than a third of a radian, or the sum of squares rises far less
    /// beside a size than its deviation says; then `not_identifiable` names the parameters.
    pub fn to_json(&self) -> Value {
        let mut out = Map::new();
        for (name, at, width) in self.places() {
            let deviations = self.deviations(name, at, width);
            let list = name.starts_with("semi_axis") || deviations.len() > 1;
            out.insert(name.into(), if list { json!(deviations) } else { json!(deviations[0]) });
        }
        let names: Vec<_> = self.names.iter().map(|n| n.0).collect();
        let rows: Vec<Vec<f64>> =
            self.covariance.row_iter().map(|r| r.iter().copied().collect()).collect();
        out.insert("covariance_of".into(), json!(names));
        out.insert("covariance".into(), json!(rows));
        out.insert("identifiable".into(), json!(self.unknown.is_empty()));
        if !self.unknown.is_empty() {
            out.insert("not_identifiable".into(), json!(self.unknown));
        }
        Value::Object(out)
    }

    /// Standard deviations of the parameter of that name, where the surface has it: see [`Uncertainty::to_json`].
    pub fn deviations_of(&self, name: &str) -> Option<Vec<f64>> {
        let (name, at, width) = self.places().find(|p| p.0 == name)?;
        Some(self.deviations(name, at, width))
    }

    /// Standard deviations of the components of a parameter; of a direction one, its angle's.
    fn deviations(&self, name: &str, at: usize, width: usize) -> Vec<f64> {
        let one = |k: usize| self.covariance[(k, k)].max(0.0).sqrt();
        if is_direction(name) {
            let angle = |k: usize| one(k).hypot(one(k + 1)).hypot(one(k + 2));
            (at..at + width).step_by(3).map(angle).collect()
        } else {
            (at..at + width).map(one).collect()
        }
    }

    /// Name, first row and width of each parameter.
    fn places(&self) -> impl Iterator<Item = (&'static str, usize, usize)> {
        self.names.iter().scan(0, |at, &(name, width)| {
            *at += width;
            Some((name, *at - width, width))
        })
    }

    /// The sizes that the points tell less well than the covariance says: see [`untold`]; `sq` is the variance of one point's distance,
    /// as much larger as what they have in common makes that of a sum.
    fn bent(&self, shape: &Shape, points: &[Vec3], sq: f64) -> Vec<&'static str> {
        let pose = Pose::of(shape);
        let free = Fixed::default().freedoms(pose.kind);
        let covariance = in_lengths(shape, &self.of_freedoms);
        let places = untold(&pose, points, &free, &covariance, |_| sq);
        let name = |slot: usize| match (shape.family, slot) {
            (Family::Sphere | Family::Cylinder, _) => "radius",
            (Family::Cone, _) => "half_angle",
            (Family::Torus, 6) => "major_radius",
            (Family::Torus, _) => "minor_radius",
            _ => "semi_axes",
        };
        let mut names: Vec<_> = places.into_iter().map(|a| name(free.slots()[a])).collect();
        names.dedup();
        names
    }

    fn not_told(&self, shape: &Shape) -> Vec<&'static str> {
        let told = |name: &str, deviations: &[f64]| match name {
            _ if is_direction(name) => deviations.iter().all(|d| *d < IDENTIFIABLE.get()),
            "radius" | "semi_axes" | "half_angle" => {
                deviations.iter().zip(sizes(shape)).all(|(d, size)| *d < size * IDENTIFIABLE.get())
            }
            "major_radius" => deviations[0] < shape.size[0] * IDENTIFIABLE.get(),
            "minor_radius" => deviations[0] < shape.size[1] * IDENTIFIABLE.get(),
            _ => true,
        };
        self.places()
            .filter(|&(name, at, width)| !told(name, &self.deviations(name, at, width)))
            .map(|p| p.0)
            .collect()
    }
}

/// Covariance of the places of a step of a [`Pose`], whose sizes change by lengths, from that of the degrees of freedom, of which
/// semi-axes change by shares.
fn in_lengths(shape: &Shape, of_freedoms: &DMatrix<f64>) -> DMatrix<f64> {
    let p = of_freedoms.nrows();
    let count = match shape.family {
        Family::EllipticCylinder => 2,
        Family::Ellipsoid => 3,
        _ => 0,
    };
    let unit = |a: usize| (a + count).checked_sub(p).map_or(1.0, |k| shape.size[k]);
    of_freedoms.map_with_location(|a, b, v| v * unit(a) * unit(b))
}

fn is_direction(name: &str) -> bool {
    matches!(name, "normal" | "axis_direction" | "semi_axis_directions")
}

/// The parameters of a family's surface in the order of its fields, with their number of components.
fn names(family: Family) -> Vec<(&'static str, usize)> {
    match family {
        Family::Plane => vec![("point", 3), ("normal", 3)],
        Family::Sphere => vec![("center", 3), ("radius", 1)],
        Family::Cylinder => vec![("axis_point", 3), ("axis_direction", 3), ("radius", 1)],
        Family::Cone => vec![("apex", 3), ("axis_direction", 3), ("half_angle", 1)],
        Family::EllipticCylinder => vec![
            ("axis_point", 3),
            ("axis_direction", 3),
            ("semi_axes", 2),
            ("semi_axis_directions", 6),
        ],
        Family::Ellipsoid => vec![("center", 3), ("semi_axes", 3), ("semi_axis_directions", 9)],
        Family::Torus => {
            vec![("center", 3), ("axis_direction", 3), ("major_radius", 1), ("minor_radius", 1)]
        }
    }
}

/// Radius, semi-axes (the larger first) or half angle.
fn sizes(shape: &Shape) -> Vec<f64> {
    match shape.family {
        Family::Plane | Family::Torus => Vec::new(),
        Family::Sphere | Family::Cylinder => vec![shape.size[0]],
        Family::Cone => vec![shape.size[1].abs()],
        Family::EllipticCylinder | Family::Ellipsoid => {
            falling(shape).iter().map(|&i| shape.size[i]).collect()
        }
    }
}

#[cfg(test)]
mod tests;

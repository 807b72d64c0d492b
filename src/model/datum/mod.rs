//! Datum systems after ISO 5459:2011: up to three surfaces of a part, one after the other, make a coordinate system.
//!
//! Of each surface the situation features count: the plane of a plane, the axis of a cylinder, the centre of a sphere, axis and
//! apex of a cone, and so on. The primary datum is taken as it is; each next one only in what those before left free, in the
//! orientation that these prescribe. A right angle or a parallel that is off by less than five degrees is meant as such.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::fit::constant::constants;
use crate::geometry::{Mat3, Surface, Vec3};

/// Most datums of a system.
pub const MAX_DATUMS: usize = 3;
/// Projectors that differ by less than this are the same.
const EXACT: f64 = 1e-9;

constants! {
    /// Angle, in radians, by which directions may be off from being square or parallel and are meant so: five degrees, between
    /// what parts are made to and what is drawn as an angle.
    SQUARE: f64 = 0.0873, Trial(0.035, 0.175);
    /// Places beside each other by less than this share of how far the datums extend tell no direction: what is drawn as one
    /// axis is off by less.
    BESIDE: f64 = 0.01, Trial(0.003, 0.03);
}

/// A datum system: where a part's own coordinate system lies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DatumSystem {
    /// The datums, the primary one first.
    pub datums: Vec<Datum>,
    /// The rows of the matrix that gives a place in the datum system from one in the input, (x, y, z, 1) each: a turn and a shift, right-handed. Its
    /// z axis is the first direction that the datums tell, its x axis the next. Null where they leave anything free.
    pub transform: Option<[[f64; 4]; 4]>,
    /// What they leave free, in words.
    pub free: Vec<String>,
    /// Why there is no transform, and what to do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

/// One datum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Datum {
    /// The region.
    pub region: usize,
    /// Its situation features: `plane`, `axis`, `point`.
    pub features: Vec<String>,
    /// How far its direction is turned, in radians, to be square or parallel to those before; null where it has none or
    /// tells a direction itself.
    pub turned: Option<f64>,
}

/// A situation feature.
#[derive(Clone, Copy, Debug)]
enum Feature {
    Plane { point: Vec3, normal: Vec3 },
    Axis { point: Vec3, direction: Vec3 },
    Point(Vec3),
}

impl Feature {
    fn name(&self) -> &'static str {
        match self {
            Self::Plane { .. } => "plane",
            Self::Axis { .. } => "axis",
            Self::Point(_) => "point",
        }
    }

    fn direction(&self) -> Option<Vec3> {
        match *self {
            Self::Plane { normal, .. } => Some(normal),
            Self::Axis { direction, .. } => Some(direction),
            Self::Point(_) => None,
        }
    }

    fn place(&self) -> Vec3 {
        match *self {
            Self::Plane { point, .. } | Self::Axis { point, .. } | Self::Point(point) => point,
        }
    }

    /// The directions in which it tells a place, `along` being its direction as the system has it.
    fn tells(&self, along: &Vec3) -> Mat3 {
        let square = along * along.transpose();
        match self {
            Self::Plane { .. } => square,
            Self::Axis { .. } => Mat3::identity() - square,
            Self::Point(_) => Mat3::identity(),
        }
    }
}

/// The situation features of a surface, those first that a drawing would mean.
fn features(surface: &Surface) -> Vec<Feature> {
    let axis = |point, direction| Feature::Axis { point, direction };
    match surface {
        Surface::Plane(s) => vec![Feature::Plane { point: s.point, normal: s.normal }],
        Surface::Sphere(s) => vec![Feature::Point(s.center)],
        Surface::Cylinder(s) => vec![axis(s.axis_point, s.axis_direction)],
        Surface::Cone(s) => vec![axis(s.apex, s.axis_direction), Feature::Point(s.apex)],
        Surface::Torus(s) => vec![axis(s.center, s.axis_direction), Feature::Point(s.center)],
        Surface::EllipticCylinder(s) => vec![
            axis(s.axis_point, s.axis_direction),
            Feature::Plane { point: s.axis_point, normal: s.semi_axis_directions[0] },
        ],
        Surface::Ellipsoid(s) => vec![
            Feature::Point(s.center),
            axis(s.center, s.semi_axis_directions[0]),
            Feature::Plane { point: s.center, normal: s.semi_axis_directions[1] },
        ],
    }
}

/// The largest radius or semi-axis of a surface; 0 of those that have none.
fn radius(surface: &Surface) -> f64 {
    match surface {
        Surface::Plane(_) | Surface::Cone(_) => 0.0,
        Surface::Sphere(s) => s.radius,
        Surface::Cylinder(s) => s.radius,
        Surface::Torus(s) => s.major_radius + s.minor_radius,
        Surface::EllipticCylinder(s) => s.semi_axes[0],
        Surface::Ellipsoid(s) => s.semi_axes[0],
    }
}

/// What the datums have told so far.
struct State {
    z: Option<Vec3>,
    x: Option<Vec3>,
    origin: Vec3,
    /// The directions in which the origin is known, as the projector on them.
    known: Mat3,
    /// How far the datums extend.
    size: f64,
}

impl State {
    /// The direction of a feature as the system has it, and by how much it is turned for that.
    fn direction(&self, of: &Feature) -> (Vec3, Option<f64>) {
        let (Some(w), Some(z)) = (of.direction(), self.z) else {
            return (of.direction().unwrap_or_default(), None);
        };
        let across = |v: Vec3| (v - z * z.dot(&v)).try_normalize(0.0);
        let turn = |to: Vec3| Some(w.cross(&to).norm().atan2(w.dot(&to).abs()));
        let off = w.cross(&z).norm().atan2(w.dot(&z).abs());
        if off < SQUARE.get() {
            return (z, turn(z));
        }
        let is_square = std::f64::consts::FRAC_PI_2 - off < SQUARE.get();
        // What is square to z is so in the system; if x is known, it is along x or y where it is nearly.
        let flat = across(w).unwrap_or(w);
        let Some(x) = self.x else {
            return if is_square { (flat, turn(flat)) } else { (w, None) };
        };
        for near in [x, z.cross(&x)] {
            let off = flat.cross(&near).norm().atan2(flat.dot(&near).abs());
            if is_square && off < SQUARE.get() {
                return (near, turn(near));
            }
        }
        if is_square { (flat, turn(flat)) } else { (w, None) }
    }

    /// Takes in what a feature tells of directions.
    fn orient(&mut self, feature: &Feature) {
        let away = feature.place() - self.origin;
        let is_away = |v: &Vec3| v.norm() > BESIDE.get() * self.size;
        let is_point = (self.known - Mat3::identity()).norm() < EXACT;
        if self.z.is_none() {
            let line = (is_point && is_away(&away)).then(|| away.normalize());
            self.z = feature.direction().or(line);
            if self.z.is_none() || !is_point || feature.direction().is_none() {
                return;
            }
            // a direction beside a point tells a second one too, below
        }
        let (Some(z), None) = (self.z, self.x) else { return };
        let off = feature.direction().map(|w| w.cross(&z).norm().atan2(w.dot(&z).abs()));
        if off.is_some_and(|off| off >= SQUARE.get()) {
            self.x = feature.direction().and_then(|w| (w - z * z.dot(&w)).try_normalize(0.0));
            return;
        }
        // Two places across z tell where x points.
        let across = Mat3::identity() - z * z.transpose();
        let is_known_across = (across * self.known * across - across).norm() < EXACT;
        let tells = feature.tells(&z);
        let step = across * (tells * away);
        if is_known_across && !matches!(feature, Feature::Plane { .. }) && is_away(&step) {
            self.x = Some(step.normalize());
        }
    }

    /// Takes in what a feature tells of the origin: least squares in what is not known.
    fn place(&mut self, feature: &Feature, along: &Vec3) {
        let tells = feature.tells(along);
        let open = Mat3::identity() - self.known;
        let svd = (tells * open).svd(true, true);
        let (Some(u), Some(v)) = (svd.u, svd.v_t) else { return };
        let away = tells * (feature.place() - self.origin);
        for k in 0..3 {
            // what is told at less than five degrees is not meant
            if svd.singular_values[k] > SQUARE.get().sin() {
                let direction = v.row(k).transpose();
                self.origin += direction * (u.column(k).dot(&away) / svd.singular_values[k]);
                self.known += direction * direction.transpose();
            }
        }
    }

    /// The motions that are left, in words.
    fn free(&self) -> Vec<String> {
        let mut out = Vec::new();
        let e = (Mat3::identity() - self.known).symmetric_eigen();
        for k in (0..3).filter(|&k| e.eigenvalues[k] > 0.5) {
            out.push(format!("shift along {}", told(&e.eigenvectors.column(k).into_owned())));
        }
        match (self.z, self.x) {
            (None, _) => out.push("every rotation".to_owned()),
            (Some(z), None) => out.push(format!("rotation about {}", told(&z))),
            _ => {}
        }
        out
    }

    fn transform(&self) -> Option<[[f64; 4]; 4]> {
        let (z, x) = (self.z?, self.x?);
        let y = z.cross(&x).normalize();
        let x = y.cross(&z);
        let row = |axis: Vec3| [axis.x, axis.y, axis.z, -axis.dot(&self.origin)];
        Some([row(x), row(y), row(z), [0.0, 0.0, 0.0, 1.0]])
    }
}

/// A direction in words; either way is meant.
fn told(v: &Vec3) -> String {
    let d = v * v[v.iamax()].signum();
    let d = d.map(|c| if c.abs() < 5e-4 { 0.0 } else { c });
    format!("[{:.3}, {:.3}, {:.3}]", d.x, d.y, d.z)
}

/// The system of some regions' surfaces, the primary datum first; a region without a surface is told as `None`.
pub fn datum_system(datums: &[(usize, Option<Surface>)]) -> DatumSystem {
    let mut all = Vec::new();
    for (region, surface) in datums {
        let Some(surface) = surface else {
            let refused = format!(
                "region {region} is none of the result, or has no surface: name regions by their ids"
            );
            return refused_system(all, refused);
        };
        all.push((*region, features(surface)));
    }
    let origin = all.first().map_or_else(Vec3::zeros, |d| d.1[0].place());
    let apart = all.iter().flat_map(|d| &d.1).map(|f| (f.place() - origin).norm());
    let radii = datums.iter().filter_map(|d| d.1.as_ref()).map(radius);
    let size = apart.chain(radii).fold(0.0, f64::max);
    let mut state = State { z: None, x: None, origin, known: Mat3::zeros(), size };
    let mut told = Vec::new();
    for (region, features) in &all {
        let mut turned = None;
        for feature in features {
            let (along, turn) = state.direction(feature);
            turned = turned.or(turn);
            state.orient(feature);
            state.place(feature, &along);
        }
        let names = features.iter().map(|f| f.name().to_owned()).collect();
        told.push(Datum { region: *region, features: names, turned });
    }
    let free = state.free();
    if !free.is_empty() {
        let refused = format!(
            "the datums leave free: {}. Name a further one that is not alike, such as a plane across or a second axis",
            free.join(", ")
        );
        return DatumSystem { datums: told, transform: None, free, refused: Some(refused) };
    }
    DatumSystem { datums: told, transform: state.transform(), free, refused: None }
}

fn refused_system(datums: Vec<(usize, Vec<Feature>)>, refused: String) -> DatumSystem {
    let datums = datums.into_iter().map(|(region, features)| Datum {
        region,
        features: features.iter().map(|f| f.name().to_owned()).collect(),
        turned: None,
    });
    let free = Vec::new();
    DatumSystem { datums: datums.collect(), transform: None, free, refused: Some(refused) }
}

#[cfg(test)]
mod tests;

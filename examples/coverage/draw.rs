//! Points of a feature with a known truth.

use std::f64::consts::TAU;

use conicoid::fit::feature::{Asked, Association, FeatureType, Fixed, Pose, assess};
use conicoid::geometry::Vec3;
use nalgebra::{Rotation3, Unit};

use crate::noise::{Drawn, Noise, Place, STEP};
use crate::random::Random;
use crate::score::Score;

/// Radius of the features, half the side of planes, lines, and the height of cylinders.
pub const RADIUS: f64 = 10.0;
/// Half angle of the cone in degrees, smaller semi-axes, and minor radius over the major one.
const HALF_ANGLE: f64 = 20.0;
const SEMI_AXES: [f64; 2] = [0.6, 0.75];
const MINOR: f64 = 0.3;
/// Furthest that a draw is moved.
const AWAY: f64 = 100.0;
/// Coverage of the expanded uncertainties.
const COVERAGE: f64 = 0.9545;

/// How points lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// At random, evenly.
    Even,
    /// Along lines, one after the other.
    Scan,
}

impl Sampling {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Even, Self::Scan];

    /// The name.
    pub fn name(self) -> &'static str {
        if self == Self::Even { "even" } else { "scan" }
    }

    /// The sampling of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }
}

/// One combination of all that is varied.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    pub kind: FeatureType,
    pub arc: f64,
    /// Over the radius.
    pub sigma: f64,
    pub n: usize,
    pub noise: Noise,
    pub sampling: Sampling,
}

impl Cell {
    /// Where the random numbers of its draws begin: no two cells have the same.
    pub fn seed(&self, seed: u64) -> u64 {
        let name = format!("{self:?}{seed}");
        // Fowler, Noll and Vo's hash
        name.bytes().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
        })
    }

    /// What a fit to points of that seed is worth.
    pub fn drawn(&self, seed: u64) -> Score {
        let random = &mut Random::new(seed);
        let (points, truth) = self.points(random);
        let asked = Asked {
            kind: Some(self.kind),
            association: Association::Gaussian,
            fixed: Fixed::default(),
            outliers: None,
            type_b: 0.0,
            coverage: COVERAGE,
        };
        assess(&points, &asked).map_or_else(|_| Score::default(), |found| Score::of(&found, &truth))
    }

    fn points(&self, random: &mut Random) -> (Vec<Vec3>, Pose) {
        let axis = Unit::new_normalize(random.normals());
        let turn = Rotation3::from_axis_angle(&axis, random.uniform(0.0, TAU));
        let away = Vec3::from_fn(|_, _| random.uniform(-AWAY, AWAY));
        let sigma = self.sigma * RADIUS;
        let drawn = Drawn::new(self.noise, sigma, random);
        let points = self.places(random).into_iter().map(|(u, v)| {
            let at = turn * drawn.point(&self.place(u, v), random) + away;
            if self.noise == Noise::Stepped { rounded(&at, STEP * sigma) } else { at }
        });
        let points = points.collect();
        let local = self.truth();
        let frame = turn.matrix() * local.frame;
        (points, Pose { origin: turn * local.origin + away, frame, ..local })
    }

    /// The feature in its own frame.
    fn truth(&self) -> Pose {
        use FeatureType as T;
        let [b, c] = SEMI_AXES.map(|a| a * RADIUS);
        let size = match self.kind {
            T::Plane | T::Line => [0.0; 3],
            T::Sphere | T::Cylinder | T::Circle => [RADIUS, 0.0, 0.0],
            T::Cone => [RADIUS, HALF_ANGLE.to_radians(), 0.0],
            T::EllipticCylinder => [RADIUS, b, 0.0],
            T::Ellipsoid => [RADIUS, c, 0.5 * RADIUS],
            T::Torus => [RADIUS, MINOR * RADIUS, 0.0],
        };
        let frame = nalgebra::Matrix3::identity();
        Pose { kind: self.kind, origin: Vec3::zeros(), frame, size }
    }

    /// Where points lie, along and across lines, each from zero to one.
    fn places(&self, random: &mut Random) -> Vec<(f64, f64)> {
        if self.sampling == Sampling::Even {
            return (0..self.n)
                .map(|_| (random.uniform(0.0, 1.0), random.uniform(0.0, 1.0)))
                .collect();
        }
        let is_curve = matches!(self.kind, FeatureType::Circle | FeatureType::Line);
        // four times as many along a line as there are lines
        let lines = if is_curve { 1 } else { (0.5 * (self.n as f64).sqrt()).round() as usize };
        let along = self.n / lines;
        let middle = |k: usize, of: usize| (k as f64 + 0.5) / of as f64;
        (0..lines)
            .flat_map(|l| (0..along).map(move |k| (middle(k, along), middle(l, lines))))
            .collect()
    }

    fn place(&self, u: f64, v: f64) -> Place {
        use FeatureType as T;
        let size = self.truth().size;
        let angle = (u - 0.5) * self.arc.to_radians();
        let (sin, cos) = angle.sin_cos();
        let out = Vec3::new(cos, sin, 0.0);
        let up = Vec3::z() * (RADIUS * (2.0 * v - 1.0));
        let one = |at: Vec3, normal: Vec3| Place { at, angle, lobes: 1.0, normals: vec![normal] };
        match self.kind {
            T::Plane => {
                let at = Vec3::new(2.0 * u - 1.0, 2.0 * v - 1.0, 0.0) * RADIUS;
                Place { angle: TAU * u, ..one(at, Vec3::z()) }
            }
            T::Line => {
                let at = Vec3::z() * (RADIUS * (2.0 * u - 1.0));
                let normals = vec![Vec3::x(), Vec3::y()];
                Place { angle: TAU * u, normals, ..one(at, Vec3::x()) }
            }
            T::Circle => Place { normals: vec![out, Vec3::z()], ..one(out * RADIUS, out) },
            T::Cylinder => one(out * RADIUS + up, out),
            T::Cone => {
                let (s, c) = size[1].sin_cos();
                one(out * (RADIUS + up.z * s / c) + up, out * c - Vec3::z() * s)
            }
            T::EllipticCylinder => {
                let at = Vec3::new(size[0] * cos, size[1] * sin, 0.0);
                one(at + up, Vec3::new(cos / size[0], sin / size[1], 0.0).normalize())
            }
            T::Torus => {
                let (s, c) = (TAU * v).sin_cos();
                let normal = out * c + Vec3::z() * s;
                one(out * size[0] + normal * size[1], normal)
            }
            T::Sphere | T::Ellipsoid => {
                let axes = if self.kind == T::Sphere { [RADIUS; 3] } else { size };
                self.cap(u, v, axes)
            }
        }
    }

    /// A place of a cap about the x axis; its lobes are about the z axis.
    fn cap(&self, u: f64, v: f64, axes: [f64; 3]) -> Place {
        let x = 1.0 - v * (1.0 - (0.5 * self.arc.to_radians()).cos());
        let rho = (1.0 - x * x).max(0.0).sqrt();
        let (sin, cos) = (TAU * u).sin_cos();
        let unit = Vec3::new(x, rho * cos, rho * sin);
        let axes = Vec3::from(axes);
        let normal = unit.component_div(&axes).normalize();
        // those that a smooth surface has: none at the poles
        let lobes = (1.0 - unit.z * unit.z).max(0.0).powf(1.5);
        let at = unit.component_mul(&axes);
        Place { at, angle: unit.y.atan2(unit.x), lobes, normals: vec![normal] }
    }
}

fn rounded(at: &Vec3, step: f64) -> Vec3 {
    at.map(|c| (c / step).round() * step)
}

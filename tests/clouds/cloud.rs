use conicoid::geometry::{
    Cone, Cylinder, Ellipsoid, EllipticCylinder, Plane, PointCloud, Sphere, Surface, Vec3,
};
use nalgebra::Rotation3;

use super::{Patch, Random};

/// Label of a point that belongs to no quadric.
pub const NO_QUADRIC: i32 = -1;
/// Label of a point that no score counts: its surface has too few points.
pub const NOT_SCORED: i32 = -2;

/// A surface of a cloud's truth.
#[derive(Clone, Debug)]
pub struct TrueSurface {
    /// The surface.
    pub surface: Surface,
    /// How many points lie on it.
    pub points: usize,
}

/// A cloud and its truth. The surfaces' places are their labels.
#[derive(Clone, Debug)]
pub struct Cloud {
    pub name: String,
    pub points: Vec<Vec3>,
    pub labels: Vec<i32>,
    pub surfaces: Vec<TrueSurface>,
    /// Standard deviation of the noise, in every coordinate.
    pub sigma: f64,
}

impl Cloud {
    /// Joins patches into a cloud: equal surfaces become one, those below `min_points` are not scored,
    /// noise is added and the points are shuffled.
    pub fn assemble(
        name: &str,
        patches: Vec<Patch>,
        sigma: f64,
        min_points: usize,
        random: &mut Random,
    ) -> Self {
        let mut groups: Vec<(Option<Surface>, Vec<Vec3>)> = Vec::new();
        for patch in patches {
            match groups.iter_mut().find(|(truth, _)| same(truth.as_ref(), patch.truth.as_ref())) {
                Some((_, points)) => points.extend(patch.points),
                None => groups.push((patch.truth, patch.points)),
            }
        }
        let (mut labelled, mut surfaces) = (Vec::new(), Vec::new());
        for (truth, points) in groups {
            let label = match truth {
                None => NO_QUADRIC,
                Some(_) if points.len() < min_points => NOT_SCORED,
                Some(surface) => {
                    surfaces.push(TrueSurface { surface, points: points.len() });
                    surfaces.len() as i32 - 1
                }
            };
            labelled.extend(points.into_iter().map(|p| (p, label)));
        }
        random.shuffle(&mut labelled);
        let (points, labels) =
            labelled.into_iter().map(|(p, label)| (p + sigma * random.normal3(), label)).unzip();
        Self { name: name.into(), points, labels, surfaces, sigma }
    }

    /// The points alone, as the library takes them.
    pub fn input(&self) -> PointCloud {
        PointCloud::from_points(self.points.clone())
    }

    /// The same cloud with noise on top that neighbours share: a normal field of that deviation in every coordinate whose
    /// correlation falls to 0.6 over `length`.
    pub fn waving(mut self, deviation: f64, length: f64, random: &mut Random) -> Self {
        const WAVES: usize = 200;
        let scale = deviation * (2.0 / WAVES as f64).sqrt();
        for k in 0..3 {
            let mut wave = || {
                let phase = random.uniform(0.0, std::f64::consts::TAU);
                (random.normal3() / length, phase)
            };
            let waves: Vec<(Vec3, f64)> = (0..WAVES).map(|_| wave()).collect();
            let at =
                |p: &Vec3| waves.iter().map(|(w, phase)| (w.dot(p) + phase).cos()).sum::<f64>();
            let field: Vec<f64> = self.points.iter().map(|p| scale * at(p)).collect();
            self.points.iter_mut().zip(field).for_each(|(p, f)| p[k] += f);
        }
        Self { sigma: self.sigma.hypot(deviation), ..self }
    }

    /// The same cloud with noise `factor` times as large on every third of its surfaces.
    pub fn with_rough_faces(mut self, factor: f64, random: &mut Random) -> Self {
        let more = self.sigma * (factor * factor - 1.0).sqrt();
        for (p, label) in self.points.iter_mut().zip(&self.labels) {
            if *label >= 0 && label % 3 == 0 {
                *p += more * random.normal3();
            }
        }
        self
    }

    /// The same cloud rotated about the origin, then shifted.
    pub fn moved(&self, rotation: &Rotation3<f64>, shift: &Vec3) -> Self {
        let surfaces = self.surfaces.iter().map(|s| TrueSurface {
            surface: moved_surface(&s.surface, rotation, shift),
            points: s.points,
        });
        Self {
            points: self.points.iter().map(|p| rotation * p + shift).collect(),
            surfaces: surfaces.collect(),
            ..self.clone()
        }
    }
}

/// `surface` rotated about the origin, then shifted.
pub fn moved_surface(surface: &Surface, rotation: &Rotation3<f64>, shift: &Vec3) -> Surface {
    let point = |p: &Vec3| rotation * p + shift;
    let turn = |d: &Vec3| rotation * d;
    match surface {
        Surface::Plane(s) => {
            Surface::Plane(Plane { point: point(&s.point), normal: turn(&s.normal) })
        }
        Surface::Sphere(s) => Surface::Sphere(Sphere { center: point(&s.center), ..*s }),
        Surface::Cylinder(s) => Surface::Cylinder(Cylinder {
            axis_point: point(&s.axis_point),
            axis_direction: turn(&s.axis_direction),
            ..*s
        }),
        Surface::EllipticCylinder(s) => Surface::EllipticCylinder(EllipticCylinder {
            axis_point: point(&s.axis_point),
            axis_direction: turn(&s.axis_direction),
            semi_axis_directions: s.semi_axis_directions.map(|d| turn(&d)),
            ..*s
        }),
        Surface::Cone(s) => Surface::Cone(Cone {
            apex: point(&s.apex),
            axis_direction: turn(&s.axis_direction),
            ..*s
        }),
        Surface::Ellipsoid(s) => Surface::Ellipsoid(Ellipsoid {
            center: point(&s.center),
            semi_axis_directions: s.semi_axis_directions.map(|d| turn(&d)),
            ..*s
        }),
    }
}

/// Whether two patches lie on one surface (coplanar faces, coaxial equal cylinders).
fn same(a: Option<&Surface>, b: Option<&Surface>) -> bool {
    const NEAR: f64 = 1e-7;
    let parallel = |u: &Vec3, v: &Vec3| u.cross(v).norm() < NEAR;
    match (a, b) {
        (None, None) => true,
        (Some(Surface::Plane(a)), Some(Surface::Plane(b))) => {
            parallel(&a.normal, &b.normal) && a.normal.dot(&(a.point - b.point)).abs() < NEAR
        }
        (Some(Surface::Sphere(a)), Some(Surface::Sphere(b))) => {
            (a.center - b.center).norm() < NEAR && (a.radius - b.radius).abs() < NEAR
        }
        (Some(Surface::Cylinder(a)), Some(Surface::Cylinder(b))) => {
            parallel(&a.axis_direction, &b.axis_direction)
                && a.axis_direction.cross(&(a.axis_point - b.axis_point)).norm() < NEAR
                && (a.radius - b.radius).abs() < NEAR
        }
        (Some(Surface::Cone(a)), Some(Surface::Cone(b))) => {
            (a.apex - b.apex).norm() < NEAR
                && parallel(&a.axis_direction, &b.axis_direction)
                && (a.half_angle - b.half_angle).abs() < NEAR
        }
        _ => false,
    }
}

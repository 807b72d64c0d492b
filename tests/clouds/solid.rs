//! Solids, and parts made of them by adding and cutting.
//!
//! A face's points stay where the part changes from inside to outside across them, so every trim (a
//! hole in a plate, a chamfer's ring, what is left of a fillet's torus) follows from the solids alone.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use conicoid::geometry::{
    Cone, Cylinder, Ellipsoid, Plane, Sphere, Surface, Vec3, perpendicular_frame,
};

use super::{Patch, Random};

/// A point and the unit normal there.
type Sampled = (Vec3, Vec3);

/// A piece of a solid's boundary that can be sampled with even density.
pub struct Face {
    truth: Option<Surface>,
    area: f64,
    sample: Box<dyn Fn(&mut Random) -> Sampled>,
}

/// A body with an inside and faces.
pub trait Solid {
    /// Whether `p` lies inside.
    fn contains(&self, p: &Vec3) -> bool;
    /// Its boundary.
    fn faces(&self) -> Vec<Face>;
}

/// A part: solids added and cut, in order.
#[derive(Default)]
pub struct Part {
    steps: Vec<(bool, Box<dyn Solid>)>,
}

impl Part {
    /// Adds a solid.
    pub fn add(&mut self, solid: impl Solid + 'static) -> &mut Self {
        self.steps.push((true, Box::new(solid)));
        self
    }

    /// Takes a solid away from what is there so far.
    pub fn cut(&mut self, solid: impl Solid + 'static) -> &mut Self {
        self.steps.push((false, Box::new(solid)));
        self
    }

    fn contains(&self, p: &Vec3) -> bool {
        self.steps
            .iter()
            .rev()
            .find(|(_, solid)| solid.contains(p))
            .is_some_and(|(added, _)| *added)
    }

    /// About `n` points spread evenly over the part's surface, one patch a face.
    pub fn sample(&self, n: usize, random: &mut Random) -> Vec<Patch> {
        let pilot = self.sample_density(20_000.0 / self.face_area(), random);
        let kept: usize = pilot.iter().map(|p| p.points.len()).sum();
        let density = 20_000.0 / self.face_area() * n as f64 / kept.max(1) as f64;
        self.sample_density(density, random)
    }

    /// The volume: the share of about `cells` cells around the part that hold a random place of theirs inside of it.
    pub fn volume(&self, cells: usize, random: &mut Random) -> f64 {
        let points: Vec<Vec3> =
            self.sample(20_000, random).into_iter().flat_map(|p| p.points).collect();
        let low = points.iter().fold(Vec3::repeat(f64::INFINITY), |m, p| m.inf(p)).add_scalar(-0.5);
        let high =
            points.iter().fold(Vec3::repeat(f64::NEG_INFINITY), |m, p| m.sup(p)).add_scalar(0.5);
        let side = ((high - low).product() / cells as f64).cbrt();
        let counts = (high - low).map(|d| (d / side).ceil());
        let step = (high - low).component_div(&counts);
        let mut inside = 0usize;
        for i in 0..counts.x as usize {
            for j in 0..counts.y as usize {
                for k in 0..counts.z as usize {
                    let mut at = |k: usize| k as f64 + random.uniform(0.0, 1.0);
                    let cell = Vec3::new(at(i), at(j), at(k));
                    inside += usize::from(self.contains(&(low + cell.component_mul(&step))));
                }
            }
        }
        inside as f64 * step.product()
    }

    fn face_area(&self) -> f64 {
        self.steps.iter().flat_map(|(_, s)| s.faces()).map(|f| f.area).sum()
    }

    fn sample_density(&self, density: f64, random: &mut Random) -> Vec<Patch> {
        const STEP: f64 = 1e-6;
        let faces = self.steps.iter().flat_map(|(_, s)| s.faces());
        let patch = |face: Face| {
            let points = (0..random.round(face.area * density)).filter_map(|_| {
                let (p, normal) = (face.sample)(random);
                let crosses =
                    self.contains(&(p - STEP * normal)) != self.contains(&(p + STEP * normal));
                crosses.then_some(p)
            });
            Patch { points: points.collect(), truth: face.truth }
        };
        faces.map(patch).filter(|p| !p.points.is_empty()).collect()
    }
}

fn disc(center: Vec3, normal: Vec3, radius: f64) -> Face {
    let (u, v) = perpendicular_frame(&normal);
    let sample = move |random: &mut Random| {
        let (sin, cos) = random.uniform(0.0, TAU).sin_cos();
        (center + radius * random.uniform(0.0, 1.0).sqrt() * (cos * u + sin * v), normal)
    };
    let truth = Some(Surface::Plane(Plane { point: center, normal }));
    Face { truth, area: PI * radius * radius, sample: Box::new(sample) }
}

/// A rectangle about `center` with half sides `e1` and `e2`.
fn rectangle(center: Vec3, e1: Vec3, e2: Vec3) -> Option<Face> {
    let area = 4.0 * e1.norm() * e2.norm();
    if area < 1e-9 {
        return None;
    }
    let normal = e1.cross(&e2).normalize();
    let sample = move |random: &mut Random| {
        (center + random.uniform(-1.0, 1.0) * e1 + random.uniform(-1.0, 1.0) * e2, normal)
    };
    let truth = Some(Surface::Plane(Plane { point: center, normal }));
    Some(Face { truth, area, sample: Box::new(sample) })
}

/// A cylinder's side from `base` along `axis`, over a sector from `u` to `v`, a quarter turn later.
fn cylinder_side(
    base: Vec3,
    [u, v, axis]: [Vec3; 3],
    radius: f64,
    length: f64,
    sweep: f64,
) -> Face {
    let sample = move |random: &mut Random| {
        let (sin, cos) = random.uniform(0.0, sweep).sin_cos();
        let normal = cos * u + sin * v;
        (base + radius * normal + random.uniform(0.0, length) * axis, normal)
    };
    let truth = Cylinder { axis_point: base, axis_direction: axis, radius };
    let area = sweep * radius * length;
    Face { truth: Some(Surface::Cylinder(truth)), area, sample: Box::new(sample) }
}

fn frame_of(axis: Vec3) -> [Vec3; 3] {
    let (u, v) = perpendicular_frame(&axis);
    [u, v, axis]
}

/// A right circular cylinder with flat ends.
pub struct Rod {
    pub base: Vec3,
    /// Unit axis.
    pub axis: Vec3,
    pub radius: f64,
    pub length: f64,
}

impl Solid for Rod {
    fn contains(&self, p: &Vec3) -> bool {
        let d = p - self.base;
        let h = d.dot(&self.axis);
        (0.0..=self.length).contains(&h) && (d - h * self.axis).norm() <= self.radius
    }

    fn faces(&self) -> Vec<Face> {
        vec![
            cylinder_side(self.base, frame_of(self.axis), self.radius, self.length, TAU),
            disc(self.base, self.axis, self.radius),
            disc(self.base + self.length * self.axis, self.axis, self.radius),
        ]
    }
}

/// A cone between two distances from its apex along the axis, with flat ends.
pub struct Taper {
    pub apex: Vec3,
    /// Unit axis from the apex into the cone.
    pub axis: Vec3,
    pub half_angle: f64,
    pub heights: [f64; 2],
}

impl Solid for Taper {
    fn contains(&self, p: &Vec3) -> bool {
        let d = p - self.apex;
        let h = d.dot(&self.axis);
        (self.heights[0]..=self.heights[1]).contains(&h)
            && (d - h * self.axis).norm() <= h * self.half_angle.tan()
    }

    fn faces(&self) -> Vec<Face> {
        let (apex, half_angle, [h0, h1]) = (self.apex, self.half_angle, self.heights);
        let [u, v, w] = frame_of(self.axis);
        let sample = move |random: &mut Random| {
            let h = random.uniform(h0 * h0, h1 * h1).sqrt();
            let (sin, cos) = random.uniform(0.0, TAU).sin_cos();
            let radial = cos * u + sin * v;
            let normal = half_angle.cos() * radial - half_angle.sin() * w;
            (apex + h * w + h * half_angle.tan() * radial, normal)
        };
        let area = PI * half_angle.tan() * (h1 * h1 - h0 * h0) / half_angle.cos();
        let truth = Some(Surface::Cone(Cone { apex, axis_direction: w, half_angle }));
        let end = |h: f64| disc(apex + h * w, w, h * half_angle.tan());
        vec![Face { truth, area, sample: Box::new(sample) }, end(h0), end(h1)]
    }
}

/// A ball.
pub struct Ball {
    pub center: Vec3,
    pub radius: f64,
}

impl Solid for Ball {
    fn contains(&self, p: &Vec3) -> bool {
        (p - self.center).norm() <= self.radius
    }

    fn faces(&self) -> Vec<Face> {
        vec![sphere_part(self.center, self.radius, |_| true, 4.0 * PI)]
    }
}

fn sphere_part(
    center: Vec3,
    radius: f64,
    keep: impl Fn(&Vec3) -> bool + 'static,
    solid_angle: f64,
) -> Face {
    let sample = move |random: &mut Random| {
        loop {
            let d = random.direction();
            if keep(&d) {
                return (center + radius * d, d);
            }
        }
    };
    let truth = Some(Surface::Sphere(Sphere { center, radius }));
    Face { truth, area: solid_angle * radius * radius, sample: Box::new(sample) }
}

/// An ellipsoid along the coordinate axes.
pub struct Egg {
    pub center: Vec3,
    /// Semi-axes along x, y and z.
    pub semi_axes: Vec3,
}

impl Solid for Egg {
    fn contains(&self, p: &Vec3) -> bool {
        (p - self.center).component_div(&self.semi_axes).norm() <= 1.0
    }

    fn faces(&self) -> Vec<Face> {
        let (center, a) = (self.center, self.semi_axes);
        let inverse = a.map(|a| 1.0 / a);
        let sample = move |random: &mut Random| {
            loop {
                let d = random.direction();
                let gradient = d.component_mul(&inverse);
                if random.uniform(0.0, inverse.max()) < gradient.norm() {
                    return (center + d.component_mul(&a), gradient.normalize());
                }
            }
        };
        // Thomsen's approximation, within 1.1 %
        let power = |x: f64, y: f64| (x * y).powf(1.6075);
        let mean = (power(a.x, a.y) + power(a.y, a.z) + power(a.z, a.x)) / 3.0;
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| a[j].total_cmp(&a[i]));
        let mut directions = order.map(|i| Vec3::ith(i, 1.0));
        directions[2] = directions[0].cross(&directions[1]);
        let truth =
            Ellipsoid { center, semi_axes: order.map(|i| a[i]), semi_axis_directions: directions };
        let area = 4.0 * PI * mean.powf(1.0 / 1.6075);
        vec![Face { truth: Some(Surface::Ellipsoid(truth)), area, sample: Box::new(sample) }]
    }
}

/// A torus: it makes fillets, and is no quadric.
pub struct Ring {
    pub center: Vec3,
    /// Unit axis.
    pub axis: Vec3,
    pub major_radius: f64,
    pub minor_radius: f64,
}

impl Solid for Ring {
    fn contains(&self, p: &Vec3) -> bool {
        let d = p - self.center;
        let h = d.dot(&self.axis);
        let out = (d - h * self.axis).norm() - self.major_radius;
        out.hypot(h) <= self.minor_radius
    }

    fn faces(&self) -> Vec<Face> {
        let (center, major, minor) = (self.center, self.major_radius, self.minor_radius);
        let [u, v, w] = frame_of(self.axis);
        let sample = move |random: &mut Random| {
            let tube = loop {
                let angle = random.uniform(0.0, TAU);
                if random.uniform(0.0, major + minor) < major + minor * angle.cos() {
                    break angle;
                }
            };
            let (sin, cos) = random.uniform(0.0, TAU).sin_cos();
            let radial = cos * u + sin * v;
            let normal = tube.cos() * radial + tube.sin() * w;
            (center + major * radial + minor * normal, normal)
        };
        vec![Face { truth: None, area: TAU * major * TAU * minor, sample: Box::new(sample) }]
    }
}

/// A box, its edges rounded where `radius` > 0: all of them, or only the four along the third axis.
pub struct Block {
    pub center: Vec3,
    /// Unit axes, right-handed.
    pub axes: [Vec3; 3],
    /// Half sides along the axes.
    pub half: [f64; 3],
    pub radius: f64,
    /// Whether only the edges along the third axis are rounded.
    pub upright: bool,
}

impl Block {
    /// A box along the coordinate axes with sharp edges.
    pub fn sharp(low: [f64; 3], high: [f64; 3]) -> Self {
        Self::rounded(low, high, 0.0)
    }

    /// A box along the coordinate axes with every edge rounded.
    pub fn rounded(low: [f64; 3], high: [f64; 3], radius: f64) -> Self {
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        Self {
            center: (low + high) / 2.0,
            axes: [Vec3::x(), Vec3::y(), Vec3::z()],
            half: ((high - low) / 2.0).into(),
            radius,
            upright: false,
        }
    }

    /// A box along the coordinate axes with the edges along z rounded: a pocket, or a slot.
    pub fn upright(low: [f64; 3], high: [f64; 3], radius: f64) -> Self {
        Self { upright: true, ..Self::rounded(low, high, radius) }
    }

    /// Half sides of the core that the rounding is built around.
    fn core(&self) -> [f64; 3] {
        let [x, y, z] = self.half;
        let r = self.radius;
        [x - r, y - r, if self.upright { z } else { z - r }]
    }

    fn at(&self, local: [f64; 3]) -> Vec3 {
        self.center + local[0] * self.axes[0] + local[1] * self.axes[1] + local[2] * self.axes[2]
    }

    /// The planes across axis `k`.
    fn flats(&self, k: usize) -> impl Iterator<Item = Face> {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let mut half = self.core();
        if self.upright && k == 2 {
            half = self.half;
        }
        [-1.0, 1.0].into_iter().filter_map(move |sign| {
            let center = self.center + sign * self.half[k] * self.axes[k];
            rectangle(center, half[i] * self.axes[i], half[j] * self.axes[j])
        })
    }

    /// The rounded edges along axis `k`.
    fn edges(&self, k: usize) -> Vec<Face> {
        let ((i, j), core) = (((k + 1) % 3, (k + 2) % 3), self.core());
        let signs = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)];
        let edge = |(si, sj): (f64, f64)| {
            let mut base = [0.0; 3];
            (base[i], base[j], base[k]) = (si * core[i], sj * core[j], -core[k]);
            let sector = [si * self.axes[i], sj * self.axes[j], self.axes[k]];
            cylinder_side(self.at(base), sector, self.radius, 2.0 * core[k], FRAC_PI_2)
        };
        signs.map(edge).into()
    }

    fn corners(&self) -> Vec<Face> {
        let (core, axes) = (self.core(), self.axes);
        let corner = |bits: usize| {
            let sign = [0, 1, 2].map(|k| if bits >> k & 1 == 1 { 1.0 } else { -1.0 });
            let center = self.at([0, 1, 2].map(|k| sign[k] * core[k]));
            let keep = move |d: &Vec3| (0..3).all(|k| sign[k] * d.dot(&axes[k]) >= 0.0);
            sphere_part(center, self.radius, keep, FRAC_PI_2)
        };
        (0..8).map(corner).collect()
    }
}

impl Solid for Block {
    fn contains(&self, p: &Vec3) -> bool {
        let (d, core) = (p - self.center, self.core());
        let local = self.axes.map(|axis| d.dot(&axis).abs());
        let beyond = Vec3::from([0, 1, 2].map(|k| (local[k] - core[k]).max(0.0)));
        if self.upright || self.radius == 0.0 {
            beyond.z == 0.0 && beyond.xy().norm() <= self.radius
        } else {
            beyond.norm() <= self.radius
        }
    }

    fn faces(&self) -> Vec<Face> {
        let mut faces: Vec<_> = (0..3).flat_map(|k| self.flats(k)).collect();
        if self.radius > 0.0 {
            let rounded = if self.upright { 2..3 } else { 0..3 };
            faces.extend(rounded.flat_map(|k| self.edges(k)));
        }
        if self.radius > 0.0 && !self.upright {
            faces.extend(self.corners());
        }
        faces
    }
}

/// A convex body between planes.
pub struct Polytope {
    center: Vec3,
    reach: f64,
    /// Unit outward normals, and the planes' distances from `center`.
    sides: Vec<(Vec3, f64)>,
}

impl Polytope {
    /// The body within `reach` of `center` on whose inner side every (outward normal, distance from
    /// `center`) lies.
    pub fn new(center: Vec3, reach: f64, sides: Vec<(Vec3, f64)>) -> Self {
        let unit = |(normal, distance): (Vec3, f64)| (normal.normalize(), distance);
        Self { center, reach, sides: sides.into_iter().map(unit).collect() }
    }

    /// A box along the coordinate axes with every edge chamfered: `size` off each face, 45 degrees.
    pub fn chamfered(low: [f64; 3], high: [f64; 3], size: f64) -> Self {
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        let (center, half) = ((low + high) / 2.0, (high - low) / 2.0);
        let mut sides = Vec::new();
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            for s in [-1.0, 1.0] {
                sides.push((Vec3::ith(k, s), half[k]));
                for t in [-1.0, 1.0] {
                    let distance = (half[i] + half[j] - size) / 2f64.sqrt();
                    sides.push((Vec3::ith(i, s) + Vec3::ith(j, t), distance));
                }
            }
        }
        Self::new(center, half.norm(), sides)
    }

    /// A prism over a regular polygon, from `base` along z.
    pub fn prism(base: Vec3, corners: usize, inner_radius: f64, height: f64) -> Self {
        let center = base + height / 2.0 * Vec3::z();
        let mut sides: Vec<_> = (0..corners)
            .map(|i| (i as f64 / corners as f64 * TAU).sin_cos())
            .map(|(sin, cos)| (Vec3::new(cos, sin, 0.0), inner_radius))
            .collect();
        sides.extend([(Vec3::z(), height / 2.0), (-Vec3::z(), height / 2.0)]);
        Self::new(center, 1.2 * inner_radius.hypot(height / 2.0), sides)
    }
}

impl Solid for Polytope {
    fn contains(&self, p: &Vec3) -> bool {
        let d = p - self.center;
        self.sides.iter().all(|(normal, distance)| normal.dot(&d) <= *distance)
    }

    fn faces(&self) -> Vec<Face> {
        let face = |(normal, distance): &(Vec3, f64)| {
            let (u, v) = perpendicular_frame(normal);
            rectangle(self.center + *distance * normal, self.reach * u, self.reach * v)
        };
        self.sides.iter().filter_map(face).collect()
    }
}

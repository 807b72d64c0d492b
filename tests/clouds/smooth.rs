//! Joined smooth surfaces, scans of separate bodies, and scenes with nothing to find.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use conicoid::geometry::{Cone, Cylinder, EllipticCylinder, Surface, Vec3, perpendicular_frame};

use super::{Cloud, Patch, Random};

/// Every name `make` knows.
pub const NAMES: [&str; 18] = [
    "chain3",
    "chain3_exact",
    "chain3_70db",
    "chain3_outliers",
    "arcs",
    "wave5",
    "wave5_poor",
    "capsule",
    "ellipsoids",
    "part",
    "pipes",
    "scene_10k",
    "scene_100k",
    "noise_box",
    "freeform",
    "saddle",
    "torus",
    "hyperboloid",
];

/// The names of scenes in which nothing is to be found.
pub const EMPTY: [&str; 5] = ["noise_box", "freeform", "saddle", "torus", "hyperboloid"];

/// The cloud of that name; other seeds give other poses and sizes.
pub fn make(name: &str, seed: u64) -> Option<Cloud> {
    let random = &mut Random::new(seed);
    let (patches, sigma, stated) = match name {
        "chain3" => noisy(chain3(10_000, random), 90.0),
        "chain3_exact" => (chain3(10_000, random), 0.0, 0.0),
        "chain3_70db" => noisy(chain3(10_000, random), 70.0),
        "chain3_outliers" => {
            let (mut patches, sigma, _) = noisy(chain3(10_000, random), 90.0);
            patches.push(outliers(&patches, 0.2, random));
            (patches, sigma, sigma)
        }
        "arcs" => {
            let sigma = 10f64.powf(random.uniform(-2.5, -1.5));
            (arcs(random), sigma, sigma)
        }
        "wave5" => (wave5(30_000, 0.0, random), 0.01, 0.01),
        "wave5_poor" => (wave5(30_000, 0.03, random), 0.01, 0.025),
        "capsule" => (capsule(40_000, random), 0.01, 0.01),
        "ellipsoids" => (ellipsoids(60_000, random), 0.02, 0.02),
        "part" => (part(200_000, random), 0.02, 0.02),
        "pipes" => (pipes(150_000, random), 0.3, 0.3),
        "scene_10k" => (scene(10_000, 8, random), 0.02, 0.02),
        "scene_100k" => (scene(100_000, 24, random), 0.02, 0.02),
        _ => (nothing(name, 20_000, random)?, 0.01, 0.01),
    };
    let cloud = Cloud::assemble(name, patches, sigma, 0, random);
    Some(Cloud { sigma: stated, ..cloud })
}

/// A cloud of about `n` points: `scene` (50 separate quadrics), `part` or `chain3`.
pub fn sized(kind: &str, n: usize, seed: u64) -> Option<Cloud> {
    let random = &mut Random::new(seed);
    let (patches, sigma, _) = match kind {
        "scene" => (scene(n, 50, random), 0.02, 0.02),
        "part" => (part(n, random), 0.02, 0.02),
        "chain3" => noisy(chain3(n, random), 90.0),
        _ => return None,
    };
    Some(Cloud::assemble(kind, patches, sigma, 0, random))
}

/// Noise as a power ratio to the mean square of all coordinates.
fn noisy(patches: Vec<Patch>, decibels: f64) -> (Vec<Patch>, f64, f64) {
    let points = || patches.iter().flat_map(|p| &p.points);
    let mean_square =
        points().map(|p| p.norm_squared()).sum::<f64>() / (3 * points().count()) as f64;
    let sigma = mean_square.sqrt() * 10f64.powf(-decibels / 20.0);
    (patches, sigma, sigma)
}

/// An elliptic arc of a profile; it turns by `turn`, to the left where positive.
struct Arc {
    semi_axes: [f64; 2],
    rotation: f64,
    turn: f64,
}

fn circle(radius: f64, turn: f64) -> Arc {
    Arc { semi_axes: [radius; 2], rotation: 0.0, turn }
}

type Vec2 = nalgebra::Vector2<f64>;

impl Arc {
    fn turned(&self, x: f64, y: f64) -> Vec2 {
        nalgebra::Rotation2::new(self.rotation) * Vec2::new(x, y)
    }

    fn at(&self, t: f64) -> Vec2 {
        self.turned(self.semi_axes[0] * t.cos(), self.semi_axes[1] * t.sin())
    }

    /// The ellipse's parameter where the arc runs along `heading`.
    fn parameter(&self, heading: f64) -> f64 {
        let local = heading - self.rotation + if self.turn < 0.0 { PI } else { 0.0 };
        (-local.cos() / self.semi_axes[0]).atan2(local.sin() / self.semi_axes[1])
    }

    /// Curvature there, negative where the arc turns right.
    fn curvature(&self, t: f64) -> f64 {
        let [a, b] = self.semi_axes;
        let speed = (a * t.sin()).hypot(b * t.cos());
        (a * b / speed.powi(3)).copysign(self.turn)
    }

    /// Lengths along the arc from its start, at even steps of the parameter.
    fn lengths(&self, from: f64, to: f64) -> Vec<f64> {
        const STEPS: usize = 4000;
        let at = |i: usize| self.at(from + (to - from) * i as f64 / STEPS as f64);
        let mut sum = 0.0;
        let steps = (1..=STEPS).map(|i| {
            sum += (at(i) - at(i - 1)).norm();
            sum
        });
        std::iter::once(0.0).chain(steps).collect()
    }
}

/// The frame a profile is drawn in and swept along.
struct Sweep {
    origin: Vec3,
    e1: Vec3,
    e2: Vec3,
    length: f64,
}

/// Cylinders over a chain of arcs that join with common tangents.
fn chain(
    arcs: &[Arc],
    mut heading: f64,
    sweep: &Sweep,
    n: usize,
    random: &mut Random,
) -> Vec<Patch> {
    let axis = sweep.e1.cross(&sweep.e2);
    let mut position = Vec2::zeros();
    let mut pieces = Vec::new();
    for arc in arcs {
        let from = arc.parameter(heading);
        heading += arc.turn;
        let mut to = arc.parameter(heading);
        while (to - from) * arc.turn.signum() < 0.0 {
            to += TAU * arc.turn.signum();
        }
        let center = position - arc.at(from);
        position = center + arc.at(to);
        pieces.push((arc, center, from, to, arc.lengths(from, to)));
    }
    let total: f64 = pieces.iter().filter_map(|p| p.4.last()).sum();
    let in_space = |q: Vec2| q.x * sweep.e1 + q.y * sweep.e2;
    let patch = |(arc, center, from, to, lengths): &(&Arc, Vec2, f64, f64, Vec<f64>)| {
        let length = lengths.last().copied().unwrap_or_default();
        let count = random.round(n as f64 * length / total);
        let points = (0..count).map(|_| {
            let s = random.uniform(0.0, length);
            let i = lengths.partition_point(|&l| l < s).clamp(1, lengths.len() - 1);
            let part = (s - lengths[i - 1]) / (lengths[i] - lengths[i - 1]);
            let t = from + (to - from) * (i as f64 - 1.0 + part) / (lengths.len() - 1) as f64;
            let along = random.uniform(0.0, sweep.length) * axis;
            sweep.origin + in_space(center + arc.at(t)) + along
        });
        let points = points.collect();
        let axis_point = sweep.origin + in_space(*center);
        Patch { points, truth: Some(over_ellipse(arc, axis_point, axis, in_space)) }
    };
    pieces.iter().map(patch).collect()
}

fn over_ellipse(
    arc: &Arc,
    axis_point: Vec3,
    axis_direction: Vec3,
    in_space: impl Fn(Vec2) -> Vec3,
) -> Surface {
    let [a, b] = arc.semi_axes;
    if a == b {
        return Surface::Cylinder(Cylinder { axis_point, axis_direction, radius: a });
    }
    let (first, second) = (in_space(arc.turned(1.0, 0.0)), in_space(arc.turned(0.0, 1.0)));
    let (semi_axes, semi_axis_directions) =
        if a > b { ([a, b], [first, second]) } else { ([b, a], [second, -first]) };
    Surface::EllipticCylinder(EllipticCylinder {
        axis_point,
        axis_direction,
        semi_axes,
        semi_axis_directions,
    })
}

/// Three elliptic cylinders in one smooth surface, like the seed's Table 1 and Figure 3.
fn chain3(n: usize, random: &mut Random) -> Vec<Patch> {
    let mut arc = |a: f64, b: f64, rotation: f64, turn: f64| {
        let mut vary = |value: f64| value * random.uniform(0.92, 1.08);
        Arc { semi_axes: [vary(a), vary(b)], rotation, turn: vary(turn) }
    };
    let arcs = [arc(19.0, 8.7, 0.0, -1.9), arc(29.0, 19.6, 0.04, 2.4), arc(14.9, 10.3, 1.4, -1.6)];
    let sweep =
        Sweep { origin: Vec3::new(140.0, 0.0, 150.0), e1: -Vec3::x(), e2: Vec3::z(), length: 40.0 };
    chain(&arcs, 0.8, &sweep, n, random)
}

/// Two to five elliptic cylinders of any shape in one smooth surface; the curvature steps at every joint, and
/// no two come near each other anywhere else.
fn arcs(random: &mut Random) -> Vec<Patch> {
    const STEP: f64 = 0.02;
    const APART: f64 = 3.0;
    loop {
        let some: Vec<Arc> = (0..2 + random.below(4))
            .map(|_| {
                let a = random.uniform(8.0, 30.0);
                let side = if random.below(2) == 0 { -1.0 } else { 1.0 };
                Arc {
                    semi_axes: [a, a * random.uniform(0.4, 0.85)],
                    rotation: random.uniform(0.0, PI),
                    turn: side * random.uniform(0.9, 1.9),
                }
            })
            .collect();
        let start = random.uniform(0.0, TAU);
        let mut heading = start;
        let steps = some.windows(2).all(|pair| {
            heading += pair[0].turn;
            let [before, after] = [&pair[0], &pair[1]].map(|a| a.curvature(a.parameter(heading)));
            (before - after).abs() > STEP
        });
        let w = random.direction();
        let (e1, e2) = perpendicular_frame(&w);
        let length = random.uniform(20.0, 60.0);
        let sweep = Sweep { origin: 100.0 * random.direction(), e1, e2, length };
        let patches = chain(&some, start, &sweep, 4000 * some.len(), random);
        let profile = |p: &Patch| -> Vec<Vec3> {
            let across = |x: &Vec3| x - w * w.dot(x);
            p.points.iter().step_by(20).map(across).collect()
        };
        let profiles: Vec<Vec<Vec3>> = patches.iter().map(profile).collect();
        let near = |a: &Vec<Vec3>, b: &Vec<Vec3>| {
            a.iter().any(|p| b.iter().any(|q| (p - q).norm() < APART))
        };
        let apart = (0..profiles.len())
            .all(|i| profiles.iter().skip(i + 2).all(|other| !near(&profiles[i], other)));
        if steps && apart {
            return patches;
        }
    }
}

/// Five circular cylinders, concave and convex in turn, like the seed's Figure 6.
fn wave5(n: usize, waviness: f64, random: &mut Random) -> Vec<Patch> {
    let mut arc = |radius: f64, turn: f64| {
        circle(radius * random.uniform(0.9, 1.1), turn * random.uniform(0.95, 1.05))
    };
    let arcs = [arc(14.0, 1.2), arc(9.0, -1.7), arc(12.5, 1.9), arc(18.0, -1.3), arc(10.0, 1.0)];
    let sweep =
        Sweep { origin: Vec3::new(0.0, 10.0, 70.0), e1: Vec3::y(), e2: Vec3::z(), length: 60.0 };
    let mut patches = chain(&arcs, -0.6, &sweep, n, random);
    for p in patches.iter_mut().flat_map(|p| &mut p.points) {
        let error = [(p.x / 4.7 + p.z / 9.0).sin(), (p.x / 6.1 + p.y / 7.0).cos()];
        *p += waviness * Vec3::new(0.0, error[0], error[1]);
    }
    patches
}

/// Smooth joints of unlike types: cylinder and sphere, elliptic cylinder and ellipsoid.
fn capsule(n: usize, random: &mut Random) -> Vec<Patch> {
    let (w, radius, length) = (random.direction(), random.uniform(10.0, 14.0), 35.0);
    let base = Vec3::new(20.0, 30.0, 40.0);
    let share = length / (length + radius);
    let half = n as f64 / 2.0;
    let on_body = random.round(half * share);
    let on_cap = random.round(half * (1.0 - share));
    let mut patches = vec![
        Patch::cylinder(base, length * w, radius, [0.0, TAU], on_body, random),
        Patch::sphere(base + length * w, radius, |d| d.dot(&w) > 0.0, on_cap, random),
    ];
    let (a, b, c) =
        (random.uniform(14.0, 18.0), random.uniform(8.0, 11.0), random.uniform(19.0, 25.0));
    let w = random.direction();
    let (e1, e2) = perpendicular_frame(&w);
    let sweep = Sweep { origin: Vec3::new(110.0, 10.0, 60.0), e1, e2, length: 30.0 };
    let whole = Arc { semi_axes: [a, b], rotation: 0.0, turn: TAU - 1e-12 };
    let tube = chain(&[whole], FRAC_PI_2, &sweep, n / 4, random);
    let axis_point = match tube[0].truth {
        Some(Surface::EllipticCylinder(s)) => s.axis_point,
        _ => sweep.origin,
    };
    patches.extend(tube);
    let center = axis_point + 30.0 * w;
    patches.push(Patch::ellipsoid(center, [e1, e2, w], [a, b, c], |d| d.z > 0.0, n / 4, random));
    patches
}

/// Twelve ellipsoids and spheres seen from one side.
fn ellipsoids(n: usize, random: &mut Random) -> Vec<Patch> {
    let one = |i: usize| {
        let jitter = 3.0 * random.normal3().map(|x| x.clamp(-1.0, 1.0));
        let center = Vec3::new((i % 4) as f64 * 45.0, (i / 4) as f64 * 45.0, 60.0) + jitter;
        let semi_axes = [0; 3].map(|_| random.uniform(9.0, 22.0));
        let rotation = random.rotation();
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()].map(|e| rotation * e);
        if i % 4 == 3 {
            return Patch::sphere(center, semi_axes[0], |d| d.z > -0.2, n / 12, random);
        }
        Patch::ellipsoid(center, axes, semi_axes, |d| d.z > -0.2, n / 12, random)
    };
    (0..12).map(one).collect()
}

/// A plate with bosses, bores, a cone, domes and a pipe elbow.
fn part(n: usize, random: &mut Random) -> Vec<Patch> {
    let density = n as f64 / 65_000.0;
    let mut patches = Vec::new();
    let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
    let sides = [
        (20.0 * z, 200.0 * x, 120.0 * y),
        (0.0 * z, 200.0 * x, 20.0 * z),
        (120.0 * y, 200.0 * x, 20.0 * z),
        (0.0 * z, 120.0 * y, 20.0 * z),
    ];
    for (corner, e1, e2) in sides {
        let count = random.round(density * e1.norm() * e2.norm());
        patches.push(Patch::plane(corner, e1, e2, count, random));
    }
    let tilted = Vec3::new(1.0, 0.2, 0.1).normalize();
    for (base, length, radius) in [
        ([40.0, 40.0, 20.0], 40.0 * z, 15.0),
        ([100.0, 30.0, 20.0], 30.0 * z, 10.0),
        ([100.0, 90.0, 20.0], 18.0 * z, 22.0),
        ([160.0, 60.0, 20.0], 55.0 * z, 18.0),
        ([40.0, 95.0, 32.0], 45.0 * tilted, 8.0),
        ([100.0, 90.0, 0.0], 38.0 * z, 12.0),
    ] {
        let count = random.round(density * TAU * radius * length.norm());
        patches.push(Patch::cylinder(base.into(), length, radius, [0.0, TAU], count, random));
    }
    let count = random.round(density * TAU * 225.0);
    patches.push(Patch::sphere(Vec3::new(40.0, 40.0, 60.0), 15.0, |d| d.z > 0.0, count, random));
    let half_angle = random.uniform(20.0, 30.0f64).to_radians();
    let height = 10.0 / half_angle.tan();
    let apex = Vec3::new(100.0, 30.0, 50.0 + height);
    let count = random.round(density * PI * 10.0 * height / half_angle.cos());
    let cone = Cone { apex, axis_direction: -z, half_angle };
    patches.push(Patch::cone(cone, [4.0, height], count, random));
    let count = random.round(density * TAU * 18.0 * 24.0);
    let center = Vec3::new(160.0, 60.0, 75.0);
    patches.push(Patch::ellipsoid(
        center,
        [x, y, z],
        [18.0, 18.0, 26.0],
        |d| d.z > 0.0,
        count,
        random,
    ));
    let count = random.round(density * TAU * 8.0 * 30.0);
    let center = Vec3::new(150.0, 20.0, 45.0);
    patches.push(Patch::torus(center, [x, z], [20.0, 8.0], FRAC_PI_2, count, random));
    patches
}

/// Straight pipes joined by elbows, far from the origin.
fn pipes(n: usize, random: &mut Random) -> Vec<Patch> {
    const PAIRS: usize = 14;
    let (x, z) = (Vec3::x(), Vec3::z());
    let mut patches = Vec::new();
    for i in 0..PAIRS {
        let base =
            Vec3::new(4512.0, -1873.0 + (i % 7) as f64 * 160.0, 950.0 + (i / 7) as f64 * 260.0);
        let radius = random.uniform(12.0, 60.0);
        let (bend, first, second) =
            (2.2 * radius, random.uniform(400.0, 700.0), random.uniform(150.0, 350.0));
        let per_length = (n / PAIRS) as f64 / (first + second + bend * FRAC_PI_2);
        let seen = [0.0, 1.3 * PI];
        let counts = [first, second, bend * FRAC_PI_2].map(|l| random.round(per_length * l));
        let turn = base + first * x;
        patches.push(Patch::cylinder(base, first * x, radius, seen, counts[0], random));
        let upper = turn + bend * (x + z);
        patches.push(Patch::cylinder(upper, second * z, radius, seen, counts[1], random));
        let center = turn + bend * z;
        patches.push(Patch::torus(center, [-z, x], [bend, radius], FRAC_PI_2, counts[2], random));
    }
    patches
}

/// Separate quadrics of four kinds on a grid.
fn scene(n: usize, bodies: usize, random: &mut Random) -> Vec<Patch> {
    let side = (bodies as f64).sqrt().ceil() as usize;
    let count = n / bodies;
    let mut patches = Vec::new();
    for i in 0..bodies {
        let center = Vec3::new((i % side) as f64 * 60.0, (i / side) as f64 * 60.0, 50.0);
        let w = random.direction();
        let (u, v) = perpendicular_frame(&w);
        let mut size = |from, to| random.uniform(from, to);
        let sizes = [size(8.0, 22.0), size(8.0, 22.0), size(8.0, 22.0)];
        match i % 4 {
            0 => patches.push(Patch::cylinder(
                center - 15.0 * w,
                30.0 * w,
                0.8 * sizes[0],
                [0.0, TAU],
                count,
                random,
            )),
            1 => {
                let semi_axes = [size(12.0, 20.0), size(5.0, 10.0)];
                let whole = Arc { semi_axes, rotation: 0.0, turn: TAU - 1e-12 };
                let sweep = Sweep { origin: center - 15.0 * w, e1: u, e2: v, length: 30.0 };
                patches.extend(chain(&[whole], FRAC_PI_2, &sweep, count, random));
            }
            2 => patches.push(Patch::sphere(center, sizes[0], |_| true, count, random)),
            _ => patches.push(Patch::ellipsoid(center, [u, v, w], sizes, |_| true, count, random)),
        }
    }
    patches
}

fn outliers(patches: &[Patch], share: f64, random: &mut Random) -> Patch {
    let points = || patches.iter().flat_map(|p| &p.points);
    let (mut low, mut high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    for p in points() {
        (low, high) = (low.inf(p), high.sup(p));
    }
    let margin = 0.1 * (high - low);
    let one = |_| {
        let mut at = |i: usize| random.uniform(low[i] - margin[i], high[i] + margin[i]);
        Vec3::new(at(0), at(1), at(2))
    };
    Patch::other((0..(points().count() as f64 * share) as usize).map(one).collect())
}

/// Clouds without any of the default surfaces.
fn nothing(kind: &str, n: usize, random: &mut Random) -> Option<Vec<Patch>> {
    let radii = [random.uniform(35.0, 45.0), random.uniform(10.0, 14.0)];
    let (w, scale) = (random.direction(), random.uniform(0.8, 1.2));
    if kind == "torus" {
        let (u, v) = perpendicular_frame(&w);
        let center = Vec3::repeat(5.0);
        return Some(vec![Patch::torus(center, [u, v], radii, TAU, n, random)]);
    }
    let point = |_| {
        let (x, y) = (random.uniform(-50.0, 50.0), random.uniform(-50.0, 50.0));
        Some(match kind {
            "noise_box" => Vec3::new(x, y, random.uniform(-50.0, 50.0)),
            "freeform" => Vec3::new(x, y, 3.0 * scale * (x / 8.0).sin() * (y / 8.0).cos()),
            "saddle" => Vec3::new(x, y, scale * (x * x - y * y) / 120.0),
            "hyperboloid" => {
                let z = 0.8 * y;
                let r = 15.0 * scale * (1.0 + (z / 25.0).powi(2)).sqrt();
                let (sin, cos) = (x * PI / 50.0).sin_cos();
                Vec3::new(r * cos, r * sin, z)
            }
            _ => return None,
        })
    };
    Some(vec![Patch::other((0..n).map(point).collect::<Option<_>>()?)])
}

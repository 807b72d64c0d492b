//! Machined parts: chamfers, pockets, thin walls, ribs, hole patterns, counterbores, countersinks, small
//! fillets, shafts, flanges, castings. Every size varies with the seed.

use std::f64::consts::{FRAC_PI_4, TAU};

use conicoid::geometry::Vec3;

use super::solid::{Ball, Block, Egg, Part, Polytope, Ring, Rod, Taper};
use super::{Cloud, Random};

/// Every part `make` knows.
pub const NAMES: [&str; 14] = [
    "bracket", "drilled", "pockets", "heatsink", "flange", "shaft", "housing", "tee", "lever",
    "mould", "bolt", "manifold", "cover", "clevis",
];

/// Surfaces with fewer points are not scored.
const MIN_POINTS: usize = 100;

/// A part's cloud of about `n` points with noise `sigma`; posed at random where `posed`.
pub fn make(name: &str, seed: u64, n: usize, sigma: f64, posed: bool) -> Option<Cloud> {
    let random = &mut Random::new(seed);
    let mut part = Part::default();
    build(name, &mut part, random)?;
    let patches = part.sample(n, random);
    let cloud = Cloud::assemble(name, patches, sigma, MIN_POINTS, random);
    if !posed {
        return Some(cloud);
    }
    let shift = 200.0 * random.normal3();
    Some(cloud.moved(&random.rotation(), &shift))
}

/// The volume of the part that `make` samples with that name and seed, to about 0.1 %.
pub fn volume(name: &str, seed: u64) -> Option<f64> {
    let random = &mut Random::new(seed);
    let mut part = Part::default();
    build(name, &mut part, random)?;
    Some(part.volume(2_000_000, random))
}

fn build(name: &str, part: &mut Part, random: &mut Random) -> Option<()> {
    match name {
        "bracket" => bracket(part, random),
        "drilled" => drilled(part, random),
        "pockets" => pockets(part, random),
        "heatsink" => heatsink(part, random),
        "flange" => flange(part, random),
        "shaft" => shaft(part, random),
        "housing" => housing(part, random),
        "tee" => tee(part, random),
        "lever" => lever(part, random),
        "mould" => mould(part, random),
        "bolt" => bolt(part, random),
        "manifold" => manifold(part, random),
        "cover" => cover(part, random),
        "clevis" => clevis(part, random),
        _ => return None,
    }
    Some(())
}

fn at(x: f64, y: f64, z: f64) -> Vec3 {
    Vec3::new(x, y, z)
}

/// A straight hole from `mouth` (on the surface, whose outward normal is `out`) of the given depth.
fn hole(part: &mut Part, mouth: Vec3, out: Vec3, radius: f64, depth: f64) {
    part.cut(Rod { base: mouth - depth * out, axis: out, radius, length: depth + 0.5 });
}

/// A 45-degree chamfer around a hole's mouth.
fn countersink(part: &mut Part, mouth: Vec3, out: Vec3, radius: f64, size: f64) {
    let apex = mouth - (radius + size) * out;
    let heights = [radius * 0.5, radius + size + 0.2];
    part.cut(Taper { apex, axis: out, half_angle: FRAC_PI_4, heights });
}

/// A blind hole with a drill point (118 degrees).
fn drilled_hole(part: &mut Part, mouth: Vec3, out: Vec3, radius: f64, depth: f64) {
    hole(part, mouth, out, radius, depth);
    let half_angle = 59f64.to_radians();
    let tip = radius / half_angle.tan();
    let apex = mouth - (depth + tip) * out;
    part.cut(Taper { apex, axis: out, half_angle, heights: [0.0, tip] });
}

/// A round boss with a chamfered top edge.
fn boss(part: &mut Part, base: Vec3, out: Vec3, radius: f64, height: f64, chamfer: f64) {
    part.add(Rod { base, axis: out, radius, length: height - chamfer });
    let apex = base + (height - chamfer + radius) * out;
    let heights = [radius - chamfer, radius];
    part.add(Taper { apex, axis: -out, half_angle: FRAC_PI_4, heights });
}

/// The fillet between a boss and the plate it stands on.
fn fillet(part: &mut Part, base: Vec3, out: Vec3, radius: f64, size: f64) {
    part.add(Rod { base, axis: out, radius: radius + size, length: size });
    let center = base + size * out;
    part.cut(Ring { center, axis: out, major_radius: radius + size, minor_radius: size });
}

fn bracket(part: &mut Part, random: &mut Random) {
    let (t, chamfer) = (random.uniform(6.0, 9.0), random.uniform(0.8, 1.6));
    let z = Vec3::z();
    part.add(Polytope::chamfered([0.0, 0.0, 0.0], [90.0, 60.0, t], chamfer));
    part.add(Polytope::chamfered([0.0, 0.0, 0.0], [t, 60.0, 70.0], chamfer));
    for y in [12.0, 44.0] {
        let center = at(t + 12.0, y + 2.0, t + 12.0);
        let slope = (Vec3::new(1.0, 0.0, 1.0), random.uniform(0.0, 6.0));
        let sides =
            vec![slope, (Vec3::y(), 2.0), (-Vec3::y(), 2.0), (-Vec3::x(), 12.5), (-z, 12.5)];
        part.add(Polytope::new(center, 40.0, sides));
    }
    for (x, y) in [(40.0, 12.0), (75.0, 12.0), (40.0, 48.0), (75.0, 48.0)] {
        let radius = random.uniform(2.5, 4.0);
        hole(part, at(x, y, t), z, radius, t + 0.5);
        hole(part, at(x, y, t), z, 1.8 * radius, 0.45 * t);
    }
    let radius = random.uniform(9.0, 12.0);
    hole(part, at(t, 30.0, 45.0), Vec3::x(), radius, t + 0.5);
    countersink(part, at(t, 30.0, 45.0), Vec3::x(), radius, 1.5);
}

fn drilled(part: &mut Part, random: &mut Random) {
    let (t, chamfer) = (random.uniform(8.0, 12.0), random.uniform(0.6, 1.2));
    part.add(Polytope::chamfered([0.0, 0.0, 0.0], [160.0, 100.0, t], chamfer));
    for i in 0..7 {
        for j in 0..4 {
            let mouth = at(20.0 + 20.0 * i as f64, 20.0 + 20.0 * j as f64, t);
            let radius = [2.0, 3.0, 4.0, 5.0][(i + j) % 4] * random.uniform(0.9, 1.1);
            hole(part, mouth, Vec3::z(), radius, t + 0.5);
            if (i + j) % 2 == 0 {
                countersink(part, mouth, Vec3::z(), radius, random.uniform(0.8, 2.0));
            }
        }
    }
}

fn pockets(part: &mut Part, random: &mut Random) {
    let (wall, height) = (random.uniform(1.5, 2.5), random.uniform(18.0, 25.0));
    part.add(Block::sharp([0.0, 0.0, 0.0], [120.0, 80.0, height]));
    let (floor, radius) = (random.uniform(3.0, 5.0), random.uniform(3.0, 6.0));
    for (x, width) in [(wall, 36.0), (2.0 * wall + 36.0, 50.0)] {
        let high = [x + width, 80.0 - wall, height + 1.0];
        part.cut(Block::upright([x, wall, floor], high, radius));
    }
    let x = 3.0 * wall + 86.0;
    part.cut(Block::upright([x, wall, 10.0], [118.0, 38.0, height + 1.0], 2.0));
    part.cut(Block::upright([x, 40.0, 6.0], [118.0, 80.0 - wall, height + 1.0], 2.5));
    boss(part, at(64.0, 40.0, floor), Vec3::z(), 8.0, height - floor - 2.0, 0.8);
    fillet(part, at(64.0, 40.0, floor), Vec3::z(), 8.0, random.uniform(1.0, 2.0));
    drilled_hole(part, at(64.0, 40.0, height - 2.0), Vec3::z(), 3.0, 9.0);
    let slot = [[14.0, 30.0, -1.0], [26.0, 50.0, floor + 1.0]];
    part.cut(Block::upright(slot[0], slot[1], 6.0));
    for x in [10.0, 30.0] {
        hole(part, at(x, 15.0, floor), Vec3::z(), 2.2, floor + 0.5);
        hole(part, at(x, 65.0, floor), Vec3::z(), 2.2, floor + 0.5);
    }
}

fn heatsink(part: &mut Part, random: &mut Random) {
    let (fin, gap) = (random.uniform(1.2, 2.0), random.uniform(5.0, 7.0));
    part.add(Polytope::chamfered([0.0, 0.0, 0.0], [110.0, 70.0, 8.0], 1.0));
    let count = (100.0 / (fin + gap)) as usize;
    for i in 0..count {
        let x = 5.0 + i as f64 * (fin + gap);
        part.add(Block::sharp([x, 3.0, 7.0], [x + fin, 67.0, random.uniform(25.0, 35.0)]));
    }
    for x in [20.0, 90.0] {
        for y in [15.0, 55.0] {
            drilled_hole(part, at(x, y, 0.0), -Vec3::z(), 1.6, 5.0);
        }
    }
    part.cut(Block::upright([35.0, 20.0, -1.0], [75.0, 50.0, 2.0], 3.0));
}

fn flange(part: &mut Part, random: &mut Random) {
    let z = Vec3::z();
    let (outer, hub, bore) =
        (random.uniform(48.0, 55.0), random.uniform(20.0, 24.0), random.uniform(11.0, 15.0));
    boss(part, Vec3::zeros(), z, outer, 12.0, 1.2);
    part.add(Rod { base: at(0.0, 0.0, 12.0), axis: z, radius: hub, length: 30.0 });
    fillet(part, at(0.0, 0.0, 12.0), z, hub, random.uniform(3.0, 5.0));
    let half_angle = random.uniform(8.0, 15.0f64).to_radians();
    let top = hub / half_angle.tan();
    let taper =
        Taper { apex: at(0.0, 0.0, 42.0 + top), axis: -z, half_angle, heights: [top - 18.0, top] };
    part.add(taper);
    hole(part, at(0.0, 0.0, 60.0), z, bore, 61.0);
    hole(part, Vec3::zeros(), -z, bore + 4.0, 6.0);
    countersink(part, at(0.0, 0.0, 60.0), z, bore, 1.0);
    let count = 6 + random.below(5);
    for i in 0..count {
        let (sin, cos) = (i as f64 / count as f64 * TAU).sin_cos();
        let mouth = at(38.0 * cos, 38.0 * sin, 12.0);
        hole(part, mouth, z, 4.2, 12.5);
        countersink(part, mouth, z, 4.2, 0.8);
    }
}

fn shaft(part: &mut Part, random: &mut Random) {
    let x = Vec3::x();
    let (mut position, mut previous) = (0.0, 0.0);
    for i in 0..8 {
        let radius = [9.0, 12.0, 12.4, 16.0, 14.0, 10.5, 10.0, 7.0][i] * random.uniform(0.98, 1.02);
        let length = random.uniform(10.0, 28.0);
        let base = at(position, 0.0, 0.0);
        if i % 3 == 0 {
            boss(part, base, x, radius, length, 1.0);
        } else {
            part.add(Rod { base, axis: x, radius, length });
        }
        if radius < previous - 1.5 {
            fillet(part, base, x, radius, 1.0);
        }
        (position, previous) = (position + length, radius);
    }
    for (end, out) in [(0.0, -x), (position, x)] {
        drilled_hole(part, at(end, 0.0, 0.0), out, 2.0, 6.0);
        countersink(part, at(end, 0.0, 0.0), out, 2.0, 1.5);
    }
    let key = Block {
        center: at(position * 0.4, 0.0, 15.0),
        axes: [x, Vec3::y(), Vec3::z()],
        half: [9.0, 2.5, 4.5],
        radius: 2.5,
        upright: true,
    };
    part.cut(key);
}

fn housing(part: &mut Part, random: &mut Random) {
    let (wall, radius) = (random.uniform(2.0, 3.0), random.uniform(5.0, 8.0));
    part.add(Block::rounded([0.0, 0.0, 0.0], [110.0, 70.0, 45.0], radius));
    let inner = ([wall; 3], [110.0 - wall, 70.0 - wall, 60.0]);
    part.cut(Block::rounded(inner.0, inner.1, radius - wall));
    part.cut(Block::sharp([-1.0, -1.0, 38.0], [111.0, 71.0, 50.0]));
    for (x, y) in [(12.0, 12.0), (98.0, 12.0), (12.0, 58.0), (98.0, 58.0)] {
        let base = at(x, y, wall);
        part.add(Rod { base, axis: Vec3::z(), radius: 5.0, length: 30.0 });
        drilled_hole(part, at(x, y, 30.0 + wall), Vec3::z(), 2.1, 15.0);
    }
    for x in [35.0, 55.0, 75.0] {
        part.add(Block::sharp([x, wall, wall], [x + 1.8, 70.0 - wall, 14.0]));
    }
    hole(part, at(110.0, 35.0, 22.0), Vec3::x(), random.uniform(7.0, 10.0), wall + 0.5);
    part.cut(Block::upright([20.0, 25.0, -1.0], [30.0, 45.0, wall + 0.5], 4.99));
}

fn tee(part: &mut Part, random: &mut Random) {
    let (x, z) = (Vec3::x(), Vec3::z());
    let (main, branch, wall) =
        (random.uniform(18.0, 22.0), random.uniform(12.0, 15.0), random.uniform(2.5, 4.0));
    part.add(Rod { base: at(-60.0, 0.0, 0.0), axis: x, radius: main, length: 120.0 });
    part.add(Rod { base: Vec3::zeros(), axis: z, radius: branch, length: 55.0 });
    for (base, axis, radius) in [
        (at(-60.0, 0.0, 0.0), x, main),
        (at(60.0, 0.0, 0.0), -x, main),
        (at(0.0, 0.0, 55.0), -z, branch),
    ] {
        part.add(Rod { base, axis, radius: radius + 12.0, length: 8.0 });
        let (u, v) = conicoid::geometry::perpendicular_frame(&axis);
        for i in 0..4 {
            let (sin, cos) = ((i as f64 + 0.5) / 4.0 * TAU).sin_cos();
            hole(part, base + (radius + 6.5) * (cos * u + sin * v), -axis, 2.5, 8.5);
        }
    }
    part.cut(Rod { base: at(-61.0, 0.0, 0.0), axis: x, radius: main - wall, length: 122.0 });
    part.cut(Rod { base: Vec3::zeros(), axis: z, radius: branch - wall, length: 56.0 });
    part.cut(Ball { center: Vec3::zeros(), radius: main - wall + 2.0 });
}

fn lever(part: &mut Part, random: &mut Random) {
    let z = Vec3::z();
    let (big, small, span) =
        (random.uniform(18.0, 22.0), random.uniform(9.0, 12.0), random.uniform(80.0, 95.0));
    let [web, tip] = [random.uniform(4.0, 6.0), random.uniform(11.0, 14.0)];
    part.add(Block::sharp([0.0, -6.0, 8.0 - web / 2.0], [span, 6.0, 8.0 + web / 2.0]));
    part.add(Block::sharp([0.0, -1.5, 3.0], [span, 1.5, 13.0]));
    boss(part, Vec3::zeros(), z, big, 22.0, 1.0);
    boss(part, at(span, 0.0, 1.0), z, small, tip, 0.7);
    hole(part, at(0.0, 0.0, 22.0), z, big - 8.0, 22.5);
    countersink(part, at(0.0, 0.0, 22.0), z, big - 8.0, 0.8);
    hole(part, at(span, 0.0, 1.0 + tip), z, small - 4.0, 20.0);
    part.cut(Block::sharp([-2.5, 0.0, -1.0], [2.5, big - 5.0, 23.0]));
    let slot = [[span * 0.4, -3.0, 0.0], [span * 0.7, 3.0, 20.0]];
    part.cut(Block::upright(slot[0], slot[1], 3.0));
}

fn mould(part: &mut Part, random: &mut Random) {
    let z = Vec3::z();
    part.add(Polytope::chamfered([0.0, 0.0, 0.0], [130.0, 90.0, 40.0], 2.0));
    let semi_axes =
        at(random.uniform(24.0, 30.0), random.uniform(17.0, 22.0), random.uniform(14.0, 20.0));
    part.cut(Egg { center: at(38.0, 45.0, 40.0), semi_axes });
    part.cut(Ball { center: at(95.0, 28.0, 44.0), radius: random.uniform(14.0, 18.0) });
    let half_angle = random.uniform(5.0, 12.0f64).to_radians();
    let top = 13.0 / half_angle.tan();
    let apex = at(96.0, 66.0, 40.0 - top);
    part.cut(Taper { apex, axis: z, half_angle, heights: [top - 16.0, top + 1.0] });
    part.cut(Block::rounded([64.0, 10.0, 32.0], [72.0, 80.0, 60.0], 2.5));
    for (x, y) in [(10.0, 10.0), (120.0, 10.0), (10.0, 80.0), (120.0, 80.0)] {
        hole(part, at(x, y, 40.0), z, 4.0, 41.0);
        hole(part, at(x, y, 40.0), z, 6.5, 5.0);
    }
    let channel = Rod { base: at(-1.0, 45.0, 12.0), axis: Vec3::x(), radius: 4.0, length: 132.0 };
    part.cut(channel);
}

fn bolt(part: &mut Part, random: &mut Random) {
    let z = Vec3::z();
    let (across, shank) = (random.uniform(14.0, 18.0), random.uniform(8.0, 10.0));
    part.add(Polytope::prism(Vec3::zeros(), 6, across, 12.0));
    // the head's corners are turned off by a cone: what lies outside of it is cut by the wedge between
    // the prism and the cone, written here as a smaller prism on a cone frustum
    part.add(Taper {
        apex: at(0.0, 0.0, 12.0 + 0.95 * across * 30f64.to_radians().tan() + 1.0),
        axis: -z,
        half_angle: 60f64.to_radians(),
        heights: [
            0.95 * across * 30f64.to_radians().tan() - 1.0,
            0.95 * across * 30f64.to_radians().tan() + 1.0,
        ],
    });
    part.add(Rod { base: at(0.0, 0.0, -1.5), axis: z, radius: 0.92 * across, length: 2.0 });
    boss(part, at(0.0, 0.0, -1.5), -z, shank, 60.0, 1.2);
    fillet(part, at(0.0, 0.0, -1.5), -z, shank, 0.8);
    part.cut(Polytope::prism(at(0.0, 0.0, 8.0), 6, 5.0, 10.0));
    hole(part, at(0.0, shank + 1.0, -45.0), Vec3::y(), 1.8, 2.0 * shank + 2.0);
    part.cut(Ring {
        center: at(0.0, 0.0, -30.0),
        axis: z,
        major_radius: shank + 1.0,
        minor_radius: 2.0,
    });
}

fn manifold(part: &mut Part, random: &mut Random) {
    let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
    part.add(Polytope::chamfered([0.0, 0.0, 0.0], [140.0, 60.0, 50.0], random.uniform(1.0, 2.0)));
    for i in 0..5 {
        let mouth = at(18.0 + 26.0 * i as f64, 30.0, 50.0);
        let radius = random.uniform(4.0, 6.0);
        hole(part, mouth, z, radius + 4.0, 3.0);
        drilled_hole(part, mouth, z, radius, random.uniform(15.0, 30.0));
        countersink(part, mouth - 3.0 * z, z, radius, 1.0);
    }
    drilled_hole(part, at(140.0, 30.0, 20.0), x, 6.5, 125.0);
    for i in 0..3 {
        drilled_hole(part, at(31.0 + 40.0 * i as f64, 0.0, 20.0), -y, 4.5, 28.0);
        hole(part, at(31.0 + 40.0 * i as f64, 0.0, 20.0), -y, 8.0, 4.0);
    }
    for (px, py) in [(6.0, 6.0), (134.0, 6.0), (6.0, 54.0), (134.0, 54.0)] {
        hole(part, at(px, py, 50.0), z, 2.8, 51.0);
    }
}

fn cover(part: &mut Part, random: &mut Random) {
    let z = Vec3::z();
    let corner = random.uniform(8.0, 12.0);
    part.add(Block::upright([0.0, 0.0, 0.0], [100.0, 70.0, 6.0], corner));
    part.add(Block::upright([8.0, 8.0, 5.0], [92.0, 62.0, 16.0], corner - 3.0));
    part.cut(Block::upright([10.5, 10.5, -1.0], [89.5, 59.5, 13.0], corner - 5.5));
    for (px, py) in [(5.5, 5.5), (94.5, 5.5), (5.5, 64.5), (94.5, 64.5), (50.0, 4.0), (50.0, 66.0)]
    {
        hole(part, at(px, py, 6.0), z, random.uniform(1.6, 2.2), 6.5);
    }
    boss(part, at(30.0, 35.0, 16.0), z, 11.0, 9.0, 0.8);
    fillet(part, at(30.0, 35.0, 16.0), z, 11.0, 2.0);
    hole(part, at(30.0, 35.0, 25.0), z, 7.0, 26.0);
    part.add(Ball { center: at(70.0, 35.0, 8.0), radius: random.uniform(13.0, 15.0) });
    part.cut(Ball { center: at(70.0, 35.0, 8.0), radius: 11.0 });
    part.cut(Block::sharp([10.6, 10.6, -20.0], [89.4, 59.4, 0.0]));
}

fn clevis(part: &mut Part, random: &mut Random) {
    let (x, y) = (Vec3::x(), Vec3::y());
    let (width, ear) = (random.uniform(34.0, 42.0), random.uniform(6.0, 9.0));
    let radius = random.uniform(14.0, 18.0);
    part.add(Polytope::chamfered([-30.0, 0.0, -radius], [10.0, width, radius], 1.0));
    for low in [0.0, width - ear] {
        part.add(Block::sharp([5.0, low, -radius], [45.0, low + ear, radius]));
        let base = at(45.0, low, 0.0);
        part.add(Rod { base, axis: y, radius, length: ear });
        hole(part, base + ear * y, y, radius - 8.0, ear + 0.5);
    }
    part.cut(Block::rounded([4.0, ear, -40.0], [90.0, width - ear, 40.0], 3.0));
    let mouth = at(-30.0, width / 2.0, 0.0);
    drilled_hole(part, mouth, -x, 8.0, 20.0);
    countersink(part, mouth, -x, 8.0, 1.5);
}

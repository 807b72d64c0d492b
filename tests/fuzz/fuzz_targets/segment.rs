//! Any small cloud must be answered by either method with regions or an error: no panic, no endless work, no number
//! in the answer that is none.
//!
//! From this folder: `mkdir -p corpus/segment`, then
//! `cargo +nightly fuzz run --fuzz-dir . segment corpus/segment seeds_segment -- -max_len=1024 -len_control=0 -timeout=60`.
//! `grown/segment.tar.xz` holds what earlier runs found: unpack it into `corpus/segment` first.
#![no_main]
#![allow(dead_code, unused_imports)]

#[path = "../../../src/fit/mod.rs"]
mod fit;
#[path = "../../../src/geometry/mod.rs"]
mod geometry;
#[path = "../../../src/segment/mod.rs"]
mod segment;

use std::sync::Once;

use geometry::{PointCloud, Vec3};
use libfuzzer_sys::fuzz_target;
use segment::{Method, PARAMETERS, ParameterKind, Parameters, Segmentation, Silent};

/// The most points of a cloud, by two bits of the input: few, for a run must take milliseconds, but some
/// stages begin at 100 points, and others at 200.
const MOST: [usize; 4] = [48, 96, 128, 256];
/// Seeds in a row that may fail where the input does not say: every one costs, and is like the last.
const FAILED_SEEDS: usize = 3;

static POOL: Once = Once::new();

fuzz_target!(|bytes: &[u8]| {
    // one thread: the same bytes take the same way
    POOL.call_once(|| drop(rayon::ThreadPoolBuilder::new().num_threads(1).build_global()));
    let most = MOST[bytes.first().map_or(0, |flags| usize::from(flags >> 1 & 3))];
    let mut bytes = Bytes(bytes);
    let parameters = parameters(&mut bytes);
    let mut points = Vec::new();
    while !bytes.0.is_empty() && points.len() < most {
        piece(&mut bytes, &mut points);
    }
    points.truncate(most);
    let cloud = PointCloud::from_points(points);
    if let Ok(found) = segment::segment(&cloud, &parameters, &Silent) {
        check(&cloud, &parameters, &found);
    }
});

/// The rest of the input; noughts once it is used up.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn byte(&mut self) -> u8 {
        let (first, rest) = self.0.split_first().unwrap_or((&0, &[]));
        self.0 = rest;
        *first
    }

    /// A double of any bits.
    fn raw(&mut self) -> f64 {
        f64::from_bits(u64::from_le_bytes(std::array::from_fn(|_| self.byte())))
    }

    /// A small number of either sign.
    fn small(&mut self) -> f64 {
        f64::from(self.byte() as i8) / 16.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.small(), self.small(), self.small())
    }

    /// A power of ten from 1e-54 to 1e54, mostly near 1.
    fn scale(&mut self) -> f64 {
        let b = self.byte();
        let power = if b < 128 { i32::from(b % 13) - 6 } else { (i32::from(b) - 192) * 54 / 63 };
        10f64.powi(power)
    }
}

/// Parameters as a caller may give them.
fn parameters(bytes: &mut Bytes) -> Parameters {
    let flags = bytes.byte();
    let mut parameters =
        Parameters { min_points: 10, max_failed_seeds: FAILED_SEEDS, ..Parameters::default() };
    if flags & 1 == 1 {
        parameters.method = Method::Rcond;
        parameters.rcond_threshold = 1e-9;
    }
    for _ in 0..flags >> 5 {
        let spec = &PARAMETERS[bytes.byte() as usize % PARAMETERS.len()];
        let value = match spec.kind {
            ParameterKind::Choice(words) => words[bytes.byte() as usize % words.len()].to_owned(),
            ParameterKind::List(words) => {
                let mask = u16::from_le_bytes([bytes.byte(), bytes.byte()]);
                let chosen = words.iter().enumerate().filter(|(k, _)| mask >> k & 1 == 1);
                chosen.map(|(_, w)| *w).collect::<Vec<_>>().join(",")
            }
            ParameterKind::Number { .. } => {
                (bytes.scale() * (bytes.small().abs() + 0.1)).to_string()
            }
            // few: what a caller asks for may well take long
            ParameterKind::Integer { .. } => bytes.byte().to_string(),
            ParameterKind::Boolean => (bytes.byte() & 1 == 1).to_string(),
            ParameterKind::Direction => {
                format!("{},{},{}", bytes.small(), bytes.small(), bytes.small())
            }
            // of files, not of methods
            ParameterKind::Columns { .. }
            | ParameterKind::Text { .. }
            | ParameterKind::Hints { .. } => continue,
        };
        // what is refused stays as it was
        let _ = parameters.set(spec.name, &value);
    }
    parameters
}

/// Adds a few points that lie together in some way.
fn piece(bytes: &mut Bytes, points: &mut Vec<Vec3>) {
    let (kind, count) = (bytes.byte(), bytes.byte() as usize);
    let scale = bytes.scale();
    let at = bytes.vector() * bytes.scale();
    let (u, v) = (bytes.vector() * scale, bytes.vector() * scale);
    let noise = if kind & 64 == 0 { 0.0 } else { bytes.small() / 64.0 };
    let mut state = u64::from(bytes.byte());
    let mut uniform = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let begin = points.len();
    for k in 0..count {
        let p = match kind & 63 {
            // anything
            9 if bytes.0.len() >= 24 => Vec3::new(bytes.raw(), bytes.raw(), bytes.raw()),
            // the points before, mirrored: ties, and parts that are alike
            18 if k < begin => 2.0 * at - points[k],
            // the points before, or nearly
            19 if k < begin => points[k] + 1e-9 * u,
            shape => at + place(shape, k, scale, (u, v), &mut uniform),
        };
        let off = Vec3::new(uniform() - 0.5, uniform() - 0.5, uniform() - 0.5);
        let p = p + off * (noise * scale);
        // coordinates in steps, as programs that write few digits leave them
        let step = scale / 16.0;
        points.push(if kind & 128 == 0 { p } else { (p / step).map(f64::round) * step });
    }
}

/// The `k`-th point of a shape about the origin.
fn place(
    shape: u8,
    k: usize,
    scale: f64,
    (u, v): (Vec3, Vec3),
    uniform: &mut impl FnMut() -> f64,
) -> Vec3 {
    let t = k as f64;
    let (sin, cos) = (2.4 * t).sin_cos();
    match shape % 18 {
        // copies of one point
        0 => Vec3::zeros(),
        // a line, even or not
        1 => u * t,
        2 => u * uniform(),
        // a grid, and a square
        3 => u * (k % 16) as f64 + v * (k / 16) as f64,
        4 => u * uniform() + v * uniform(),
        // a ball's and a tube's wall
        5 => {
            let z = 2.0 * uniform() - 1.0;
            let s = (1.0 - z * z).sqrt();
            scale * Vec3::new(s * cos, s * sin, z)
        }
        6 => u.norm() * Vec3::new(cos, sin, 0.0) + v * uniform(),
        // a cone, a saddle
        7 => {
            let r = uniform();
            scale * Vec3::new(r * cos, r * sin, r * v.norm())
        }
        8 => {
            let (x, y) = (uniform() - 0.5, uniform() - 0.5);
            scale * Vec3::new(x, y, x * x - v.x * y * y)
        }
        // an ellipsoid, and an elliptic tube, whole or in part
        10 => {
            let z = uniform();
            let s = (1.0 - z * z).sqrt();
            Vec3::new(u.x * s * cos, u.y * s * sin, u.z * z)
        }
        11 => {
            let (sin, cos) = (v.x * uniform()).sin_cos();
            Vec3::new(u.x * cos, u.y * sin, u.z * uniform())
        }
        // a ring, whole or in part
        12 => {
            let (turn, side) = (v.y * uniform()).sin_cos();
            let r = u.norm() + v.norm() * cos;
            Vec3::new(r * turn, r * side, v.norm() * sin)
        }
        // three faces of a box that meet in a corner
        13 => {
            let mut p = Vec3::new(uniform(), uniform(), uniform());
            p[k % 3] = 0.0;
            p.component_mul(&u)
        }
        // hyperboloids of one sheet and of two
        14 => {
            let z = 2.0 * uniform() - 1.0;
            let s = (z * z + v.x).abs().sqrt();
            scale * Vec3::new(s * cos, s * sin, z)
        }
        // rings or scan rows of a tube, far apart
        15 => {
            let (sin, cos) = (t / 2.0).sin_cos();
            u.norm() * Vec3::new(cos, sin, 0.0) + v * (k / 12) as f64
        }
        // a screw, and a step between two planes
        16 => u.norm() * Vec3::new(cos, sin, 0.0) + v * (t / 16.0),
        17 => u * uniform() + v * (k % 2) as f64 + u.cross(&v) / scale * uniform(),
        _ => scale * Vec3::new(uniform(), uniform(), uniform()),
    }
}

/// What holds for every answer.
fn check(cloud: &PointCloud, parameters: &Parameters, found: &Segmentation) {
    assert_eq!(found.labels.len(), cloud.points.len());
    let mut counts = vec![0; found.regions.len()];
    for &l in &found.labels {
        assert!(l >= -1);
        if let Ok(l) = usize::try_from(l) {
            counts[l] += 1;
        }
    }
    assert!(found.regions.len() <= parameters.max_regions);
    let free = found.labels.iter().filter(|l| **l < 0).count();
    assert_eq!(found.unassigned.count, free);
    assert_eq!(found.unassigned.reasons.values().sum::<usize>(), free);
    for (region, count) in found.regions.iter().zip(counts) {
        assert_eq!(region.point_count, count);
        let numbers = region.coefficients.iter().chain(&region.local_coefficients).flatten();
        let numbers = numbers.chain(&region.local_origin).chain([&region.fit.rms, &region.fit.max]);
        assert!(numbers.clone().all(|x| x.is_finite()), "{region:?}");
        assert!(region.local_coefficients.is_none_or(|all| all.iter().any(|a| *a != 0.0)), "{region:?}");
        let surface = serde_json::to_string(&region.surface).unwrap_or_default();
        assert!(region.surface.is_none() || !surface.contains("null"), "{region:?}");
    }
}

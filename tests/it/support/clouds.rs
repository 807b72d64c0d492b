//! Small clouds made in code.

use std::fmt::Write;

/// A number in 0..1 that looks random; the same for the same `i`.
fn scatter(i: usize, step: f64) -> f64 {
    (i as f64 * step).fract()
}

/// `n` points on a cylinder of radius 10 and length 50 about the z axis, on a regular spiral.
pub fn cylinder(n: usize) -> Vec<[f64; 3]> {
    let point = |i| {
        let angle = std::f64::consts::TAU * scatter(i, 0.618_033_988_749_895);
        [10.0 * angle.cos(), 10.0 * angle.sin(), 50.0 * i as f64 / n as f64]
    };
    (0..n).map(point).collect()
}

/// A half cylinder that runs out into two planes, with a little noise: something with regions.
pub fn bracket(n: usize) -> Vec<[f64; 3]> {
    let noise = |i| 0.01 * (scatter(i, 0.754_877_666_246_693) - 0.5);
    let point = |i| {
        let (along, y) =
            (scatter(i, 0.618_033_988_749_895) * 60.0, scatter(i, 0.569_840_290_998_053) * 40.0);
        let r = 10.0 + noise(i);
        let angle = (along - 20.0) / 20.0 * std::f64::consts::PI;
        match along {
            a if a < 20.0 => [r, y, a - 20.0],
            a if a < 40.0 => [r * angle.cos(), y, r * angle.sin()],
            a => [-r, y, 40.0 - a],
        }
    };
    (0..n).map(point).collect()
}

/// The points as lines of text that read back as the same numbers.
pub fn xyz(points: &[[f64; 3]]) -> String {
    points.iter().fold(String::new(), |mut text, [x, y, z]| {
        let _ = writeln!(text, "{x} {y} {z}");
        text
    })
}

/// The points as a binary PLY file.
pub fn ply(points: &[[f64; 3]]) -> Vec<u8> {
    let mut bytes = ply_header(points.len()).into_bytes();
    bytes.extend(points.iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes
}

/// The header of a binary PLY file with `n` points.
pub fn ply_header(n: usize) -> String {
    format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {n}\nproperty double x\n\
         property double y\nproperty double z\nend_header\n"
    )
}

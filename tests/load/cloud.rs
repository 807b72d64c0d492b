use bytes::Bytes;

/// `n` points on a half cylinder that runs out into two planes, with noise, as a binary PLY file.
pub fn bracket(n: usize) -> Bytes {
    let scatter = |i: usize, step: f64| (i as f64 * step).fract();
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {n}\nproperty double x\n\
         property double y\nproperty double z\nend_header\n"
    );
    let point = |i| {
        let along = scatter(i, 0.618_033_988_749_895) * 60.0;
        let y = scatter(i, 0.569_840_290_998_053) * 40.0;
        let r = 10.0 + 0.01 * (scatter(i, 0.754_877_666_246_693) - 0.5);
        let angle = (along - 20.0) / 20.0 * std::f64::consts::PI;
        match along {
            a if a < 20.0 => [r, y, a - 20.0],
            a if a < 40.0 => [r * angle.cos(), y, r * angle.sin()],
            a => [-r, y, 40.0 - a],
        }
    };
    let coordinates = (0..n).flat_map(point).flat_map(f64::to_le_bytes);
    header.into_bytes().into_iter().chain(coordinates).collect()
}

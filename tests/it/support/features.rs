//! The features of tests/features/reference.py: the same points to the last bit, from whole numbers by operations that
//! every language rounds alike.

/// The kinds, in the order of the script.
pub const KINDS: [&str; 9] = [
    "plane",
    "sphere",
    "cylinder",
    "cone",
    "elliptic_cylinder",
    "ellipsoid",
    "torus",
    "circle",
    "line",
];

/// SplitMix64.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / 9_007_199_254_740_992.0
    }

    pub fn noise(&mut self) -> f64 {
        let s = self.next() + self.next() + self.next() + self.next();
        (s - 2.0) * 1.732_050_807_568_877_2
    }
}

fn turn(a: f64) -> (f64, f64) {
    let k = a as u64;
    let t = a - k as f64;
    let d = 1.0 + t * t;
    let (mut c, mut s) = ((1.0 - t * t) / d, (t + t) / d);
    for _ in 0..k % 4 {
        (c, s) = (-s, c);
    }
    (c, s)
}

fn rotation([a, b, c, d]: [f64; 4]) -> [[f64; 3]; 3] {
    let n = a * a + b * b + c * c + d * d;
    [
        [(a * a + b * b - c * c - d * d) / n, 2.0 * (b * c - a * d) / n, 2.0 * (b * d + a * c) / n],
        [2.0 * (b * c + a * d) / n, (a * a - b * b + c * c - d * d) / n, 2.0 * (c * d - a * b) / n],
        [2.0 * (b * d - a * c) / n, 2.0 * (c * d + a * b) / n, (a * a - b * b - c * c + d * d) / n],
    ]
}

/// A feature: its points, and the place and size that its reference solution is told about.
pub struct Case {
    pub size: f64,
    pub place: [f64; 3],
    pub points: Vec<[f64; 3]>,
}

impl Case {
    pub fn new(kind: &str, index: usize) -> Self {
        let code = KINDS.iter().position(|k| *k == kind).unwrap();
        let mut random = Random::new((1000 * code + index) as u64);
        let size = [1.0, 1e-3, 1e3, 1e6, 25.0, 0.125][index % 6];
        let mut offset = [0.0, 1.0, 1e3, 1e6][(index / 3) % 4];
        if size < 1.0 {
            offset = f64::min(offset, 1000.0 * size);
        }
        let quarters = [4.0, 2.0, 1.0, 4.0][index % 4];
        let n = [12, 20, 60, 8, 100, 30, 200, 40, 9][index % 9];
        let most = match kind {
            "cone" => 10,
            "elliptic_cylinder" | "torus" => 14,
            "ellipsoid" => 18,
            _ => 8,
        };
        let n = n.max(if quarters == 4.0 { most } else { 2 * most });
        let mut sigma = [0.0, 1e-5, 1e-4, 1e-3, 5e-3][(index / 2) % 5];
        let mut lobe = [0.0, 0.0, 3e-3, 0.0, 1e-3][index % 5];
        if quarters < 4.0 {
            (sigma, lobe) = (sigma * quarters / 16.0, lobe * quarters / 16.0);
        }
        let whole = [0; 4].map(|_| (random.next() * 9.0).floor() + 1.0);
        let rows = rotation(whole);
        let place = [0; 3].map(|_| offset * (random.next() - 0.5));
        let sizes = match kind {
            "sphere" | "cylinder" | "circle" => [1.0, 0.0, 0.0],
            "cone" => [1.0, [0.125, 0.5, 0.75][index % 3], 0.0],
            "elliptic_cylinder" => [1.0, 0.625, 0.0],
            "ellipsoid" => [1.0, 0.75, 0.5],
            "torus" => [1.0, [0.25, 0.5][index % 2], 0.0],
            _ => [0.0; 3],
        };
        let mut points = Vec::new();
        for _ in 0..n {
            let mut u = random.next();
            if index % 5 == 2 {
                u = u * u;
            }
            let v = random.next();
            let bump = lobe * (4.0 * (u - 0.5) * (u - 0.5) - 0.5) + sigma * random.noise();
            let other = sigma * random.noise();
            let q = local(kind, sizes, quarters, [u, v, bump, other]).map(|c| size * c);
            let at =
                |i: usize| rows[i][0] * q[0] + rows[i][1] * q[1] + rows[i][2] * q[2] + place[i];
            points.push([at(0), at(1), at(2)]);
        }
        Self { size, place, points }
    }
}

fn local(kind: &str, sizes: [f64; 3], quarters: f64, [u, v, bump, other]: [f64; 4]) -> [f64; 3] {
    let (c, s) = turn(quarters * u);
    let [a, b, _] = sizes;
    let h = 2.0 * v - 1.0;
    match kind {
        "plane" => [2.0 * u - 1.0, v - 0.5, bump],
        "line" => [bump, other, 2.0 * u - 1.0],
        "circle" => [(1.0 + bump) * c, (1.0 + bump) * s, other],
        "cylinder" => [(1.0 + bump) * c, (1.0 + bump) * s, h],
        "cone" => {
            let r = a + b * h + bump;
            [r * c, r * s, h]
        }
        "elliptic_cylinder" => [(a + bump) * c, (b + bump) * s, h],
        "torus" => {
            let (d, e) = turn(4.0 * v);
            let r = a + (b + bump) * d;
            [r * c, r * s, (b + bump) * e]
        }
        _ => {
            let z = if quarters == 4.0 { h } else { 0.5 * h };
            let r = (1.0 - z * z).sqrt();
            let (x, y) = (r * c, r * s);
            if kind == "sphere" {
                return [(1.0 + bump) * x, (1.0 + bump) * y, (1.0 + bump) * z];
            }
            [(sizes[0] + bump) * x, (sizes[1] + bump) * y, (sizes[2] + bump) * z]
        }
    }
}

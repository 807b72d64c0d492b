use super::{blocks::BLOCK, *};
use crate::formats::{Format, Hints, Limits, MeshWay, Meshes, hostile::files, read};

/// Numbers like chance.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// A tube of radius 5 and length 20, and a plane through it, with some noise.
fn tube(n: usize, seed: u64) -> Vec<Vec3> {
    let mut random = Random(seed);
    let point = |k: usize| {
        let turn = std::f64::consts::TAU * random.unit();
        if k.is_multiple_of(3) {
            return Vec3::new(20.0 * random.unit(), 20.0 * random.unit(), 0.05 * random.normal());
        }
        let r = 5.0 + 0.05 * random.normal();
        Vec3::new(r * turn.cos(), r * turn.sin(), 20.0 * random.unit() - 10.0)
    };
    (0..n).map(point).collect()
}

fn thinned_points(points: &[Vec3], length: f64) -> PointCloud {
    thinned(&PointCloud::from_points(points.to_vec()), length, &Limits::default()).unwrap()
}

/// The same as the heading of the module says it, by comparing all with all.
fn by_definition(points: &[Vec3], length: f64) -> Vec<u32> {
    let cells = Cells::of(EDGE * length);
    let mut order: Vec<First> = points.iter().zip(0..).map(|(p, k)| First::new(*p, k)).collect();
    order.sort_by(First::order);
    let (mut seen, mut kept) = (std::collections::HashSet::new(), Vec::<First>::new());
    for first in order.iter().filter(|first| seen.insert(cells.cell(&first.point))) {
        if kept.iter().all(|k| (k.point - first.point).norm() >= length) {
            kept.push(*first);
        }
    }
    let mut index: Vec<u32> = kept.iter().map(|first| first.index).collect();
    index.sort_unstable();
    index
}

#[test]
fn kept_points_are_those_of_the_definition_and_labels_those_of_the_nearest() {
    for (n, length) in [(1, 1.0), (300, 0.1), (3000, 0.5), (3000, 1.7), (3000, 9.0), (500, 1e4)] {
        let points = tube(n, n as u64);
        let cloud = thinned_points(&points, length);
        let index = by_definition(&points, length);
        assert_eq!(cloud.input_index.clone().unwrap_or((0..n as u32).collect()), index, "{length}");
        let told = cloud.thinned.as_ref().unwrap();
        assert_eq!((told.nearest.len(), told.finite, cloud.skipped()), (n, n, 0));
        let mut farthest: f64 = 0.0;
        for (p, &k) in points.iter().zip(&told.nearest) {
            let distance = |q: &Vec3| (p - q).norm();
            let least = cloud.points.iter().map(distance).fold(f64::INFINITY, f64::min);
            assert_eq!(distance(&cloud.points[k as usize]), least);
            farthest = farthest.max(least);
        }
        assert!(farthest <= 2.0 * length, "{farthest} {length}");
        let apart = |a: usize| (0..a).all(|b| (cloud.points[a] - cloud.points[b]).norm() >= length);
        assert!((0..cloud.points.len()).all(apart));
    }
}

#[test]
fn the_order_of_points_does_not_matter() {
    // several blocks
    let points = tube(2 * BLOCK + 4711, 5);
    let one = thinned_points(&points, 0.3);
    let mut turned = points.clone();
    turned.reverse();
    turned.rotate_left(12_345);
    let other = thinned_points(&turned, 0.3);
    let sorted = |cloud: &PointCloud| {
        let mut all: Vec<[f64; 3]> = cloud.points.iter().map(|p| (*p).into()).collect();
        all.sort_by(|a, b| a.partial_cmp(b).unwrap());
        all
    };
    assert_eq!(sorted(&one), sorted(&other));
    let of = |cloud: &PointCloud, k: usize| {
        cloud.points[cloud.thinned.as_ref().unwrap().nearest[k] as usize]
    };
    for (k, p) in points.iter().enumerate().step_by(97) {
        let place = (points.len() - 1 - k + points.len() - 12_345) % points.len();
        assert_eq!(turned[place], *p);
        assert_eq!(of(&one, k), of(&other, place));
    }
}

#[test]
fn a_length_below_the_spacing_keeps_all() {
    let grid = |k: usize| Vec3::new((k % 40) as f64, (k / 40 % 40) as f64, (k / 1600) as f64);
    let points: Vec<Vec3> = (0..4800).map(|k| 1e4 * Vec3::x() + grid(k)).collect();
    for length in [1e-3, 0.5, 0.999_999, 1.0] {
        let cloud = thinned_points(&points, length);
        assert_eq!((cloud.points == points, &cloud.input_index), (true, &None), "{length}");
        assert!(cloud.thinned.unwrap().nearest.iter().zip(0..).all(|(a, b)| *a == b));
    }
    assert!(thinned_points(&points, 1.000_001).points.len() < points.len());
}

#[test]
fn noise_stays_as_it_is_on_planes_wherever_they_lie() {
    // 300 points in a square of the length's side, the planes of machined parts and a slanting one
    let (length, sigma, n) = (1.0, 0.05, 400_000);
    let normals = [Vec3::z(), Vec3::x(), Vec3::new(1.0, 1.0, 0.0), Vec3::new(0.3, -0.5, 0.8)];
    for (k, normal) in normals.map(|n: Vec3| n.normalize()).into_iter().enumerate() {
        let (u, v) = crate::geometry::perpendicular_frame(&normal);
        for height in [0.0, 0.1, 0.25, 0.4] {
            let mut random = Random(k as u64 + (1000.0 * height) as u64);
            let side = (n as f64 / 300.0).sqrt();
            let mut at = |scale: f64| scale * random.unit();
            let mut points = Vec::new();
            for _ in 0..n {
                let (a, b) = (at(side), at(side));
                let noise = sigma * ((0..12).map(|_| at(1.0)).sum::<f64>() - 6.0);
                points.push(a * u + b * v + (height + noise) * normal);
            }
            let kept = thinned_points(&points, length).points;
            let off: Vec<f64> = kept.iter().map(|p| (p.dot(&normal) - height) / sigma).collect();
            let count = off.len() as f64;
            let mean = off.iter().sum::<f64>() / count;
            let variance = off.iter().map(|d| d * d).sum::<f64>() / count;
            // four standard deviations of either
            assert!(mean.abs() < 4.0 / count.sqrt(), "{normal:?} {height}: mean {mean} of {count}");
            let allowed = 4.0 * (2.0 / count).sqrt();
            assert!((variance - 1.0).abs() < allowed, "{normal:?} {height}: variance {variance}");
        }
    }
}

#[test]
fn holes_are_left_out_and_copies_go_with_the_first() {
    let mut points = tube(2000, 9);
    points[3] = Vec3::new(0.0, f64::NAN, 0.0);
    points[7] = points[5];
    let few = thinned_points(&points, 1e-9);
    assert_eq!((few.points.len(), few.skipped(), few.input_len), (1998, 1, 2000));
    let nearest = &few.thinned.as_ref().unwrap().nearest;
    assert_eq!((nearest[3], nearest[7]), (Thinned::NONE, nearest[5]));
    let labels: Vec<i32> = (0..1998).collect();
    let spread = few.labels_in_input_order(labels);
    assert_eq!((spread[3], spread[5], spread[7], spread[8]), (-1, 4, 4, 6));
}

/// The points of a cloud as a text.
fn text(points: &[Vec3]) -> Vec<u8> {
    points.iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z)).collect::<String>().into_bytes()
}

#[test]
fn points_at_the_origin_are_holes_as_they_are_without_thinning() {
    for (zeros, spots) in [(9, 0), (10, 0), (40, 30), (70, 30)] {
        let mut points: Vec<Vec3> =
            tube(500, 3).into_iter().chain(vec![Vec3::zeros(); zeros]).collect();
        if spots > 0 {
            // as many copies of few other points
            points = points
                .into_iter()
                .take(8)
                .cycle()
                .take(8 * spots)
                .chain(vec![Vec3::zeros(); zeros])
                .collect();
        }
        let bytes = text(&points);
        let told =
            |thin| read(&bytes, Hints { thin, ..Hints::default() }, &Limits::default()).unwrap();
        let (whole, thin) = (told(None), told(Some(1e-6)));
        assert_eq!(thin.holes_at_origin, whole.holes_at_origin, "{zeros} {spots}");
        assert_eq!(thin.skipped(), whole.skipped());
        let is_hole = whole.holes_at_origin > 0;
        let last = *thin.thinned.as_ref().unwrap().nearest.last().unwrap();
        assert_eq!(last == Thinned::NONE, is_hole);
        assert_eq!(thin.points.contains(&Vec3::zeros()), !is_hole);
    }
}

#[test]
fn every_format_is_thinned_as_its_points_are() {
    for (format, bytes) in files() {
        for way in [MeshWay::Auto, MeshWay::Vertices] {
            let meshes = Meshes { way, ..Meshes::default() };
            let hints = Hints { meshes, ..Hints::default() };
            let whole = read(&bytes, hints, &Limits::default()).unwrap();
            let spread =
                whole.points.iter().map(|p| (p - whole.points[0]).norm()).fold(0.0, f64::max);
            // one file has one point
            let spread = spread.max(1e-3);
            for length in [spread / 5.0, spread / 1e4] {
                let hints = Hints { thin: Some(length), ..hints };
                let thin = read(&bytes, hints, &Limits::default()).unwrap();
                assert_eq!(thin, thinned(&whole, length, &Limits::default()).unwrap(), "{format}");
                assert_eq!((thin.input_len, thin.skipped()), (whole.input_len, whole.skipped()));
            }
        }
    }
}

#[test]
fn points_are_handed_on_as_they_are_read() {
    for (format, bytes) in files() {
        let whole = read(&bytes, None, &Limits::default()).unwrap();
        let (mut all, mut expected) = (Vec::new(), Vec::new());
        let hints = Hints { thin: Some(1.0), ..Hints::default() };
        crate::formats::each_point(&bytes, hints, &Limits::default(), &mut all).unwrap();
        whole.each_block(|points| Sink::take(&mut expected, points)).unwrap();
        let bits = |all: &[Vec3]| all.iter().filter(|p| is_finite(p)).copied().collect::<Vec<_>>();
        assert_eq!((all.len(), bits(&all)), (expected.len(), bits(&expected)), "{format}");
    }
}

#[test]
fn what_cannot_be_done_is_told_with_a_way_out() {
    let points = tube(5000, 2);
    let cells = Cells::of(EDGE);
    let at = |x: f64| {
        thinned(&PointCloud::from_points(vec![Vec3::new(x, 0.0, 0.0)]), 1.0, &Limits::default())
    };
    assert!(at(cells.largest()).is_ok());
    let told = at(cells.largest() * 1.001).unwrap_err().to_string();
    assert!(told.contains("thin=1 is too small") && told.contains("or more"), "{told}");
    for length in [1e-320, 1e-300] {
        let cloud = PointCloud::from_points(vec![Vec3::new(20.0, 0.0, 0.0)]);
        let told = thinned(&cloud, length, &Limits::default()).unwrap_err().to_string();
        assert!(told.len() < 120 && !told.contains("inf"), "{told}");
    }
    // the tables of so many cells
    let cloud = PointCloud::from_points(points);
    let with =
        |max_thin_bytes| thinned(&cloud, 0.1, &Limits { max_thin_bytes, ..Limits::default() });
    let mut firsts = Firsts::of(Cells::of(EDGE * 0.1));
    firsts.take(&cloud.points, 0, |_| false).unwrap();
    assert!(with(TIMES * firsts.bytes()).is_ok());
    let told = with(TIMES * firsts.bytes() - 1).unwrap_err().to_string();
    assert!(told.contains("take a larger thin"), "{told}");
    let bytes = text(&cloud.points);
    let max = |max_points| {
        read(&bytes, Hints { thin: Some(1.0), ..Hints::default() }, &Limits::of(max_points))
    };
    assert!(max(5000).is_ok());
    assert!(matches!(max(4999), Err(FormatError::TooManyPoints { limit: 4999, .. })));
    assert!(matches!(
        read(
            b"nan 1 2\n",
            Hints { thin: Some(1.0), format: Some(Format::Xyz), ..Hints::default() },
            &Limits::default()
        ),
        Err(FormatError::NoFinitePoints { points: 1 })
    ));
}

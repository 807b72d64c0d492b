//! STEP files, read back from their text alone.

use conicoid::geometry::{PointCloud, Vec3};
use conicoid::model::{Source, step};
use conicoid::segment::{Parameters, Segmentation, Silent, segment};

use super::support::solid::{Shell, hemisphere, shells};
use super::support::step::File;
use super::support::truth::{Random, cad};

fn found(points: &[Vec3]) -> Segmentation {
    segment(&PointCloud::from_points(points.to_vec()), &Parameters::default(), &Silent).unwrap()
}

fn text(points: &[Vec3], found: &Segmentation) -> String {
    let noise = found.parameters.noise_sigma.unwrap();
    let source = Source { points, labels: &found.labels, regions: &found.regions, noise };
    step(&source, None, "1.2.3", |label| [label as u8, 0, 255])
}

/// Every edge of a closed shell lies between two faces that run along it in opposite ways.
fn expect_closed(shell: &Shell) {
    assert!(shell.closed);
    for (edge, uses) in shell.uses() {
        assert_eq!(uses, [1, 1], "edge #{edge}");
    }
}

/// Points of a box of 40 by 30 by 20 with a bore of radius 6 through it along z; `keep` of its sides -x, +x, -y, +y, -z, +z.
fn bored_box(keep: [bool; 6], sigma: f64) -> Vec<Vec3> {
    let mut random = Random::new(11);
    let half = Vec3::new(20.0, 15.0, 10.0);
    let mut points = Vec::new();
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        for side in 0..2 {
            if !keep[2 * k + side] {
                continue;
            }
            for _ in 0..(4.0 * half[i] * half[j] * 6.0) as usize {
                let mut p = Vec3::zeros();
                p[k] = half[k] * (2.0 * side as f64 - 1.0);
                p[i] = random.uniform(-half[i], half[i]);
                p[j] = random.uniform(-half[j], half[j]);
                if k < 2 || p.x.hypot(p.y) > 6.0 {
                    points.push(p);
                }
            }
        }
    }
    for _ in 0..(2.0 * std::f64::consts::PI * 6.0 * 20.0 * 6.0) as usize {
        let (sin, cos) = random.uniform(0.0, std::f64::consts::TAU).sin_cos();
        points.push(Vec3::new(6.0 * cos, 6.0 * sin, random.uniform(-10.0, 10.0)));
    }
    let turn = random.rotation();
    points
        .iter()
        .map(|p| turn * p + sigma * random.normal3() + Vec3::new(300.0, -200.0, 100.0))
        .collect()
}

#[test]
fn a_box_with_a_bore_is_a_solid_of_its_volume_with_one_handle() {
    let points = bored_box([true; 6], 0.01);
    let result = found(&points);
    let text = text(&points, &result);
    let file = File::read(&text);
    let all = shells(&file, 1e-6);
    let [solid] = &all[..] else { panic!("{} shells", all.len()) };
    expect_closed(solid);
    assert_eq!((solid.faces.len(), solid.genus(&file)), (7, 1));
    let bore = std::f64::consts::PI * 36.0;
    let volume = 40.0 * 30.0 * 20.0 - bore * 20.0;
    assert!((solid.volume() / volume - 1.0).abs() < 5e-4, "{}", solid.volume());
    let area = 2.0 * (40.0 * 30.0 + 40.0 * 20.0 + 30.0 * 20.0) - 2.0 * bore
        + 12.0 * std::f64::consts::PI * 20.0;
    assert!((solid.area() / area - 1.0).abs() < 5e-4, "{}", solid.area());
    // The bore's edges are ellipses or circles, all others lines.
    assert_eq!(file.named("LINE").count(), 12);
    assert_eq!(file.named("CIRCLE").count() + file.named("ELLIPSE").count(), 2);
    assert!(file.header.contains("1 closed solids, 0 open shells; lengths in millimetres"));
    assert!(text.contains("SI_UNIT(.MILLI.,.METRE.)") && text.contains("conicoid 1.2.3"));
    assert_eq!(file.named("STYLED_ITEM").count(), 7);
}

#[test]
fn a_box_without_its_lid_is_open_and_says_where() {
    let points = bored_box([true, true, true, true, true, false], 0.01);
    let result = found(&points);
    let file = File::read(&text(&points, &result));
    let all = shells(&file, 1e-6);
    let [shell] = &all[..] else { panic!("{} shells", all.len()) };
    assert!(!shell.closed && shell.faces.len() == 6);
    let bore = std::f64::consts::PI * 36.0;
    let area =
        2.0 * (40.0 * 20.0 + 30.0 * 20.0) + 1200.0 - bore + 12.0 * std::f64::consts::PI * 20.0;
    assert!((shell.area() / area - 1.0).abs() < 0.01, "{} {area}", shell.area());
    // The four walls and the bore, not the floor.
    let told =
        shell.description.strip_prefix("open: borders without a neighbour at region ").unwrap();
    let open: Vec<usize> = told.split(", ").map(|r| r.parse().unwrap()).collect();
    let floor = result.regions.iter().filter(|r| r.neighbours.len() == 5).map(|r| r.id);
    let expected: Vec<usize> = (0..6).filter(|id| !floor.clone().any(|f| f == *id)).collect();
    assert_eq!(open, expected);
    let uses = shell.uses();
    assert!(uses.values().all(|u| u[0] <= 1 && u[1] <= 1));
}

#[test]
fn a_dome_on_a_pipe_shares_a_circle_with_it_and_the_pipe_ends_in_another() {
    let mut random = Random::new(5);
    let radius = 8.0;
    let mut points = Vec::new();
    for _ in 0..9000 {
        let (sin, cos) = random.uniform(0.0, std::f64::consts::TAU).sin_cos();
        points.push(Vec3::new(radius * cos, radius * sin, random.uniform(-20.0, 0.0)));
    }
    while points.len() < 12_600 {
        let d = random.direction();
        if d.z > 0.0 {
            points.push(d * radius);
        }
    }
    let turn = random.rotation();
    let points: Vec<Vec3> = points.iter().map(|p| turn * p + 0.005 * random.normal3()).collect();
    let file = File::read(&text(&points, &found(&points)));
    let all = shells(&file, 0.01);
    let [shell] = &all[..] else { panic!("{} shells", all.len()) };
    assert!(!shell.closed && shell.faces.len() == 2);
    assert_eq!(file.named("EDGE_CURVE").count(), 2);
    assert_eq!(file.named("CIRCLE").count() + file.named("ELLIPSE").count(), 2);
    for face in &shell.faces {
        let truth = match face.surface.kind.as_str() {
            "SPHERICAL_SURFACE" => hemisphere(radius),
            _ => std::f64::consts::TAU * radius * 20.0,
        };
        let area = face.measure().0;
        assert!((area / truth - 1.0).abs() < 0.01, "{}: {area} {truth}", face.name);
    }
}

#[test]
fn bodies_of_one_surface_are_solids() {
    let mut random = Random::new(6);
    let mut points = Vec::new();
    while points.len() < 6000 {
        // Evenly over the ellipsoid: its area for each of the sphere's, over the largest.
        let (d, axes) = (random.direction(), Vec3::new(14.0, 10.0, 7.0));
        if random.uniform(0.0, 1.0) < 7.0 * d.component_div(&axes).norm() {
            points.push(d.component_mul(&axes));
        }
    }
    points.extend((0..5000).map(|_| 9.0 * random.direction() + Vec3::new(60.0, 0.0, 0.0)));
    while points.len() < 18_000 {
        let [u, v] = [0; 2].map(|_| random.uniform(0.0, std::f64::consts::TAU));
        let r = 15.0 + 5.0 * v.cos();
        if random.uniform(0.0, 20.0) < r {
            points.push(Vec3::new(r * u.cos(), 70.0 + r * u.sin(), 5.0 * v.sin()));
        }
    }
    points.iter_mut().for_each(|p| *p += 0.01 * random.normal3());
    let file = File::read(&text(&points, &found(&points)));
    let all = shells(&file, 1e-6);
    assert!(all.len() == 3 && all.iter().all(|s| s.closed));
    // The ellipsoid is two halves with one ellipse around; ball and ring have no border.
    assert_eq!((file.named("EDGE_CURVE").count(), file.named("VERTEX_LOOP").count()), (1, 2));
    let halves = all.iter().find(|s| s.faces.len() == 2).unwrap();
    expect_closed(halves);
    assert_eq!(halves.genus(&file), 0);
}

#[test]
fn machined_parts_are_solids_of_their_volume() {
    for (name, n, sigma) in [
        ("flange", 60_000, 0.02),
        ("cover", 80_000, 0.01),
        ("tee", 60_000, 0.05),
        ("lever", 50_000, 0.01),
    ] {
        let cloud = cad::make(name, 1, n, sigma, true).unwrap();
        let result = found(&cloud.points);
        let file = File::read(&text(&cloud.points, &result));
        let all = shells(&file, 0.1);
        assert_eq!(all.len(), 1, "{name}");
        expect_closed(&all[0]);
        assert!(all[0].genus(&file) > 0, "{name}");
        let truth = cad::volume(name, 1).unwrap();
        let volume = all[0].volume();
        assert!((volume / truth - 1.0).abs() < 5e-3, "{name}: {volume} {truth}");
    }
}

#[test]
fn surfaces_have_the_parameters_of_the_result() {
    let cloud = cad::make("flange", 2, 60_000, 0.02, true).unwrap();
    let result = found(&cloud.points);
    let file = File::read(&text(&cloud.points, &result));
    let mut seen = vec![0; result.regions.len()];
    for face in shells(&file, 0.1).iter().flat_map(|s| &s.faces) {
        let id: usize = face.name.split(' ').nth(1).unwrap().parse().unwrap();
        let region = &result.regions[id];
        seen[id] += 1;
        assert_eq!(face.name.split(' ').nth(2), Some(region.surface_type.name()));
        let s = &face.surface;
        let json = serde_json::to_value(region.surface).unwrap();
        let number = |key: &str| json[key].as_f64().unwrap();
        let vector = |key: &str| -> Vec3 { serde_json::from_value(json[key].clone()).unwrap() };
        let same = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-9, "{}: {a} {b}", face.name);
        match s.kind.as_str() {
            "PLANE" => assert!((s.axes[2] - vector("normal")).norm() < 1e-12),
            "CYLINDRICAL_SURFACE" => same(s.sizes[0], number("radius")),
            "CONICAL_SURFACE" => {
                same(s.sizes[1], number("half_angle"));
                let apex = s.origin - s.axes[2] * (s.sizes[0] / s.sizes[1].tan());
                assert!((apex - vector("apex")).norm() < 1e-9 * apex.norm());
            }
            "TOROIDAL_SURFACE" => {
                same(s.sizes[0], number("major_radius"));
                same(s.sizes[1], number("minor_radius"));
            }
            "SPHERICAL_SURFACE" => same(s.sizes[0], number("radius")),
            other => panic!("{other}"),
        }
    }
    assert!(seen.iter().all(|n| *n > 0), "{seen:?}");
}

#[test]
fn the_file_is_the_same_on_any_number_of_threads() {
    let points = bored_box([true; 6], 0.02);
    let result = found(&points);
    let written = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| text(&points, &result))
    };
    assert!(written(1) == written(4));
}

#[test]
fn a_cloud_without_a_region_is_a_file_without_a_product() {
    let text =
        step(&Source { points: &[], labels: &[], regions: &[], noise: 0.0 }, None, "1", |_| [0; 3]);
    let file = File::read(&text);
    assert_eq!(file.named("PRODUCT").count(), 0);
    assert!(file.header.contains("0 regions"));
}

//! Fits of single features against solutions in 50 digits, certificates, and the same numbers from every transport.

use std::{collections::BTreeMap, fs};

use conicoid::{
    fit::feature::{Asked, Association, FeatureType, Fixed, Local, Pose, assess, extreme, least},
    geometry::{Mat3, Vec3},
    service::message::v1,
};
use serde_json::Value;

use super::support::{
    conicoid,
    features::{Case, KINDS, Random},
    problem, start,
};

/// The least-squares solutions of tests/features/reference.py.
const REFERENCE: &str = include_str!("../features/reference.tsv");

/// Points of a case.
fn points(case: &Case) -> Vec<Vec3> {
    case.points.iter().map(|p| Vec3::from(*p)).collect()
}

/// Largest difference of two poses in units of the feature's size, and in radians.
fn apart(found: &Pose, reference: &Pose, beside: &Vec3) -> f64 {
    use FeatureType::{Cone, Ellipsoid, EllipticCylinder, Sphere};
    let (mut a, b) = (found.recentred(beside), reference.recentred(beside));
    let mut worst = (a.origin - b.origin).norm();
    if !matches!(a.kind, Sphere | Ellipsoid) {
        worst = worst.max(a.w().cross(&b.w()).norm());
    }
    if a.kind == Cone && a.w().dot(&b.w()) < 0.0 {
        a.size[1] = -a.size[1];
    }
    let axes = |pose: &Pose, count: usize| {
        let mut axes: Vec<(f64, Vec3)> =
            (0..count).map(|i| (pose.size[i], pose.frame.column(i).into_owned())).collect();
        axes.sort_by(|a, b| b.0.total_cmp(&a.0));
        axes
    };
    let count = match a.kind {
        EllipticCylinder => 2,
        Ellipsoid => 3,
        _ => {
            let sizes = a.size.iter().zip(b.size).map(|(a, b)| (a - b).abs());
            return sizes.fold(worst, f64::max);
        }
    };
    for (a, b) in axes(&a, count).iter().zip(axes(&b, count)) {
        worst = worst.max((a.0 - b.0).abs()).max(a.1.cross(&b.1).norm());
    }
    worst
}

#[test]
fn least_squares_features_are_those_of_fifty_digits() {
    let mut seen = BTreeMap::new();
    for line in REFERENCE.lines().filter(|line| !line.starts_with('#')) {
        let fields: Vec<&str> = line.split('\t').collect();
        let v: Vec<f64> = fields[2..].iter().map(|text| text.parse().unwrap()).collect();
        let three = |k: usize| Vec3::new(v[k], v[k + 1], v[k + 2]);
        let (kind, index) = (FeatureType::from_name(fields[0]).unwrap(), fields[1]);
        let case = Case::new(fields[0], index.parse().unwrap());
        let points = points(&case);
        let local = Local::of(&points).unwrap();
        let found = least(kind, &local.points, &Fixed::default()).unwrap();
        // the reference is about the feature's place, in units of its size
        let (unit, at) =
            (local.scale / case.size, (local.origin - Vec3::from(case.place)) / case.size);
        let frame = Mat3::from_columns(&[three(7), three(4).cross(&three(7)), three(4)]);
        let reference = Pose { kind, origin: three(1), frame, size: [v[10], v[11], v[12]] };
        let pose = found.pose.scaled(unit).translated(&at);
        let error = apart(&pose, &reference, &at);
        assert!(error < 1e-10, "{} {index}: {error:e}", kind.name());
        *seen.entry(kind).or_insert(0) += 1;
    }
    assert!(seen.len() == 9 && seen.values().all(|n| *n >= 30), "{seen:?}");
}

/// The extreme features of all cases, with their certificates checked from nothing but the points and the pose.
#[test]
fn extreme_features_are_proven_by_their_contacts() {
    let mut seen = 0;
    for name in KINDS {
        let kind = FeatureType::from_name(name).unwrap();
        for association in Association::ALL.into_iter().skip(1).filter(|a| a.is_for(kind)) {
            for index in 0..36 {
                let points = points(&Case::new(name, index));
                let local = Local::of(&points).unwrap();
                let start = least(kind, &local.points, &Fixed::default()).unwrap().pose;
                let label = format!("{name} {} {index}", association.name());
                match extreme(association, &local.points, &start) {
                    Ok(held) => {
                        check(association, &local.points, &held, &label);
                        seen += 1;
                    }
                    Err(error) => {
                        assert!(association == Association::MaximumInscribed, "{label}: {error}")
                    }
                }
            }
        }
    }
    assert!(seen > 400, "{seen}");
}

/// Signed distance from an ellipsoid; from an elliptic cylinder where the last semi-axis is infinite. The nearest point is where
/// x_i = q_i / (1 + t / a_i2) for the largest root t, by bisection.
fn from_ellipse(axes: [f64; 3], q: &Vec3) -> f64 {
    let at = |t: f64| Vec3::from_fn(|i, _| q[i] / (1.0 + t / (axes[i] * axes[i])));
    let inside = |t: f64| (0..3).map(|i| (at(t)[i] / axes[i]).powi(2)).sum::<f64>() < 1.0;
    let least = axes.iter().copied().fold(f64::INFINITY, f64::min);
    let (mut low, mut high) = (-least * least, 1e3);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if inside(middle) { high = middle } else { low = middle }
    }
    (q - at(high)).norm() * high.signum()
}

/// Signed function of a point that the association bounds.
fn function(association: Association, pose: &Pose, x: &Vec3) -> f64 {
    use FeatureType::{
        Circle, Cone, Cylinder, Ellipsoid, EllipticCylinder, Line, Plane, Sphere, Torus,
    };
    let q = pose.frame.tr_mul(&(x - pose.origin));
    let rho = q.x.hypot(q.y);
    let [a, b, _] = pose.size;
    let is_radial = association != Association::MinimumZone;
    match pose.kind {
        Plane => q.z,
        Line => rho,
        Sphere => q.norm() - if is_radial { 0.0 } else { a },
        Circle | Cylinder => rho - if is_radial { 0.0 } else { a },
        Cone => (rho - a) * b.cos() - q.z * b.sin(),
        Torus => (rho - a).hypot(q.z) - b,
        EllipticCylinder => from_ellipse([a, b, f64::INFINITY], &q),
        Ellipsoid => from_ellipse(pose.size, &q),
    }
}

fn check(
    association: Association,
    points: &[Vec3],
    held: &conicoid::fit::feature::Held,
    label: &str,
) {
    let kind = held.pose.kind;
    let values: Vec<f64> = points.iter().map(|x| function(association, &held.pose, x)).collect();
    let is_zone = association == Association::MinimumZone && kind != FeatureType::Line;
    let sign = if association == Association::MaximumInscribed { -1.0 } else { 1.0 };
    let height = |v: f64| if is_zone { v.abs() } else { sign * v };
    let worst = values.iter().map(|v| height(*v)).fold(f64::NEG_INFINITY, f64::max);
    assert!(worst <= held.bound + 1e-10, "{label}: {worst} above {}", held.bound);
    if held.contacts.is_empty() {
        assert!(held.bound.abs() < 1e-9, "{label}: {} without a proof", held.bound);
        return;
    }
    let sum: f64 = held.contacts.iter().map(|c| c.multiplier).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{label}: {sum}");
    for contact in &held.contacts {
        let v = values[contact.index];
        let reached = if is_zone { contact.side * v } else { sign * v };
        assert!((reached - held.bound).abs() < 1e-9, "{label}: no contact");
        assert!(contact.multiplier >= 0.0, "{label}: pulls");
    }
    // by differences: the contacts' gradients balance
    for slot in kind.slots() {
        let is_fixed =
            kind == FeatureType::Circle && [2, 3, 4].contains(slot) || !is_zone && *slot == 6;
        if is_fixed {
            continue;
        }
        let at = |h: f64| {
            let mut step = [0.0; 9];
            step[*slot] = h;
            held.pose.stepped(&step).unwrap()
        };
        // a line's tube bends by its own radius: far less than that, where it is thin
        let is_thin = kind == FeatureType::Line;
        let h = if is_thin { f64::min(1e-6, 1e-3 * held.bound.abs()) } else { 1e-6 };
        let (ahead, behind) = (at(h), at(-h));
        let balance: f64 = held
            .contacts
            .iter()
            .map(|c| {
                let f = |pose: &Pose| function(association, pose, &points[c.index]);
                c.multiplier * c.side * (f(&ahead) - f(&behind)) / (2.0 * h)
            })
            .sum();
        assert!(balance.abs() < 2e-6, "{label}: {balance} in {slot}");
    }
}

/// No feature beside the proven one is better: tried at random, near and far.
#[test]
fn no_other_pose_has_a_smaller_zone() {
    let mut random = Random::new(5);
    for name in
        ["plane", "circle", "cylinder", "sphere", "cone", "line", "elliptic_cylinder", "ellipsoid"]
    {
        let kind = FeatureType::from_name(name).unwrap();
        for index in [5, 7, 14] {
            let local = Local::of(&points(&Case::new(name, index))).unwrap();
            let start = least(kind, &local.points, &Fixed::default()).unwrap().pose;
            let held = extreme(Association::MinimumZone, &local.points, &start).unwrap();
            for round in 0..3000 {
                let reach = held.bound * [0.01, 0.3, 3.0][round % 3];
                let mut step = [0.0; 9];
                for slot in kind.slots() {
                    let is_fixed = kind == FeatureType::Circle && [2, 3, 4].contains(slot);
                    step[*slot] = if is_fixed { 0.0 } else { reach * (random.next() - 0.5) };
                }
                let Some(other) = held.pose.stepped(&step) else { continue };
                let worst = local.points.iter().fold(0.0_f64, |m, x| {
                    m.max(function(Association::MinimumZone, &other, x).abs())
                });
                assert!(worst >= held.bound - 1e-12, "{name} {index}: {worst} {}", held.bound);
            }
        }
    }
}

fn asked(kind: FeatureType) -> Asked {
    Asked {
        kind: Some(kind),
        association: Association::Gaussian,
        fixed: Fixed::default(),
        outliers: None,
        type_b: 0.0,
        coverage: 0.9545,
    }
}

/// A noisy cylinder of radius 10, `quarters` quarter turns of it.
fn cylinder(n: usize, quarters: f64, sigma: f64, random: &mut Random) -> Vec<Vec3> {
    let point = |_| {
        let angle = quarters * random.next() * std::f64::consts::FRAC_PI_2;
        let r = 10.0 + sigma * random.noise();
        Vec3::new(r * angle.cos() + 100.0, r * angle.sin() - 50.0, 20.0 * random.next())
    };
    (0..n).map(point).collect()
}

#[test]
fn uncertainties_cover_the_truth_as_often_as_they_say() {
    for (n, quarters) in [(12, 4.0), (40, 4.0), (200, 1.0), (1000, 2.0)] {
        let (rounds, mut covered, mut ratio) = (400, 0, 0.0);
        for round in 0..rounds {
            let points = cylinder(n, quarters, 0.01, &mut Random::new(round + 77));
            let exactness = assess(&points, &asked(FeatureType::Cylinder)).unwrap().exactness;
            let exactness = exactness.unwrap();
            let radius = exactness.parameters.last().unwrap();
            let error = radius.values[0] - 10.0;
            covered += usize::from(error.abs() <= radius.expanded[0]);
            ratio += (error / radius.standard[0]).powi(2) / rounds as f64;
        }
        // 95.45 % of 400 within four standard deviations of a binomial
        let share = covered as f64 / rounds as f64;
        assert!((0.912..0.997).contains(&share), "{n} {quarters}: {share} {ratio}");
    }
}

#[test]
fn outliers_are_left_out_and_told_and_fixed_values_are_kept() {
    let random = &mut Random::new(3);
    let mut points = cylinder(60, 4.0, 0.001, random);
    points[17].x += 0.5;
    points[44].y -= 0.3;
    let outliers = Asked { outliers: Some(3.5), ..asked(FeatureType::Cylinder) };
    let found = assess(&points, &outliers).unwrap();
    assert_eq!(found.rejected, [17, 44]);
    assert!((found.pose.size[0] - 10.0).abs() < 1e-3, "{:?}", found.pose);
    let fixed = Fixed { radius: Some(9.9), axis: Some(Vec3::z()), half_angle: None };
    let held = assess(&points, &Asked { fixed, ..asked(FeatureType::Cylinder) }).unwrap();
    assert!((held.pose.size[0] - 9.9).abs() < 1e-12 && held.pose.w().z.abs() == 1.0);
    let refused = assess(&points, &Asked { fixed, ..asked(FeatureType::Plane) }).unwrap_err();
    assert!(refused.to_string().contains("no radius that can be fixed"), "{refused}");
}

#[test]
fn as_few_points_as_determine_a_feature_are_fitted_and_fewer_refused() {
    for name in KINDS {
        let kind = FeatureType::from_name(name).unwrap();
        let all = points(&Case::new(name, 0));
        let fewest = kind.fewest(kind.slots().len());
        let found = assess(&all[..fewest], &asked(kind));
        if let Ok(found) = found {
            let size = Local::of(&all).unwrap().scale;
            let worst = found.distances.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
            assert!(worst < 1e-9 * size, "{name}: {worst}");
        } else {
            assert!(
                matches!(name, "elliptic_cylinder" | "ellipsoid" | "torus"),
                "{name} {found:?}"
            );
        }
        let told = assess(&all[..fewest - 1], &asked(kind)).unwrap_err().to_string();
        assert!(told.contains(&format!("at least {fewest}")) || fewest == 2, "{name}: {told}");
    }
}

#[test]
fn what_points_leave_free_is_said_in_words_and_never_in_numbers() {
    // along one ruling of a cylinder
    let line: Vec<Vec3> = (0..20).map(|k| Vec3::new(1.0, 2.0, f64::from(k))).collect();
    let told = assess(&line, &asked(FeatureType::Plane)).unwrap_err().to_string();
    assert!(told.contains("rotation about [0.000, 0.000, 1.000]"), "{told}");
    // a shallow strip in noise: the radius may be anything
    let random = &mut Random::new(8);
    let strip = cylinder(40, 0.02, 0.01, random);
    match assess(&strip, &asked(FeatureType::Cylinder)) {
        Ok(found) => {
            assert!(found.unknown.contains(&"radius"), "{:?}", found.unknown);
            let exactness = found.exactness.unwrap();
            assert!(exactness.parameters.iter().all(|p| p.name != "radius"));
            assert!(!exactness.covariance_of.contains(&"radius"));
        }
        Err(error) => assert!(error.to_string().contains("do not determine"), "{error}"),
    }
}

#[test]
fn the_simplest_type_is_chosen() {
    for name in KINDS {
        let points = points(&Case::new(name, 6));
        let found = assess(&points, &Asked { kind: None, ..asked(FeatureType::Plane) }).unwrap();
        assert_eq!(found.pose.kind.name(), name);
    }
}

fn text(points: &[Vec3]) -> String {
    points.iter().map(|p| format!("{:?},{:?},{:?}\n", p.x, p.y, p.z)).collect()
}

#[tokio::test]
async fn command_rest_and_grpc_give_the_same_bits() {
    let running = start(&[]).await;
    let directory = tempfile::tempdir().unwrap();
    let file = |name: &str| directory.path().join(name).display().to_string();
    let points = text(&cylinder(80, 3.0, 0.01, &mut Random::new(4)));
    fs::write(file("points.csv"), &points).unwrap();
    let run = conicoid(
        &[
            "fit",
            &file("points.csv"),
            "--type",
            "cylinder",
            "--association",
            "gaussian",
            "--residuals",
            "--outliers=4",
            "--part=housing",
            "-o",
            &file("result.json"),
        ],
        None,
    );
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let from_cli: Value = serde_json::from_slice(&fs::read(file("result.json")).unwrap()).unwrap();
    let query = "type=cylinder&association=gaussian&residuals=true&outliers=4&part=housing&name=points.csv&format=xyz";
    let url = running.url(&format!("/v1/fits?{query}"));
    let request = || reqwest::Client::new().post(&url).body(points.clone());
    let from_http: Value = request().send().await.unwrap().json().await.unwrap();
    assert_eq!(from_cli, from_http);
    assert_eq!(from_http["passed"]["part"], "housing");
    assert_eq!(from_http["form"]["characteristic"], "cylindricity");
    assert!((from_http["surface"]["radius"].as_f64().unwrap() - 10.0).abs() < 0.02);

    // as clients made from the contract send it, a part for each parameter
    let form = |name: &str| {
        let cloud = reqwest::multipart::Part::text(points.clone()).file_name("points.csv");
        let form = reqwest::multipart::Form::new().part(name.to_owned(), cloud);
        let parts = query.split('&').map(|pair| pair.split_once('=').unwrap());
        let form =
            parts.fold(form, |form, (name, text)| form.text(name.to_owned(), text.to_owned()));
        reqwest::Client::new().post(running.url("/v1/fits/form")).multipart(form).send()
    };
    let from_form: Value = form("cloud").await.unwrap().json().await.unwrap();
    assert_eq!(from_cli, from_form);
    assert_eq!(problem(form("file").await.unwrap()).await, (400, "malformed_body".to_owned()));
    let bare = reqwest::Client::new().post(running.url("/v1/fits/form")).body(points.clone());
    assert_eq!(problem(bare.send().await.unwrap()).await, (400, "malformed_body".to_owned()));

    let accepted = request().header("accept", "application/x-protobuf").send().await.unwrap();
    let from_http: v1::FitResult = prost::Message::decode(accepted.bytes().await.unwrap()).unwrap();
    let message = v1::FitRequest {
        cloud: points.clone().into(),
        format: v1::Format::Xyz.into(),
        name: Some("points.csv".to_owned()),
        residuals: true,
        passed: Some(v1::PassedThrough { part: Some("housing".to_owned()), ..Default::default() }),
        parameters: Some(v1::FitParameters {
            r#type: v1::FeatureType::Cylinder.into(),
            association: v1::Association::Gaussian.into(),
            outliers: Some(4.0),
            ..Default::default()
        }),
        ..Default::default()
    };
    let from_grpc = running.grpc_fits().await.fit(message).await.unwrap().into_inner();
    assert_eq!(from_http, from_grpc);
    let told = from_grpc.uncertainty.unwrap();
    assert_eq!(from_cli["uncertainty"]["s"].as_f64(), Some(told.s));
    let rows: Vec<f64> = from_cli["uncertainty"]["covariance"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|row| row.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()))
        .collect();
    assert_eq!(rows, told.covariance);
}

#[tokio::test]
async fn bad_fits_are_refused_with_what_to_do() {
    let running = start(&[]).await;
    let post = |query: &str, body: &'static str| {
        reqwest::Client::new().post(running.url(&format!("/v1/fits?{query}"))).body(body).send()
    };
    let line = "0 0 0\n0 0 1\n0 0 2\n0 0 3\n0 0 4\n0 0 5\n";
    for (query, body, expected) in [
        ("type=plane", line, (422, "not_determined")),
        ("type=torus", line, (422, "too_few_points")),
        ("type=blob", line, (400, "invalid_parameter")),
        ("min_points=50", line, (400, "unknown_parameter")),
        ("type=plane&type=line", line, (400, "invalid_parameter")),
        ("type=plane&radius=5", line, (400, "invalid_parameter")),
        ("type=line&nominal=20&lower=-0.02", line, (400, "invalid_parameter")),
        ("type=cylinder&upper=0.02", line, (400, "invalid_parameter")),
        ("nominal=20&upper=0.02", line, (400, "invalid_parameter")),
        ("type=line", "", (400, "empty_body")),
        ("type=line", "1 1 1\n1 1 1\n1 1 1\n", (422, "extent_out_of_range")),
    ] {
        let (status, code) = problem(post(query, body).await.unwrap()).await;
        assert_eq!((status, code.as_str()), expected, "{query}");
    }
}

#[tokio::test]
async fn the_fit_of_a_region_is_that_of_its_points_alone() {
    let running = start(&[]).await;
    let points = cylinder(600, 4.0, 0.01, &mut Random::new(9));
    let query = "surfaces=cylinder&association=gaussian";
    let found: Value = running.post(query, text(&points)).await.json().await.unwrap();
    let labels = found["labels"].as_array().unwrap();
    let fits = found["fits"].as_array().unwrap();
    assert_eq!(fits.len(), found["regions"].as_array().unwrap().len());
    assert_eq!(found["regions"][0]["type"], "cylinder");
    let own: Vec<Vec3> =
        points.iter().zip(labels).filter(|(_, label)| **label == 0).map(|(p, _)| *p).collect();
    assert!(own.len() > 500);
    let url = running.url("/v1/fits?type=cylinder");
    let alone = reqwest::Client::new().post(url).body(text(&own)).send().await.unwrap();
    let alone: Value = alone.json().await.unwrap();
    for name in ["surface", "uncertainty", "residuals", "form", "used", "determination"] {
        assert!(!alone[name].is_null());
        assert_eq!(fits[0]["fit"][name], alone[name], "{name}");
    }
    // without being asked for, none is told
    let plain: Value = running.post("surfaces=cylinder", text(&points)).await.json().await.unwrap();
    assert!(plain.get("fits").is_none() && plain["regions"] == found["regions"]);
    let message = v1::SegmentRequest {
        cloud: text(&points).into(),
        association: v1::Association::Gaussian.into(),
        parameters: Some(v1::Parameters {
            surfaces: vec![v1::SurfaceType::Cylinder.into()],
            ..Default::default()
        }),
        ..Default::default()
    };
    let message = running.grpc().await.segment(message).await.unwrap().into_inner();
    let told = message.fits[0].fit.as_ref().unwrap().uncertainty.as_ref().unwrap();
    assert_eq!(fits[0]["fit"]["uncertainty"]["s"].as_f64(), Some(told.s));
}

#[tokio::test]
async fn tolerances_get_verdicts_with_the_uncertainty() {
    let running = start(&[]).await;
    let points = text(&cylinder(200, 4.0, 0.005, &mut Random::new(2)));
    for (limits, expected) in [
        ("lower=-0.05&upper=0.05", "conform"),
        ("lower=0.02&upper=0.05", "not_conform"),
        ("lower=-0.05", "conform"),
        ("lower=-0.05&upper=0.0001", "undecided"),
    ] {
        let query = format!("type=cylinder&nominal=20&{limits}&form_tolerance=0.2&type_b=0.0001");
        let url = running.url(&format!("/v1/fits?{query}"));
        let answer = reqwest::Client::new().post(url).body(points.clone()).send().await.unwrap();
        let answer: Value = answer.json().await.unwrap();
        let told = &answer["characteristics"][0];
        assert_eq!(told["name"], "diameter");
        let radius = answer["surface"]["radius"].as_f64().unwrap();
        assert_eq!(told["measured"].as_f64(), Some(2.0 * radius));
        assert_eq!(told["verdict"], expected, "{limits}: {told}");
        assert_eq!(answer["characteristics"][1]["name"], "cylindricity");
        assert_eq!(answer["characteristics"][1]["verdict"], "conform");
    }
}

#[tokio::test]
async fn tolerances_that_no_size_is_within_are_refused_everywhere_with_both() {
    let running = start(&[]).await;
    let points = text(&cylinder(200, 4.0, 0.005, &mut Random::new(2)));
    let both = |told: &str| told.contains("0.1") && told.contains("-0.1") && told.contains("above");
    let url = running.url("/v1/fits?type=cylinder&nominal=20&lower=0.1&upper=-0.1");
    let answer = reqwest::Client::new().post(url).body(points.clone()).send().await.unwrap();
    assert_eq!(answer.status(), 400);
    let told = answer.text().await.unwrap();
    assert!(both(&told), "{told}");
    let message = v1::FitRequest {
        cloud: points.clone().into(),
        parameters: Some(v1::FitParameters {
            r#type: v1::FeatureType::Cylinder.into(),
            nominal: Some(20.0),
            lower: Some(0.1),
            upper: Some(-0.1),
            ..Default::default()
        }),
        ..Default::default()
    };
    let refused = running.grpc_fits().await.fit(message).await.unwrap_err();
    assert_eq!(refused.code(), tonic::Code::InvalidArgument);
    assert!(both(refused.message()), "{refused}");
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("points.csv");
    fs::write(&path, &points).unwrap();
    let flags = ["fit", "-", "--type=cylinder", "--nominal=20", "--lower=0.1", "--upper=-0.1"];
    let output = conicoid(&flags, Some(&path));
    assert!(!output.status.success() && both(&String::from_utf8_lossy(&output.stderr)));
}

#[tokio::test]
async fn a_size_that_the_points_do_not_tell_is_undecided_and_says_why() {
    let running = start(&[]).await;
    let points = text(&cylinder(200, 4.0, 0.005, &mut Random::new(2)));
    let post = |query: &str| {
        let url = running.url(&format!("/v1/fits?{query}"));
        reqwest::Client::new().post(url).body(points.clone()).send()
    };
    let answer = post("type=cone&nominal=0.1&lower=-0.02&upper=0.02").await.unwrap();
    let answer: Value = answer.json().await.unwrap();
    assert!(answer["not_identifiable"].as_array().unwrap().contains(&"half_angle".into()));
    let told = &answer["characteristics"][0];
    assert_eq!((&told["name"], &told["verdict"]), (&"full_angle".into(), &"undecided".into()));
    assert!(told["measured"].is_null() && told["deviation"].is_null(), "{told}");
    assert!(told["undecided"].as_str().unwrap().contains("not_identifiable"), "{told}");
    // a radius that the points do not have is no lack of points
    let refused = post("radius=20").await.unwrap();
    assert_eq!(refused.status(), 422);
    let told = refused.text().await.unwrap();
    assert!(told.contains("leave radius out"), "{told}");
}

#[tokio::test]
async fn a_minimum_zone_comes_with_its_certificate() {
    let running = start(&[]).await;
    let points = text(&cylinder(100, 4.0, 0.01, &mut Random::new(6)));
    let post = |query: &str| {
        let url = running.url(&format!("/v1/fits?type=cylinder&association={query}"));
        reqwest::Client::new().post(url).body(points.clone()).send()
    };
    let zone: Value = post("minimum_zone").await.unwrap().json().await.unwrap();
    let bound = zone["certificate"]["bound"].as_f64().unwrap();
    assert_eq!(zone["form"]["minimum_zone"].as_f64(), Some(2.0 * bound));
    let told = zone["uncertainty"]["parameters"].as_array().unwrap();
    let radius = told.iter().find(|p| p["name"] == "radius").unwrap();
    assert!(radius["expanded"][0].as_f64().unwrap() > 0.0);
    assert_eq!(zone["uncertainty"]["covariance"].as_array().unwrap().len(), 0);
    assert!((zone["residuals"]["range"].as_f64().unwrap() - 2.0 * bound).abs() < 1e-9);
    assert!(zone["form"]["gaussian"].as_f64().unwrap() > 2.0 * bound);
    let outer: Value = post("minimum_circumscribed").await.unwrap().json().await.unwrap();
    let inner: Value = post("maximum_inscribed").await.unwrap().json().await.unwrap();
    let radius = |of: &Value| of["surface"]["radius"].as_f64().unwrap();
    assert!(radius(&inner) < radius(&zone) && radius(&zone) < radius(&outer));
}

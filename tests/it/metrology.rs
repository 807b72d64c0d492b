//! Uncertainty of features that contacts hold, verdicts, and datum systems, against truth.

use conicoid::{
    fit::feature::{Asked, Association, Feature, FeatureType, Fixed, assess},
    geometry::Vec3,
    service::message::v1,
};
use nalgebra::{Matrix4, Rotation3, Vector4};
use serde_json::Value;

use super::support::{features::Random, start};

fn asked(kind: FeatureType, association: Association) -> Asked {
    Asked {
        kind: Some(kind),
        association,
        fixed: Fixed::default(),
        outliers: None,
        type_b: 0.0,
        coverage: 0.9545,
    }
}

/// Points of a feature of radius 10 with three lobes, without noise and with it.
fn pair(
    kind: FeatureType,
    n: usize,
    lobes: f64,
    noise: f64,
    random: &mut Random,
) -> (Vec<Vec3>, Vec<Vec3>) {
    let mut both = (Vec::new(), Vec::new());
    for _ in 0..n {
        let (angle, v) = (random.next() * std::f64::consts::TAU, random.next());
        let (out, up) = (noise * random.noise(), noise * random.noise());
        let form = lobes * (3.0 * angle).cos();
        let (sin, cos) = angle.sin_cos();
        let at = |out: f64, up: f64| {
            let r = 10.0 + form + out;
            match kind {
                FeatureType::Plane => Vec3::new(20.0 * v, 3.0 * angle, form + out),
                FeatureType::Circle => Vec3::new(r * cos, r * sin, up),
                FeatureType::Cylinder => Vec3::new(r * cos, r * sin, 20.0 * v),
                FeatureType::Sphere => {
                    let z = 2.0 * v - 1.0;
                    let flat = (1.0 - z * z).sqrt();
                    Vec3::new(flat * cos, flat * sin, z) * r
                }
                // an ellipse with semi-axes 10 and 6, moved along its normals
                _ => {
                    let normal = Vec3::new(cos / 10.0, sin / 6.0, 0.0).normalize();
                    Vec3::new(10.0 * cos, 6.0 * sin, 20.0 * v) + normal * (form + out)
                }
            }
        };
        both.0.push(at(0.0, 0.0));
        both.1.push(at(out, up));
    }
    both
}

fn size(feature: &Feature) -> f64 {
    feature.pose.size.iter().copied().fold(0.0, f64::max)
}

/// The truth is the same association of the points without noise. What is told are bounds, so they hold at least as often as asked,
/// and are no more than so many times the error where there is no form.
#[test]
fn uncertainties_of_extreme_features_hold_the_truth_at_least_as_often_as_asked() {
    use FeatureType::{Circle, Cylinder, EllipticCylinder, Plane, Sphere};
    for kind in [Plane, Circle, Cylinder, Sphere, EllipticCylinder] {
        for association in Association::ALL.into_iter().skip(1).filter(|a| a.is_for(kind)) {
            for (n, lobes, noise) in [(16, 0.0, 0.01), (120, 0.0, 0.01), (120, 0.1, 0.003)] {
                let rounds = if kind == EllipticCylinder { 20 } else { 60 };
                let (mut held, mut forms, mut share) = (0, 0, 0.0);
                for round in 0..rounds {
                    let (exact, noisy) =
                        pair(kind, n, lobes, noise, &mut Random::new(round * 7 + n as u64));
                    let asked = asked(kind, association);
                    let (truth, found) =
                        (assess(&exact, &asked).unwrap(), assess(&noisy, &asked).unwrap());
                    let told = found.exactness.as_ref().unwrap();
                    let names = ["radius", "semi_axes"];
                    let told = told.parameters.iter().find(|p| names.contains(&p.name));
                    let error = (size(&found) - size(&truth)).abs();
                    held += usize::from(told.is_none_or(|p| error <= p.expanded[0]));
                    let forms_of = [&found, &truth].map(|f| f.form.minimum_zone.unwrap());
                    let error = (forms_of[0] - forms_of[1]).abs();
                    let most = 2.0 * found.noise.unwrap().reach;
                    forms += usize::from(error <= most);
                    share += error / most / rounds as f64;
                }
                let label = format!("{} {} {n} {lobes}", kind.name(), association.name());
                let least = 0.85 * rounds as f64;
                assert!(held as f64 > least && forms as f64 > least, "{label}: {held} {forms}");
                assert!(lobes > 0.0 || share > 0.2, "{label}: {share}");
            }
        }
    }
}

fn text(points: &[Vec3]) -> String {
    points.iter().map(|p| format!("{:?},{:?},{:?}\n", p.x, p.y, p.z)).collect()
}

#[tokio::test]
async fn every_association_gets_a_verdict_where_it_is_clear() {
    let running = start(&[]).await;
    let (_, points) = pair(FeatureType::Cylinder, 3000, 0.05, 0.002, &mut Random::new(3));
    let points = text(&points);
    for association in Association::ALL.map(Association::name) {
        for (limits, form, verdicts) in [
            ("nominal=20&lower=-0.3&upper=0.3", 0.3, ["conform", "conform"]),
            ("nominal=19&lower=-0.2&upper=0.2", 0.01, ["not_conform", "not_conform"]),
            ("nominal=21&lower=-0.2", 0.1, ["not_conform", "undecided"]),
        ] {
            let query =
                format!("type=cylinder&association={association}&{limits}&form_tolerance={form}");
            let url = running.url(&format!("/v1/fits?{query}"));
            let answer = reqwest::Client::new().post(url).body(points.clone()).send().await;
            let answer: Value = answer.unwrap().json().await.unwrap();
            let told = &answer["characteristics"];
            for (k, expected) in verdicts.iter().enumerate() {
                assert_eq!(told[k]["verdict"], *expected, "{query}: {told}");
                assert!(told[k]["expanded"].as_f64().unwrap() > 0.0, "{query}: {told}");
            }
        }
    }
}

/// A corner of three square planes, turned and moved, and the place of its corner.
fn corner(random: &mut Random) -> (Vec<Vec3>, Rotation3<f64>, Vec3) {
    let (turn, at) = (Rotation3::new(Vec3::new(0.4, 0.9, -0.3)), Vec3::new(80.0, -20.0, 45.0));
    let mut points = Vec::new();
    for (side, (length, width)) in [(40.0, 30.0), (30.0, 20.0), (20.0, 40.0)].iter().enumerate() {
        for _ in 0..1500 {
            let mut p = [0.0; 3];
            p[side] = length * (0.02 + 0.98 * random.next());
            p[(side + 1) % 3] = width * (0.02 + 0.98 * random.next());
            p[(side + 2) % 3] = 0.01 * random.noise();
            points.push(turn * Vec3::from(p) + at);
        }
    }
    (points, turn, at)
}

#[tokio::test]
async fn datums_make_a_coordinate_system_and_what_they_leave_free_is_said() {
    let running = start(&[]).await;
    let (points, turn, at) = corner(&mut Random::new(11));
    let plain: Value = running.post("surfaces=plane", text(&points)).await.json().await.unwrap();
    assert!(plain.get("datum_system").is_none());
    let regions = plain["regions"].as_array().unwrap();
    assert_eq!(regions.len(), 3);
    // the regions by the part's axis that their normals are along
    let mut order = [0_usize; 3];
    for region in regions {
        let n: Vec<f64> = region["surface"]["normal"]
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_f64().unwrap())
            .collect();
        let own = turn.inverse() * Vec3::new(n[0], n[1], n[2]);
        order[own.iamax()] = region["id"].as_u64().unwrap() as usize;
    }
    // the z plane first, then the x plane, then the y plane
    let ids = format!("{},{},{}", order[2], order[0], order[1]);
    for association in ["", "&association=minimum_zone"] {
        let query = format!("surfaces=plane&datums={ids}{association}");
        let found: Value = running.post(&query, text(&points)).await.json().await.unwrap();
        let system = &found["datum_system"];
        let rows = system["transform"].as_array().unwrap();
        let m = Matrix4::from_fn(|i, j| rows[i][j].as_f64().unwrap());
        let view = m.fixed_view::<3, 3>(0, 0);
        assert!((view * view.transpose() - nalgebra::Matrix3::identity()).norm() < 1e-12);
        assert!((view.determinant() - 1.0).abs() < 1e-12);
        for corner in [Vec3::zeros(), Vec3::new(10.0, 0.0, 0.0), Vec3::new(0.0, 5.0, 20.0)] {
            let input = turn * corner + at;
            let own = (m * Vector4::new(input.x, input.y, input.z, 1.0)).xyz();
            // which way the normals point means nothing
            let error = (own.abs() - corner).abs().max();
            assert!(error < 0.02, "{own} for {corner}");
        }
        assert_eq!(system["datums"][1]["features"][0], "plane");
        assert!(system["datums"][1]["turned"].as_f64().unwrap() < 0.002);
    }
    // a fit that there is none of says why
    let query = format!("surfaces=plane&datums={ids}&association=maximum_inscribed");
    let found: Value = running.post(&query, text(&points)).await.json().await.unwrap();
    let refused = found["datum_system"]["refused"].as_str().unwrap();
    assert!(refused.contains("a plane has no maximum_inscribed association"), "{refused}");
    let query = format!("surfaces=plane&datums={},99", order[2]);
    let found: Value = running.post(&query, text(&points)).await.json().await.unwrap();
    assert!(found["datum_system"]["refused"].as_str().unwrap().contains("region 99"));
    let message = v1::SegmentRequest {
        cloud: text(&points).into(),
        datums: vec![order[2] as u64, order[0] as u64],
        parameters: Some(v1::Parameters {
            surfaces: vec![v1::SurfaceType::Plane.into()],
            ..Default::default()
        }),
        ..Default::default()
    };
    let told = running.grpc().await.segment(message).await.unwrap().into_inner();
    let system = told.datum_system.unwrap();
    assert!(system.transform.is_empty() && system.free.len() == 1, "{system:?}");
    assert!(system.free[0].contains("shift along"));
}

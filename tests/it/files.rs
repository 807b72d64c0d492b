//! Files as they come: packed, in a unit, with titles and holes, over every transport.

use std::io::Write;

use conicoid::service::message::v1;

use crate::support::{clouds, conicoid, problem, start};

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), Default::default());
    packed.write_all(bytes).unwrap();
    packed.finish().unwrap()
}

fn cloud() -> String {
    clouds::xyz(&clouds::cylinder(300))
}

#[tokio::test]
async fn a_packed_file_has_the_answer_of_the_plain_one() {
    let running = start(&[]).await;
    let told = async |bytes: Vec<u8>| {
        let answer = running.post("", bytes).await;
        let mut answer: serde_json::Value = answer.json().await.unwrap();
        answer["timing"].take();
        answer
    };
    let plain = cloud().into_bytes();
    let expected = told(plain.clone()).await;
    assert_eq!(expected["input"]["points"], 300);
    for packed in [gzip(&plain), zstd::encode_all(&plain[..], 3).unwrap()] {
        assert_eq!(told(packed.clone()).await, expected);
        let mut client = running.grpc().await;
        let message = v1::SegmentRequest { cloud: packed.into(), ..Default::default() };
        let answer = client.segment(message).await.unwrap().into_inner();
        assert_eq!(answer.input.unwrap().sha256, expected["input"]["sha256"].as_str().unwrap());
    }
    let job = running.submit("", gzip(&plain)).await;
    let ended = running.events(&crate::support::location(&job)).await.pop().unwrap();
    assert_eq!(ended["state"], "succeeded", "{ended}");
}

#[tokio::test]
async fn a_packed_file_is_held_to_the_limits_of_a_body() {
    let running = start(&["--max-body-bytes", "100000"]).await;
    let spaces = vec![b' '; 10_000_000];
    for packed in [gzip(&spaces), zstd::encode_all(&spaces[..], 3).unwrap()] {
        assert!(packed.len() < 20_000);
        let refused = running.post("", packed).await;
        assert_eq!(problem(refused).await, (413, "body_too_large".to_owned()));
    }
    let cut = gzip(cloud().as_bytes());
    let refused = running.post("", cut[..cut.len() - 9].to_vec()).await;
    assert_eq!(problem(refused).await, (422, "malformed_cloud".to_owned()));
}

#[tokio::test]
async fn the_unit_is_the_parameters_or_the_files_and_is_told_on_every_transport() {
    let running = start(&[]).await;
    let named = format!("x [mm] y [mm] z [mm]\n{}", cloud());
    let told = async |query: &str, text: &str| {
        let answer = running.post(query, text.to_owned()).await;
        answer.json::<serde_json::Value>().await.unwrap()
    };
    assert_eq!(told("", &cloud()).await["input"].get("unit"), None);
    assert_eq!(told("", &named).await["input"]["unit"], "mm");
    let given = told("unit=us_ft", &named).await;
    assert_eq!(given["input"]["unit"], "us_ft");
    let warnings = given["warnings"].as_array().unwrap();
    assert!(warnings.iter().any(|warning| warning["code"] == "unit_differs"), "{warnings:?}");
    // nothing is converted
    assert_eq!(given["regions"], told("", &named).await["regions"]);
    let message = v1::SegmentRequest {
        cloud: cloud().into_bytes().into(),
        unit: v1::LengthUnit::M.into(),
        ..Default::default()
    };
    let answer = running.grpc().await.segment(message).await.unwrap().into_inner();
    assert_eq!(answer.input.unwrap().unit, i32::from(v1::LengthUnit::M));
    let refused = running.post("unit=parsec", cloud()).await;
    assert_eq!(problem(refused).await, (400, "invalid_parameter".to_owned()));
}

#[test]
fn the_command_line_reads_packed_files_and_states_the_unit_in_every_form() {
    let directory = tempfile::tempdir().unwrap();
    let place = |name: &str| directory.path().join(name);
    std::fs::write(place("tube.xyz.gz"), gzip(format!("a title\n7 8 9\n{}", cloud()).as_bytes()))
        .unwrap();
    for (name, said) in [
        ("r.json", "\"unit\":\"m\""),
        ("r.csv", ",unit\n"),
        ("r.html", "lengths in m"),
        ("r.step", "SI_UNIT($,.METRE.)"),
    ] {
        let (cloud, result) = (place("tube.xyz.gz"), place(name));
        let paths = [cloud.to_str().unwrap(), "-o", result.to_str().unwrap()];
        let flags = ["--unit", "m", "--skip-lines", "2", "--quiet"];
        let run = conicoid(&[&paths[..], &flags].concat(), None);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let text = std::fs::read_to_string(&result).unwrap();
        assert!(text.contains(said), "{name}");
    }
}

#[tokio::test]
async fn points_at_the_origin_are_holes_and_single_precision_has_its_step() {
    let running = start(&[]).await;
    let far = clouds::cylinder(300).into_iter().map(|[x, y, z]| {
        let single = |v: f64| f64::from((v + 4e6) as f32);
        [single(1000.0 * x), single(1000.0 * y), single(1000.0 * z)]
    });
    let points: Vec<[f64; 3]> = far.chain([[0.0; 3]; 12]).collect();
    let answer: serde_json::Value =
        running.post("", clouds::xyz(&points)).await.json().await.unwrap();
    assert_eq!(
        (&answer["input"]["points"], &answer["input"]["skipped"]),
        (&312.into(), &12.into())
    );
    // from 2^21 to 2^22 single numbers are a quarter apart
    assert_eq!(answer["input"]["resolution"], serde_json::json!([0.25, 0.25, 0.25]));
    let codes = answer["warnings"].as_array().unwrap().iter().map(|warning| &warning["code"]);
    assert!(codes.clone().any(|code| code == "holes_at_origin"), "{answer}");
}

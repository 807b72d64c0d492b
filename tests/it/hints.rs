//! What a person knows of a cloud, over every transport.

use std::fs;

use conicoid::service::message::v1;
use reqwest::multipart::{Form, Part};
use serde_json::{Value, json};

use super::support::{clouds, conicoid, problem, start};

/// What is known of the bend of the bracket: its radius is 10, and its axis goes along y.
fn told() -> Value {
    json!([{"at": [[0.0, 20.0, 10.0]], "type": "cylinder", "radius": 10.0, "axis_direction": [0.0, 1.0, 0.0]}])
}

/// The parts of an answer that must not depend on how it was asked for.
fn essence(mut answer: Value) -> Value {
    answer["timing"].take();
    answer
}

async fn multipart(url: String, cloud: Vec<u8>, parameters: &Value) -> reqwest::Response {
    let form = Form::new()
        .part("cloud", Part::bytes(cloud))
        .part("parameters", Part::text(parameters.to_string()));
    reqwest::Client::new().post(url).multipart(form).send().await.unwrap()
}

#[tokio::test]
async fn hints_are_the_same_over_every_transport() {
    let running = start(&[]).await;
    let directory = tempfile::tempdir().unwrap();
    let cloud = clouds::ply(&clouds::bracket(6000));
    let hints = told();
    let url = running.url("/v1/segmentations");
    let by_form = multipart(url.clone(), cloud.clone(), &json!({ "hints": hints })).await;
    let by_form: Value = by_form.json().await.unwrap();
    let outcome = &by_form["hints"][0];
    assert_eq!(outcome["outcome"], "applied", "{outcome}");
    let id = outcome["regions"][0].as_u64().unwrap() as usize;
    assert_eq!(by_form["regions"][id]["surface"]["radius"], 10.0);
    assert_eq!(by_form["parameters"]["hints"][0]["type"], "cylinder");
    let query = reqwest::Client::new().post(url).query(&[("hints", hints.to_string())]);
    let by_query: Value = query.body(cloud.clone()).send().await.unwrap().json().await.unwrap();
    assert_eq!(essence(by_query), essence(by_form.clone()));
    // a file of them, or the text itself
    let [input, file, output] =
        ["cloud.ply", "hints.json", "r.json"].map(|n| directory.path().join(n));
    fs::write(&input, &cloud).unwrap();
    fs::write(&file, hints.to_string()).unwrap();
    for given in [file.to_str().unwrap(), &hints.to_string()] {
        let names = [&input, &output].map(|path| path.to_str().unwrap());
        let run = conicoid(&["segment", names[0], "-o", names[1], "--hints", given], None);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let by_file: Value = serde_json::from_slice(&fs::read(&output).unwrap()).unwrap();
        assert_eq!(essence(by_file), essence(by_form.clone()));
    }
    let hint = v1::Hint {
        at: vec![v1::Vector { x: 0.0, y: 20.0, z: 10.0 }],
        r#type: v1::SurfaceType::Cylinder.into(),
        radius: Some(10.0),
        axis_direction: Some(v1::Vector { x: 0.0, y: 1.0, z: 0.0 }),
        ..Default::default()
    };
    let parameters = v1::Parameters { hints: vec![hint.clone()], ..Default::default() };
    let request = v1::SegmentRequest {
        cloud: cloud.into(),
        parameters: Some(parameters),
        ..Default::default()
    };
    let hint = v1::Hint { action: v1::HintAction::Surface.into(), ..hint };
    let answer = running.grpc().await.segment(request).await.unwrap().into_inner();
    assert_eq!(answer.hints[0].outcome, i32::from(v1::Outcome::Applied));
    assert_eq!(answer.hints[0].misfit, outcome["misfit"].as_f64());
    assert_eq!(answer.parameters.unwrap().hints, [hint]);
}

#[tokio::test]
async fn hints_that_cannot_be_are_refused_and_those_that_crop_all_away_say_so() {
    let running = start(&[]).await;
    let cloud = clouds::ply(&clouds::bracket(6000));
    let refused = async |parameters: Value, word: &str| {
        let answer = multipart(running.url("/v1/segmentations"), cloud.clone(), &parameters).await;
        let text: Value = answer.json().await.unwrap();
        assert!(text["detail"].as_str().unwrap().contains(word), "{text}");
        text["code"].as_str().unwrap().to_owned()
    };
    let empty = refused(json!({"hints": [{"type": "cylinder"}]}), "no place").await;
    assert_eq!(empty, "invalid_parameter");
    let split = json!({"action": "split", "at": [[0, 0, 0], [1, 0, 0]]});
    let method = refused(json!({"hints": [split], "method": "rcond"}), "method distance").await;
    assert_eq!(method, "invalid_parameter");
    let far = json!({"action": "crop", "extent": {"min": [100, 0, 0], "max": [101, 1, 1]}});
    assert_eq!(refused(json!({"hints": [far]}), "crop it to more").await, "too_few_points");
    let labels = json!({"action": "crop", "labels": [0]});
    assert_eq!(refused(json!({"hints": [labels]}), "column label").await, "too_few_points");
    let (status, code) = problem(running.post("hints=[", cloud.clone()).await).await;
    assert_eq!((status, &code[..]), (400, "invalid_parameter"));
    let run = conicoid(&["segment", "-", "--hints", "/no/such/file"], None);
    assert!(String::from_utf8_lossy(&run.stderr).contains("cannot be read"));
}

#[tokio::test]
async fn the_labels_of_a_result_are_places_of_the_next_request() {
    let running = start(&[]).await;
    let url = running.url("/v1/segmentations");
    let post = reqwest::Client::new().post(&url).header("accept", "model/ply");
    let cloud = clouds::ply(&clouds::bracket(6000));
    let labelled = post.body(cloud).send().await.unwrap().bytes().await.unwrap().to_vec();
    let crop = json!({"hints": [{"action": "crop", "labels": [1]}]});
    let answer: Value = multipart(url, labelled.clone(), &crop).await.json().await.unwrap();
    let found = answer["labels"].as_array().unwrap();
    let inside = found.iter().filter(|label| **label != -1).count();
    assert_eq!(answer["regions"].as_array().unwrap().len(), 1);
    assert_eq!(answer["input"]["points"], 6000);
    let outside = answer["unassigned"]["reasons"]["outside"].as_u64().unwrap() as usize;
    let counted = answer["hints"][0]["message"].as_str().unwrap();
    assert_eq!(counted, format!("{} points lie there", 6000 - outside));
    assert!(inside > 9 * (6000 - outside) / 10, "{inside} of {}", 6000 - outside);
}

#[test]
fn hints_give_the_same_bytes_on_any_number_of_threads() {
    let directory = tempfile::tempdir().unwrap();
    let input = directory.path().join("cloud.ply");
    fs::write(&input, clouds::ply(&clouds::bracket(6000))).unwrap();
    let run = |threads: &str| {
        let output = directory.path().join("r.json");
        let [input, output] = [&input, &output].map(|path| path.to_str().unwrap());
        let hints = told().to_string();
        let args = ["segment", input, "-o", output, "--hints", &hints, "--threads", threads];
        let run = conicoid(&args, None);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        essence(serde_json::from_slice(&fs::read(output).unwrap()).unwrap())
    };
    assert_eq!(run("1"), run("4"));
}

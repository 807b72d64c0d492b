//! The command line, HTTP and gRPC give the same answer for the same input.

use std::fs;

use conicoid::service::message::v1;
use prost::Message;
use serde_json::Value;

use super::support::{clouds, conicoid, start};

/// Thresholds for a cloud near the origin: rcond is larger there than in the seed's place.
const QUERY: &str = "method=rcond&rcond_threshold=1e-11&algebraic_threshold=2e-3";

/// The parts of an answer that must not depend on how it was asked for.
fn essence(mut answer: Value) -> Value {
    answer["timing"].take();
    answer
}

/// The same of a protobuf answer.
fn message_essence(mut answer: v1::Segmentation) -> v1::Segmentation {
    answer.timing = None;
    answer
}

#[tokio::test]
async fn all_transports_and_methods_agree() {
    let running = start(&[]).await;
    let directory = tempfile::tempdir().unwrap();
    let (input, output) = (directory.path().join("cloud.ply"), directory.path().join("r.json"));
    let cloud = clouds::ply(&clouds::bracket(6000));
    fs::write(&input, &cloud).unwrap();
    for method in ["rcond", "distance"] {
        let (file, result) = (input.to_str().unwrap(), output.to_str().unwrap());
        let run = conicoid(&["segment", file, "-o", result, "--method", method], None);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let from_cli: Value = serde_json::from_slice(&fs::read(&output).unwrap()).unwrap();
        let from_http = running.post(&format!("method={method}"), cloud.clone()).await;
        let from_http: Value = from_http.json().await.unwrap();
        assert_eq!(essence(from_cli), essence(from_http));

        let url = running.url(&format!("/v1/segmentations?method={method}"));
        let request = reqwest::Client::new().post(url).header("accept", "application/x-protobuf");
        let answer = request.body(cloud.clone()).send().await.unwrap().bytes().await.unwrap();
        let from_http = v1::Segmentation::decode(answer).unwrap();
        let number = match method {
            "rcond" => v1::Method::Rcond,
            _ => v1::Method::Distance,
        };
        let parameters = v1::Parameters { method: number.into(), ..Default::default() };
        let request = v1::SegmentRequest {
            cloud: cloud.clone().into(),
            parameters: Some(parameters),
            ..Default::default()
        };
        let from_grpc = running.grpc().await.segment(request).await.unwrap().into_inner();
        assert_eq!(message_essence(from_http), message_essence(from_grpc));
    }
}

#[tokio::test]
async fn json_and_protobuf_hold_the_same_numbers() {
    let running = start(&[]).await;
    let cloud = clouds::ply(&clouds::bracket(6000));
    let json: Value = running.post(QUERY, cloud.clone()).await.json().await.unwrap();
    let parameters = v1::Parameters {
        method: v1::Method::Rcond.into(),
        rcond_threshold: Some(1e-11),
        algebraic_threshold: Some(2e-3),
        ..Default::default()
    };
    let request = v1::SegmentRequest {
        cloud: cloud.into(),
        parameters: Some(parameters),
        ..Default::default()
    };
    let message = running.grpc().await.segment(request).await.unwrap().into_inner();
    let regions = json["regions"].as_array().unwrap();
    assert!(!regions.is_empty() && regions.len() == message.regions.len());
    for (region, told) in regions.iter().zip(&message.regions) {
        assert_eq!(region["coefficients"], serde_json::json!(told.coefficients));
        assert_eq!(region["coefficients_error"], serde_json::json!(told.coefficients_error));
        assert_eq!(region["local_coefficients"], serde_json::json!(told.local_coefficients));
        let origin = told.local_origin.unwrap();
        assert_eq!(region["local_origin"], serde_json::json!([origin.x, origin.y, origin.z]));
        assert_eq!(region["point_count"], told.point_count);
        assert_eq!(region["fit"]["rms"], told.fit.unwrap().rms);
    }
    assert_eq!(json["labels"], serde_json::json!(message.labels));
    assert_eq!(json["input"]["sha256"], message.input.unwrap().sha256);
}

#[tokio::test]
async fn a_cloud_in_chunks_or_compressed_or_in_a_form_gives_the_same_answer() {
    use v1::upload::Part;
    let running = start(&[]).await;
    let cloud = clouds::ply(&clouds::bracket(3000));
    let plain: Value = running.post("seed=3", cloud.clone()).await.json().await.unwrap();
    let plain = essence(plain);

    for encoding in ["gzip", "zstd"] {
        let (answer, _) = running.compressed(encoding, "seed=3", &cloud).await;
        assert_eq!(essence(answer.json().await.unwrap()), plain);
    }

    let file = reqwest::multipart::Part::bytes(cloud.clone()).file_name("cloud.PLY");
    let form = reqwest::multipart::Form::new().part("cloud", file);
    let form = form.text("parameters", r#"{"seed": 3}"#);
    let request = reqwest::Client::new().post(running.url("/v1/segmentations")).multipart(form);
    let answer: Value = request.send().await.unwrap().json().await.unwrap();
    assert_eq!(essence(answer), plain);

    let parameters = v1::Parameters { seed: Some(3), ..Default::default() };
    let request = v1::SegmentRequest { parameters: Some(parameters), ..Default::default() };
    let begin = v1::UploadStart { request: Some(request.clone()), ..Default::default() };
    let chunks = cloud.chunks(10_000).map(|c| Part::Chunk(c.to_vec().into()));
    let parts: Vec<_> = std::iter::once(Part::Start(begin))
        .chain(chunks)
        .map(|part| v1::Upload { part: Some(part) })
        .collect();
    let mut client = running.grpc().await;
    let chunked = client.segment_upload(futures::stream::iter(parts)).await.unwrap().into_inner();
    let whole = v1::SegmentRequest { cloud: cloud.into(), ..request };
    let whole = client.segment(whole).await.unwrap().into_inner();
    assert_eq!(message_essence(chunked), message_essence(whole));
}

#[test]
fn the_command_reads_standard_input_and_writes_standard_output() {
    let directory = tempfile::tempdir().unwrap();
    let input = directory.path().join("cloud");
    fs::write(&input, clouds::xyz(&clouds::cylinder(500))).unwrap();
    let run = conicoid(&["segment", "-", "--labels", "none", "--merge", "false"], Some(&input));
    let answer: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(answer["input"]["format"], "xyz");
    assert_eq!(answer["parameters"]["merge"], false);
    assert!(answer.get("labels").is_none());
}

#[tokio::test]
async fn the_command_writes_the_form_that_its_output_or_a_flag_names() {
    let running = start(&[]).await;
    let directory = tempfile::tempdir().unwrap();
    let input = directory.path().join("cloud.ply");
    let cloud = clouds::ply(&clouds::bracket(3000));
    fs::write(&input, &cloud).unwrap();
    let file = |name: &str| directory.path().join(name).display().to_string();
    let segment = |output: &str, flags: &[&str]| {
        let output = file(output);
        let args = [&["segment", input.to_str().unwrap(), "-o", &output], flags].concat();
        assert!(conicoid(&args, None).status.success());
        fs::read(output).unwrap()
    };
    for (form, accept) in [("npy", "application/x-npy"), ("ply", "model/ply"), ("csv", "text/csv")]
    {
        let request = reqwest::Client::new().post(running.url("/v1/segmentations"));
        let request = request.header("accept", accept).body(cloud.clone());
        let expected = request.send().await.unwrap().bytes().await.unwrap();
        assert_eq!(segment(&format!("a.{}", form.to_uppercase()), &[]), expected, "{form}");
        assert_eq!(segment("b.json", &["--output-format", form]), expected, "{form}");
    }
    let message = v1::Segmentation::decode(&*segment("c.pb", &["--labels=none"])).unwrap();
    assert!(message.labels.is_empty() && !message.regions.is_empty());
    let document = segment("d.txt", &["--output-format=json"]);
    let document: Value = serde_json::from_slice(&document).unwrap();
    assert_eq!(document["labels"].as_array().unwrap().len(), 3000);
}

#[test]
fn an_output_that_cannot_be_written_is_refused_before_the_cloud_is_read() {
    let directory = tempfile::tempdir().unwrap();
    let file = |name: &str| directory.path().join(name).display().to_string();
    let cloud = file("cloud.ply");
    fs::write(&cloud, clouds::ply(&clouds::bracket(3000))).unwrap();
    std::os::unix::fs::symlink(&cloud, file("link.ply")).unwrap();
    let (missing, folder) = (file("none/part.json"), file("folder.json"));
    fs::create_dir(&folder).unwrap();
    let (iges, mistyped, bare) = (file("part.iges"), file("part.jsn"), file("part"));
    for (input, output, words) in [
        ("nowhere.ply", &iges, "names no form of a result: end it in .json, .pb, .npy, .ply, .csv"),
        ("nowhere.ply", &mistyped, "--output-format"),
        ("nowhere.ply", &bare, "--output-format"),
        ("nowhere.ply", &missing, "No such file or directory"),
        ("nowhere.ply", &folder, "is a directory"),
        (&cloud, &cloud, "is the cloud itself"),
        (&cloud, &file("link.ply"), "is the cloud itself"),
        (&file("link.ply"), &cloud, "is the cloud itself"),
    ] {
        let run = conicoid(&["segment", input, "-o", output], None);
        let told = String::from_utf8_lossy(&run.stderr);
        assert!(!run.status.success() && told.contains(words), "{output}: {told}");
    }
    let run = conicoid(&["segment", &cloud, "-o", &file("part.json"), "--min-points=5000"], None);
    assert!(!run.status.success());
    // nothing else came into being, not even in part
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 3);
    assert_eq!(fs::read(&cloud).unwrap(), clouds::ply(&clouds::bracket(3000)));
}

#[test]
fn an_output_that_is_there_already_is_replaced_where_it_is() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let directory = tempfile::tempdir().unwrap();
    let file = |name: &str| directory.path().join(name);
    fs::write(file("cloud.ply"), clouds::ply(&clouds::bracket(3000))).unwrap();
    fs::write(file("old.json"), "old").unwrap();
    fs::set_permissions(file("old.json"), fs::Permissions::from_mode(0o640)).unwrap();
    symlink(file("old.json"), file("link.json")).unwrap();
    let cloud = file("cloud.ply").display().to_string();
    let run = conicoid(&["segment", &cloud, "-o", &file("link.json").display().to_string()], None);
    assert!(run.status.success());
    assert!(fs::symlink_metadata(file("link.json")).unwrap().is_symlink());
    assert_eq!(fs::metadata(file("old.json")).unwrap().permissions().mode() & 0o777, 0o640);
    assert!(fs::read(file("old.json")).unwrap().starts_with(b"{"));
    let piped = conicoid(&["segment", &cloud, "-o", "/dev/stdout", "--output-format=csv"], None);
    assert!(piped.status.success() && piped.stdout.starts_with(b"id,type"));
}

#[test]
fn a_bad_flag_or_file_ends_the_command_with_a_clear_message() {
    for (args, words) in [
        (["segment", "nowhere.ply", "--seed=1"], "cannot read nowhere.ply"),
        (["segment", "-", "--min-points=2"], "a whole number from 10"),
        (["segment", "-", "--surfaces=blob"], "blob"),
        (["segment", "-", "--threads=0"], "a whole number above 0"),
        (["segment", "-", "--format=dwg"], "ply, xyz, ptx, pcd"),
        (["segment", "-", "--output-format=dwg"], "json, pb, npy, ply, csv"),
        (["segment", "-", "--seed=1"], "the input is empty"),
    ] {
        let run = conicoid(&args, None);
        let told = String::from_utf8_lossy(&run.stderr);
        assert!(!run.status.success() && told.contains(words), "{args:?}: {told}");
    }
    let radii = ["segment", "-", "--min-radius=5", "--max-radius=2"];
    let told = conicoid(&radii, None).stderr;
    assert!(String::from_utf8_lossy(&told).contains("is above 'max_radius'"));
}

#[tokio::test]
async fn relations_and_snapped_surfaces_are_the_same_in_json_and_protobuf_from_every_transport() {
    let running = start(&[]).await;
    let directory = tempfile::tempdir().unwrap();
    let (input, output) = (directory.path().join("cloud.ply"), directory.path().join("r.json"));
    let cloud = clouds::ply(&clouds::bracket(6000));
    fs::write(&input, &cloud).unwrap();
    let json: Value = running.post("snap=true", cloud.clone()).await.json().await.unwrap();
    let (file, result) = (input.to_str().unwrap(), output.to_str().unwrap());
    let run = conicoid(&["segment", file, "-o", result, "--snap"], None);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let from_cli: Value = serde_json::from_slice(&fs::read(&output).unwrap()).unwrap();
    assert_eq!(essence(from_cli), essence(json.clone()));
    let request =
        v1::SegmentRequest { cloud: cloud.clone().into(), snap: true, ..Default::default() };
    let message = running.grpc().await.segment(request).await.unwrap().into_inner();

    let relations = json["relations"].as_array().unwrap();
    assert!(!relations.is_empty() && relations.len() == message.relations.len());
    for (relation, told) in relations.iter().zip(&message.relations) {
        let kind = told.kind().as_str_name().trim_start_matches("RELATION_KIND_").to_lowercase();
        assert_eq!(relation["kind"], kind);
        assert_eq!(relation["regions"], serde_json::json!(told.regions));
        assert_eq!(relation["deviation"], told.deviation);
        assert_eq!(relation["uncertainty"], told.uncertainty);
        assert_eq!(relation["p_value"], told.p_value);
        assert_eq!(relation["log_odds"], told.log_odds);
        assert_eq!(relation["accepted"], told.accepted);
        assert_eq!(relation["value"].as_f64(), told.value);
    }
    let measures = json["measures"].as_array().unwrap();
    assert_eq!(measures.len(), message.measures.len());
    for (measure, told) in measures.iter().zip(&message.measures) {
        assert_eq!(measure["regions"], serde_json::json!(told.regions));
        assert_eq!(measure["value"], told.value);
    }
    assert_eq!(json["relation_scatter"], message.relation_scatter);
    assert_eq!(json["snapping"]["chi2"], message.snapping.unwrap().chi2);
    for (region, told) in json["regions"].as_array().unwrap().iter().zip(&message.regions) {
        let told = told.snapped.as_ref().unwrap();
        assert_eq!(region["snapped"]["coefficients"], serde_json::json!(told.coefficients));
        assert_eq!(region["snapped"]["moved"], told.moved);
        assert!(told.surface.is_some());
    }
    // without being asked for, no second surface is told
    let plain: Value = running.post("", cloud).await.json().await.unwrap();
    assert_eq!(plain["relations"], json["relations"]);
    assert!(plain["snapping"].is_null() && plain["regions"][0]["snapped"].is_null());
}

//! Clouds that are thinned as they are read: what is found, and that every input point is told of.

use std::{fs, process::Command, thread, time::Duration};

use conicoid::{
    formats::{Hints, Limits, read},
    geometry::{PointCloud, Vec3},
    jobs::Control,
    segment::{Parameters, Silent, segment},
    service::{Answer, ErrorKind, Representation, Request, ServiceError, compute, message::v1},
};
use serde_json::Value;

use super::support::{clouds, conicoid, facets::Facets, location, problem, start};

fn computed(bytes: &[u8], pairs: &[(&str, &str)]) -> Result<Answer, ServiceError> {
    let request = Request::from_pairs(pairs.iter().copied()).unwrap();
    compute(bytes, &request, &Limits::default(), &Control::new(None))
}

fn thinned(bytes: &[u8], length: f64) -> PointCloud {
    read(bytes, Hints { thin: Some(length), ..Hints::default() }, &Limits::default()).unwrap()
}

/// A bracket with a hole, a copy and a stray point.
fn bracket(n: usize) -> Vec<[f64; 3]> {
    let mut points = clouds::bracket(n);
    points[17] = [f64::NAN, 0.0, 0.0];
    points[19] = points[18];
    points[23] = [300.0, 300.0, 300.0];
    points
}

#[test]
fn every_point_has_the_label_of_the_nearest_that_was_kept() {
    let points = bracket(30_000);
    let bytes = clouds::ply(&points);
    let answer = computed(&bytes, &[("thin", "0.8")]).unwrap();
    let kept = thinned(&bytes, 0.8);
    let told = answer.document.input.thin.clone().unwrap();
    assert_eq!((told.length, told.kept), (0.8, kept.points.len()));
    assert_eq!((answer.document.input.points, answer.document.input.skipped), (30_000, 1));
    assert!((1500..6000).contains(&told.kept), "{}", told.kept);
    // what is found is what is found of those kept alone
    let alone = PointCloud::from_points(kept.points.clone());
    let found = segment(&alone, &Parameters::default(), &Silent).unwrap();
    let labels = answer.document.labels();
    assert_eq!(labels.len(), points.len());
    for (p, &label) in points.iter().zip(labels) {
        let p = Vec3::from(*p);
        if p.x.is_nan() {
            assert_eq!(label, -1);
            continue;
        }
        let distance = |k: &usize| (kept.points[*k] - p).norm();
        let nearest = (0..kept.points.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        assert_eq!(label, found.labels[nearest.unwrap()]);
    }
    let regions = &answer.document.regions;
    assert_eq!(regions.len(), found.regions.len());
    for (region, alone) in regions.iter().zip(&found.regions) {
        assert_eq!((&region.surface, region.fit.used), (&alone.surface, alone.fit.used));
        let count = labels.iter().filter(|label| **label == region.id as i32).count();
        assert_eq!(region.point_count, count);
    }
    let unassigned = &answer.document.unassigned;
    assert_eq!(unassigned.count, labels.iter().filter(|label| **label < 0).count());
    assert_eq!(unassigned.reasons.values().sum::<usize>(), unassigned.count);
    assert_eq!(unassigned.reasons["not_finite"], 1);
}

#[test]
fn the_same_points_are_kept_on_any_number_of_threads() {
    let bytes = clouds::ply(&bracket(1_200_000));
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| thinned(&bytes, 0.3))
    };
    let one = on(1);
    assert!(one.points.len() < 60_000);
    assert_eq!(one, on(2));
    assert_eq!(one, on(5));
}

#[test]
fn surfaces_of_a_thinned_cloud_are_the_true_ones() {
    let points = clouds::bracket(200_000);
    let bytes = clouds::ply(&points);
    let answer = computed(&bytes, &[("thin", "0.7")]).unwrap();
    let mut types: Vec<&str> =
        answer.document.regions.iter().map(|r| r.surface_type.name()).collect();
    types.sort_unstable();
    assert_eq!(types, ["cylinder", "plane", "plane"]);
    let cylinder = answer.document.regions.iter().find(|r| r.surface_type.name() == "cylinder");
    let told = serde_json::to_value(cylinder.unwrap()).unwrap();
    let (radius, sd) = (&told["surface"]["radius"], &told["uncertainty"]["radius"]);
    let (radius, sd) = (radius.as_f64().unwrap(), sd.as_f64().unwrap());
    assert!((radius - 10.0).abs() < 4.0 * sd && sd < 0.001, "{radius} {sd}");
    // noise of an even distribution over 0.01
    let noise = answer.document.parameters.noise_sigma.unwrap();
    assert!((noise / (0.01 / 12f64.sqrt()) - 1.0).abs() < 0.1, "{noise}");
    // labels: the joints are where the arc begins and ends
    let labels = answer.document.labels();
    let truth = |p: &[f64; 3]| if p[2] >= 0.0 { "cylinder" } else { "plane" };
    let wrong = points.iter().zip(labels).filter(|(p, label)| {
        let found = usize::try_from(**label).ok().map(|k| answer.document.regions[k].surface_type);
        p[2].abs() > 2.0 && found.is_none_or(|found| found.name() != truth(p))
    });
    assert_eq!(wrong.count(), 0);
}

#[test]
fn a_length_below_the_spacing_changes_nothing_but_what_is_told_of_it() {
    let bytes = clouds::ply(&clouds::bracket(6000));
    let plain = computed(&bytes, &[]).unwrap().document;
    let mut thin = computed(&bytes, &[("thin", "0.001")]).unwrap().document;
    assert_eq!(thin.input.thin.take().map(|thin| thin.kept), Some(6000));
    thin.timing = plain.timing.clone();
    assert_eq!(thin, plain);
}

#[test]
fn what_is_too_thin_says_what_to_do() {
    let bytes = clouds::ply(&clouds::bracket(6000));
    let error = computed(&bytes, &[("thin", "20")]).unwrap_err();
    assert_eq!(error.kind, ErrorKind::TooFewPoints);
    assert!(error.detail.contains("thin=20 keeps"), "{}", error.detail);
    assert!(error.detail.contains("of 6000 points") && error.detail.contains("smaller thin"));
    let error = computed(&bytes, &[("thin", "1e-20")]).unwrap_err();
    assert_eq!(error.kind, ErrorKind::InvalidParameter, "{}", error.detail);
}

#[test]
fn faces_of_a_mesh_have_the_labels_of_all_their_samples() {
    let mesh = Facets::plate(40.0, 15.0, &[6.0, 8.0], 0.1).cut();
    let whole = computed(&mesh.stl(), &[]).unwrap().document;
    let thin = computed(&mesh.stl(), &[("thin", "0.7")]).unwrap().document;
    assert_eq!(thin.input.points, whole.input.points);
    assert!(thin.input.thin.as_ref().unwrap().kept < whole.input.points * 9 / 10);
    let labels = thin.face_labels.as_ref().unwrap();
    assert_eq!((labels.len(), thin.regions.len()), (mesh.faces.len(), whole.regions.len()));
    assert!(labels.iter().all(|label| *label >= 0));
}

#[test]
fn hints_and_fits_are_about_the_points_that_were_kept() {
    let bytes = clouds::ply(&clouds::bracket(30_000));
    let hint = r#"[{"at": [[0, 20, 10]], "type": "cylinder", "radius": 10}]"#;
    let pairs = [("thin", "0.8"), ("hints", hint), ("association", "gaussian")];
    let document = computed(&bytes, &pairs).unwrap().document;
    assert_eq!(format!("{:?}", document.hints[0].outcome), "Applied");
    let kept: usize = document.fits.iter().map(|fit| fit.fit.as_ref().unwrap().input.points).sum();
    let told = document.input.thin.unwrap().kept;
    assert!(kept <= told && kept > told * 9 / 10, "{kept} of {told}");
}

/// The parts of an answer that must not depend on how it was asked for.
fn essence(mut answer: Value) -> Value {
    answer["timing"].take();
    answer
}

#[tokio::test]
async fn all_transports_thin_alike() {
    let running = start(&[]).await;
    let directory = tempfile::tempdir().unwrap();
    let (input, output) = (directory.path().join("cloud.ply"), directory.path().join("r.json"));
    let cloud = clouds::ply(&bracket(20_000));
    fs::write(&input, &cloud).unwrap();
    let (file, result) = (input.to_str().unwrap(), output.to_str().unwrap());
    let run = conicoid(&[file, "-o", result, "--thin", "0.8"], None);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let from_cli = essence(serde_json::from_slice(&fs::read(&output).unwrap()).unwrap());
    assert_eq!(from_cli["input"]["thin"]["length"], 0.8);
    let from_http = running.post("thin=0.8", cloud.clone()).await.json().await.unwrap();
    assert_eq!(from_cli, essence(from_http));
    let form = reqwest::multipart::Form::new()
        .part("cloud", reqwest::multipart::Part::bytes(cloud.clone()))
        .text("parameters", r#"{"thin": 0.8}"#);
    let request = reqwest::Client::new().post(running.url("/v1/segmentations")).multipart(form);
    assert_eq!(from_cli, essence(request.send().await.unwrap().json().await.unwrap()));
    let accepted = running.submit("thin=0.8", cloud.clone()).await;
    let place = location(&accepted);
    running.events(&place).await;
    let job = reqwest::get(running.url(&format!("{place}/result"))).await.unwrap();
    assert_eq!(from_cli, essence(job.json().await.unwrap()));
    let request =
        v1::SegmentRequest { cloud: cloud.clone().into(), thin: Some(0.8), ..Default::default() };
    let told = running.grpc().await.segment(request).await.unwrap().into_inner();
    assert_eq!(serde_json::json!(told.labels), from_cli["labels"]);
    let thin = told.input.unwrap().thin.unwrap();
    assert_eq!(
        (thin.length, serde_json::json!(thin.kept)),
        (0.8, from_cli["input"]["thin"]["kept"].clone())
    );
    for wrong in ["0", "-1", "x", "1e13"] {
        let (status, told) =
            problem(running.post(&format!("thin={wrong}"), cloud.clone()).await).await;
        assert_eq!((status, told.as_str()), (400, "invalid_parameter"));
    }
}

#[tokio::test]
async fn every_form_is_about_all_points_and_the_same_however_it_is_asked_for() {
    let running = start(&[]).await;
    let directory = tempfile::tempdir().unwrap();
    let input = directory.path().join("cloud.ply");
    let points = bracket(20_000);
    let cloud = clouds::ply(&points);
    fs::write(&input, &cloud).unwrap();
    let labels = computed(&cloud, &[("thin", "0.8")]).unwrap().document.labels().to_vec();
    let accepted = running.submit("thin=0.8&name=cloud.ply", cloud.clone()).await;
    let place = location(&accepted);
    running.events(&place).await;
    for form in Representation::ALL.iter().filter(|form| form.has_points()) {
        let accept = form.media_type();
        let http = |request: reqwest::RequestBuilder| async {
            let answer = request.header("accept", accept).send().await.unwrap();
            assert!(answer.status().is_success(), "{accept}");
            answer.bytes().await.unwrap().to_vec()
        };
        let url = running.url("/v1/segmentations?thin=0.8&name=cloud.ply");
        let sync = http(reqwest::Client::new().post(url).body(cloud.clone())).await;
        let job = http(reqwest::Client::new().get(running.url(&format!("{place}/result")))).await;
        let output = directory.path().join(format!("r.{}", form.extension()));
        let run = conicoid(
            &[input.to_str().unwrap(), "-o", output.to_str().unwrap(), "--thin", "0.8"],
            None,
        );
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let file = fs::read(&output).unwrap();
        // a report and a STEP file tell when they were made, and how long it took
        if !matches!(form, Representation::Html | Representation::Step) {
            assert!(sync == job && sync == file, "{form:?}");
        }
        match form {
            Representation::Ply => {
                let cloud = read(&file, None, &Limits::default()).unwrap();
                assert_eq!((cloud.input_len, cloud.skipped()), (20_000, 1));
                let told = conicoid::formats::Fields::of(&file).labels().unwrap();
                assert_eq!(told, labels);
                assert!(
                    cloud
                        .points
                        .iter()
                        .zip(points.iter().filter(|p| !p[0].is_nan()))
                        .all(|(a, b)| a == &Vec3::from(*b))
                );
            }
            Representation::Points => {
                let text = String::from_utf8(file).unwrap();
                let rows: Vec<Vec<&str>> =
                    text.lines().skip(1).map(|l| l.split(',').collect()).collect();
                assert_eq!(rows.len(), 20_000);
                assert!(rows.iter().zip(&labels).all(|(row, label)| row[3] == label.to_string()));
                assert_eq!(rows[17][..3], ["", "", ""]);
                // every point of a region has its deviation, within a step of the thinning where the label is a neighbour's
                for (row, label) in rows.iter().zip(&labels) {
                    let deviation: Option<f64> = row[4].parse().ok();
                    assert_eq!(deviation.is_some(), *label >= 0);
                    assert!(deviation.is_none_or(|d| d.abs() < 1.6), "{row:?}");
                }
            }
            Representation::Deviations => assert_eq!(file.len() % 64, (8 * 20_000) % 64),
            _ => assert!(!file.is_empty()),
        }
    }
}

/// A file that announces `n` points of single precision, all of them zeros that take no room on the disk.
fn sparse(path: &std::path::Path, n: u64) {
    let head = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {n}\nproperty float x\nproperty float y\n\
         property float z\nend_header\n"
    );
    fs::write(path, &head).unwrap();
    fs::File::options()
        .write(true)
        .open(path)
        .unwrap()
        .set_len(head.len() as u64 + 12 * n)
        .unwrap();
}

#[test]
fn a_long_file_is_read_in_place_and_gives_the_same_answer() {
    let directory = tempfile::tempdir().unwrap();
    let (input, output) = (directory.path().join("cloud.ply"), directory.path().join("r.json"));
    // above what is read into memory
    let cloud = clouds::ply(&bracket(2_900_000));
    assert!(cloud.len() > 64 << 20);
    fs::write(&input, &cloud).unwrap();
    let run =
        conicoid(&[input.to_str().unwrap(), "-o", output.to_str().unwrap(), "--thin", "0.3"], None);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let told: Value = serde_json::from_slice(&fs::read(&output).unwrap()).unwrap();
    let answer = computed(&cloud, &[("thin", "0.3")]).unwrap().document;
    assert_eq!(told["labels"], serde_json::json!(answer.labels()));
    assert_eq!(told["input"], serde_json::json!(answer.input));
}

#[cfg(target_os = "linux")]
#[test]
fn a_cloud_without_room_is_refused_with_the_way_out() {
    let directory = tempfile::tempdir().unwrap();
    let input = directory.path().join("cloud.ply");
    // 3.5 GB of points in a third of that
    sparse(&input, 40_000_000);
    let run = |more: &str| {
        let command = format!(
            "ulimit -v 2000000; exec {} {} -o {}/r.npy {more}",
            env!("CARGO_BIN_EXE_conicoid"),
            input.display(),
            directory.path().display()
        );
        let run = Command::new("sh").args(["-c", &command]).output().unwrap();
        (run.status.code(), String::from_utf8(run.stderr).unwrap())
    };
    let (code, told) = run("");
    assert_eq!(code, Some(1), "{told}");
    assert!(told.contains("up to 40000000 points") && told.contains("--thin"), "{told}");
    // there is room for it then, and it has no points but holes
    let (code, told) = run("--thin 1");
    assert_eq!(code, Some(1), "{told}");
    assert!(told.contains("none of the 40000000 points"), "{told}");
}

#[cfg(unix)]
#[test]
fn a_file_that_is_cut_short_under_its_reader_ends_the_run_with_a_message() {
    let directory = tempfile::tempdir().unwrap();
    let input = directory.path().join("cloud.ply");
    let mut told = Vec::new();
    for delay in [2, 5, 10, 20, 40, 80, 160, 320] {
        sparse(&input, 30_000_000);
        let mut command = Command::new(env!("CARGO_BIN_EXE_conicoid"));
        command.arg(&input).args(["--thin", "1"]);
        let child = command.stderr(std::process::Stdio::piped()).spawn().unwrap();
        thread::sleep(Duration::from_millis(delay));
        fs::File::options().write(true).open(&input).unwrap().set_len(200).unwrap();
        let run = child.wait_with_output().unwrap();
        // ended by itself, not by a signal
        assert_eq!(run.status.code(), Some(1), "{:?}", run.status);
        told.push(String::from_utf8(run.stderr).unwrap());
    }
    assert!(told.iter().any(|told| told.contains("was cut short while it was read")), "{told:?}");
}

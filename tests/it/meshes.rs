//! CAD meshes give the surfaces that they were made from, whatever their chord error and format.

use std::f64::consts::FRAC_PI_2;

use conicoid::{
    formats::{FormatError, Hints, Limits, MeshWay, Meshes, read},
    jobs::Control,
    segment::{Parameters, Silent, segment},
    service::{Answer, MeshPoints, Representation, Request, compute, render},
};

use super::support::{
    clouds, conicoid,
    facets::{Facets, Piece},
    location, start,
};

/// A shaft: end face, seat, shoulder, body, rounded edge, shoulder, neck, dome.
fn shaft(chord_error: f64) -> (Facets, &'static [&'static str]) {
    let profile = [
        Piece::Line([10.0, 0.0]),
        Piece::Line([10.0, 30.0]),
        Piece::Line([18.0, 30.0]),
        Piece::Line([18.0, 70.0]),
        Piece::Line([9.0, 90.0]),
        Piece::Line([9.0, 110.0]),
        Piece::Arc([0.0, 110.0], 9.0, [0.0, FRAC_PI_2]),
    ];
    let types = &["plane", "cylinder", "plane", "cylinder", "cone", "cylinder", "sphere"];
    (Facets::turned([0.0, 0.0], &profile, chord_error), types)
}

/// A plate with four bores.
fn plate(chord_error: f64) -> (Facets, &'static [&'static str]) {
    let types = &[
        "plane", "plane", "plane", "plane", "plane", "plane", "cylinder", "cylinder", "cylinder",
        "cylinder",
    ];
    (Facets::plate(40.0, 15.0, &[6.0, 8.0, 10.0, 12.0], chord_error), types)
}

fn answer(bytes: &[u8], pairs: &[(&str, &str)]) -> Answer {
    let request = Request::from_pairs(pairs.iter().copied()).unwrap();
    compute(bytes, &request, &Limits::default(), &Control::new(None)).unwrap()
}

/// The mean intersection over union, by area, of the true surfaces with the regions that share most with them, which are
/// of the true types.
fn score(mesh: &Facets, answer: &Answer, types: &[&str]) -> f64 {
    let labels = answer.document.face_labels.as_ref().unwrap();
    let regions = &answer.document.regions;
    assert_eq!(labels.len(), mesh.faces.len());
    let mut common = vec![vec![0.0; regions.len()]; types.len()];
    let (mut truth, mut found) = (vec![0.0; types.len()], vec![0.0; regions.len()]);
    for ((&label, &surface), area) in labels.iter().zip(&mesh.truth).zip(mesh.areas()) {
        truth[surface] += area;
        if label >= 0 {
            found[label as usize] += area;
            common[surface][label as usize] += area;
        }
    }
    let iou = |surface: usize| {
        let common = &common[surface];
        let best = (0..regions.len()).max_by(|&a, &b| common[a].total_cmp(&common[b])).unwrap();
        assert_eq!(regions[best].surface_type.name(), types[surface], "surface {surface}");
        common[best] / (truth[surface] + found[best] - common[best])
    };
    (0..types.len()).map(iou).sum::<f64>() / types.len() as f64
}

#[test]
fn parts_meshed_with_any_chord_error_give_their_surfaces() {
    for chord_error in [0.01, 0.05, 0.5] {
        for (name, (mesh, types)) in [("shaft", shaft(chord_error)), ("plate", plate(chord_error))]
        {
            let mesh = mesh.cut();
            let answer = answer(&mesh.stl(), &[]);
            let told = answer.document.input.mesh.as_ref().unwrap();
            assert_eq!((told.points, told.faces), (MeshPoints::Samples, mesh.faces.len()));
            let error = told.chord_error.unwrap();
            assert!(error < 1.3 * chord_error, "{name}: {error} of {chord_error}");
            assert_eq!(answer.document.regions.len(), types.len(), "{name} of {chord_error}");
            let score = score(&mesh, &answer, types);
            assert!(score > 0.97, "{name} of {chord_error}: {score}");
        }
    }
}

#[test]
fn every_format_gives_the_same_surfaces_and_a_label_for_each_of_its_faces() {
    let (mesh, types) = plate(0.1);
    for (name, bytes) in
        [("obj", mesh.obj().into_bytes()), ("off", mesh.off().into_bytes()), ("ply", mesh.ply())]
    {
        let answer = answer(&bytes, &[("format", name)]);
        assert_eq!(answer.document.input.format, name);
        assert_eq!(answer.document.regions.len(), types.len(), "{name}");
        let score = score(&mesh, &answer, types);
        assert!(score > 0.97, "{name}: {score}");
    }
}

#[tokio::test]
async fn every_face_has_a_line_over_every_interface() {
    let mesh = plate(0.1).0.cut();
    let running = start(&[]).await;
    let stl = mesh.stl();
    let labels = answer(&stl, &[]).document.face_labels.unwrap();
    assert!(labels.iter().max() > Some(&5));
    let lines: String = labels.iter().enumerate().map(|(k, l)| format!("{k},{l}\n")).collect();
    let expected = format!("face,label\n{lines}");
    let accept = "application/vnd.conicoid.faces+csv";
    let asked = |request: reqwest::RequestBuilder| request.header("accept", accept).send();
    let post = |query: &str, cloud: Vec<u8>| {
        let url = running.url(&format!("/v1/segmentations?{query}"));
        asked(reqwest::Client::new().post(url).body(cloud))
    };
    assert_eq!(post("", stl.clone()).await.unwrap().text().await.unwrap(), expected);
    let place = location(&running.submit("labels=none", stl.clone()).await);
    running.events(&place).await;
    let url = running.url(&format!("{place}/result"));
    let job = asked(reqwest::Client::new().get(url)).await.unwrap();
    assert_eq!(job.text().await.unwrap(), expected);
    let directory = tempfile::tempdir().unwrap();
    let (input, output) = (directory.path().join("p.stl"), directory.path().join("p.faces.csv"));
    std::fs::write(&input, &stl).unwrap();
    let run = conicoid(&[input.to_str().unwrap(), "-o", output.to_str().unwrap()], None);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert_eq!(std::fs::read_to_string(&output).unwrap(), expected);
    for (query, cloud, cure) in [
        ("mesh=vertices&min_points=20", stl, "mesh=faces"),
        ("", clouds::ply(&clouds::bracket(2000)), "points.csv"),
    ] {
        let refused = post(query, cloud).await.unwrap();
        assert_eq!(refused.status(), 406);
        let told: serde_json::Value = refused.json().await.unwrap();
        assert!(told["detail"].as_str().unwrap().contains(cure), "{told}");
    }
}

#[test]
fn radii_are_those_of_the_surface_and_not_of_its_chords() {
    let answer = answer(&plate(0.5).0.cut().stl(), &[]);
    let mut radii: Vec<f64> = answer
        .document
        .regions
        .iter()
        .filter_map(|r| serde_json::to_value(r).unwrap()["surface"]["radius"].as_f64())
        .collect();
    radii.sort_by(f64::total_cmp);
    assert_eq!(radii.len(), 4);
    for (radius, truth) in radii.into_iter().zip([6.0, 8.0, 10.0, 12.0]) {
        // of chords all over they would be a third of a millimetre smaller
        assert!((radius - truth).abs() < 0.05, "{radius} for {truth}");
    }
}

#[test]
fn a_box_of_eight_vertices_has_six_planes() {
    let mut mesh = Facets::default();
    let corner =
        |i: usize| [(i & 1) as f64 * 30.0, (i >> 1 & 1) as f64 * 20.0, (i >> 2) as f64 * 10.0];
    mesh.points = (0..8).map(|i| corner(i).into()).collect();
    for face in [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
    {
        mesh.truth.push(mesh.faces.len());
        mesh.faces.push(face.into());
    }
    for bytes in [mesh.off().into_bytes(), mesh.ply()] {
        let answer = answer(&bytes, &[]);
        let mut labels = answer.document.face_labels.clone().unwrap();
        labels.sort_unstable();
        assert_eq!(labels, [0, 1, 2, 3, 4, 5]);
    }
}

#[test]
fn the_same_samples_come_on_any_number_of_threads() {
    let bytes = shaft(0.1).0.cut().stl();
    let samples = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| read(&bytes, None, &Limits::default()).unwrap())
    };
    let one = samples(1);
    assert_eq!(one, samples(3));
    let parameters = Parameters::default();
    let found = segment(&one, &parameters, &Silent).unwrap();
    let labels = one.mesh.as_ref().unwrap().samples.as_ref().unwrap().face_labels(&found.labels);
    assert_eq!(labels.iter().filter(|label| **label < 0).count(), 0);
}

#[test]
fn samples_are_as_many_as_their_spacing_says_up_to_the_cap() {
    let (mesh, _) = plate(0.1);
    let bytes = mesh.cut().stl();
    let area: f64 = mesh.areas().iter().sum();
    let with = |spacing: f64, most: usize| {
        let meshes =
            Meshes { way: MeshWay::Auto, spacing: Some(spacing), most: most.try_into().unwrap() };
        read(&bytes, Hints { meshes, ..Hints::default() }, &Limits::default())
    };
    let spacing = (area / 5000.0).sqrt();
    let cloud = with(spacing, 5001).unwrap();
    assert!((4999..=5001).contains(&cloud.points.len()), "{}", cloud.points.len());
    let refused = with(spacing, 4998);
    assert!(matches!(refused, Err(FormatError::TooManySamples { most: 4998, .. })), "{refused:?}");
    // each face has its share
    let samples = cloud.mesh.unwrap().samples.clone().unwrap();
    let mut counts = [0.0; 10];
    let truth = mesh.cut().truth;
    samples.face_of.iter().for_each(|&face| counts[truth[face as usize]] += 1.0);
    let mut areas = [0.0; 10];
    mesh.areas().iter().zip(&mesh.truth).for_each(|(a, t)| areas[*t] += a);
    for (count, own) in counts.iter().zip(areas) {
        let wanted = 5000.0 * own / area;
        assert!((count - wanted).abs() < 3.0 + 0.02 * wanted, "{count} for {wanted}");
    }
}

#[test]
fn the_way_may_be_asked_for() {
    let bytes = plate(0.1).0.cut().stl();
    let vertices = answer(&bytes, &[("mesh", "vertices")]);
    let told = vertices.document.input.mesh.unwrap();
    assert_eq!((told.points, told.spacing), (MeshPoints::Vertices, None));
    assert_eq!(vertices.document.input.points, told.vertices);
    assert_eq!(vertices.document.face_labels, None);
    let faces = answer(&bytes, &[("mesh", "faces"), ("mesh_points", "30000"), ("labels", "none")]);
    assert_eq!(faces.document.input.mesh.as_ref().unwrap().points, MeshPoints::Samples);
    let shown = render(Representation::Json, faces, false).unwrap();
    let shown: serde_json::Value = serde_json::from_slice(&shown).unwrap();
    assert!(shown.get("face_labels").is_none() && shown["input"]["mesh"]["points"] == "samples");
    let request = Request::from_pairs([("mesh", "faces")]).unwrap();
    let none = compute(b"v 1 2 3\nv 4 5 6\n", &request, &Limits::default(), &Control::new(None));
    assert!(none.unwrap_err().to_string().contains("no faces"));
}

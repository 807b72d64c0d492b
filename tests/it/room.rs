//! What a cloud will take is looked at before it is unpacked, and text is read by the columns asked for.

use conicoid::{
    formats::{Hints, Limits, read},
    service::message::v1,
};
use serde_json::Value;
use tonic::Code;

use super::support::{clouds, conicoid, location, problem, reason, start};

/// A PCD file whose points, all at the origin, are packed into a 7th of a byte each.
fn packed(points: usize) -> Vec<u8> {
    // four bytes, then steps of 264
    let steps = (points * 12).div_ceil(264);
    let mut block = vec![3, 0, 0, 0, 0];
    block.extend([0b111_00000, 255, 0].repeat(steps));
    let mut file = format!(
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH {points}\nHEIGHT 1\n\
         DATA binary_compressed\n"
    )
    .into_bytes();
    file.extend((block.len() as u32).to_le_bytes());
    file.extend((4 + 264 * steps as u32).to_le_bytes());
    file.extend(block);
    file
}

#[tokio::test]
async fn a_packed_cloud_takes_the_room_of_its_points_or_is_refused() {
    const POINTS: usize = 40_000;
    let file = packed(POINTS);
    assert!(file.len() < 8_000);
    let needed = file.len() + 24 * POINTS;
    for (room, status, code) in [
        // it is read, and its points are holes: all lie at exactly 0, 0, 0
        (needed, 422, "no_finite_points"),
        (needed - 1, 413, "too_many_points"),
    ] {
        let running = start(&[&format!("--max-bytes-in-flight={room}")]).await;
        let answer = running.post("", file.clone()).await;
        assert_eq!(problem(answer).await, (status, code.to_owned()), "{room}");
    }
}

#[tokio::test]
async fn the_points_of_a_waiting_job_are_in_the_budget() {
    let running = start(&["--threads=1", "--max-bytes-in-flight=100000"]).await;
    let release = running.block_small_lane();
    let cloud = "0 0 0\n1 0 0\n0 1 0\n".repeat(600);
    let job = location(&running.submit("", cloud.clone()).await);
    assert_eq!(running.service.bytes_in_flight(), (cloud.len() + 24 * 1800) as u64);
    let second = running.submit("", cloud.clone()).await;
    assert_eq!(problem(second).await, (503, "overloaded".to_owned()));
    release.send(()).unwrap();
    running.events(&job).await;
    // the room is given back with the job's task, a moment after its end
    while running.service.bytes_in_flight() > 0 {
        tokio::task::yield_now().await;
    }
    assert_eq!(running.submit("", cloud).await.status(), 202);
}

#[tokio::test]
async fn a_thinned_cloud_takes_the_room_of_what_is_kept() {
    const POINTS: usize = 20_000;
    let cloud = clouds::ply(&clouds::bracket(POINTS));
    let hints = Hints { thin: Some(3.0), ..Hints::default() };
    let kept = read(&cloud, hints, &Limits::default()).unwrap().points.len();
    let needed = cloud.len() + 8 * POINTS + 24 * kept;
    let whole = cloud.len() + 24 * POINTS;
    assert!(needed < whole * 3 / 4, "{kept} are kept");
    let running = start(&[&format!("--max-bytes-in-flight={needed}")]).await;
    let place = location(&running.submit("thin=3", cloud.clone()).await);
    running.events(&place).await;
    assert_eq!(running.job(&place).await["state"], "succeeded");
    // the buffer that a body comes in may be longer than the body
    let room = needed + cloud.len();
    let running = start(&[&format!("--max-bytes-in-flight={room}")]).await;
    assert_eq!(running.post("thin=3", cloud.clone()).await.status(), 200);
    for (room, query, advice) in
        [(needed - 1, "thin=3", "take a larger thin"), (needed, "labels=none", "give thin=LENGTH")]
    {
        let running = start(&[&format!("--max-bytes-in-flight={room}")]).await;
        for answer in
            [running.post(query, cloud.clone()).await, running.submit(query, cloud.clone()).await]
        {
            assert_eq!(answer.status(), 413, "{room} {query}");
            let told: Value = answer.json().await.unwrap();
            assert!(told["detail"].as_str().unwrap().contains(advice), "{told}");
        }
    }
    // points that are told of one by one are read again
    let running = start(&[&format!("--max-bytes-in-flight={}", needed + 24 * POINTS - 1)]).await;
    let url = running.url("/v1/segmentations?thin=3");
    let request = reqwest::Client::new().post(url).header("accept", "model/ply").body(cloud);
    assert_eq!(problem(request.send().await.unwrap()).await.0, 413);
}

#[tokio::test]
async fn the_lane_is_chosen_by_the_points_and_not_by_the_bytes() {
    let running = start(&["--threads=1", "--small-points=1000"]).await;
    let _release = running.block_small_lane();
    tokio::task::yield_now().await;
    // a few hundred bytes, and more points than the small lane takes: nothing is in its way
    let answer = running.post("", packed(1001)).await;
    assert_eq!(problem(answer).await, (422, "no_finite_points".to_owned()));
    let waits = running.post("deadline=0.1", packed(1000)).await;
    assert_eq!(problem(waits).await, (504, "deadline_exceeded".to_owned()));
}

/// Points with a name before them and their coordinates in another order.
fn named() -> String {
    let row = |p: &[f64; 3]| format!("P1 {} {} {}\n", p[2], p[1], p[0]);
    clouds::cylinder(300).iter().map(row).collect()
}

#[tokio::test]
async fn the_columns_of_a_text_are_named_alike_over_every_interface() {
    let running = start(&[]).await;
    let plain = clouds::xyz(&clouds::cylinder(300));
    let expected: Value = running.post("", plain).await.json().await.unwrap();
    let refused = running.post("format=xyz", named()).await;
    assert_eq!(problem(refused).await, (422, "malformed_cloud".to_owned()));
    for query in ["columns=4,3,2", "columns=4&columns=3&columns=2"] {
        let query = format!("format=xyz&{query}");
        let found: Value = running.post(&query, named()).await.json().await.unwrap();
        assert_eq!(found["regions"], expected["regions"]);
    }
    let message = |columns: &[u32]| v1::SegmentRequest {
        cloud: named().into(),
        columns: columns.to_vec(),
        format: v1::Format::Xyz.into(),
        ..Default::default()
    };
    let found = running.grpc().await.segment(message(&[4, 3, 2])).await.unwrap().into_inner();
    assert_eq!(found.regions.len(), expected["regions"].as_array().unwrap().len());
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("named.txt");
    std::fs::write(&file, named()).unwrap();
    let run = conicoid(&["segment", &file.display().to_string(), "--columns", "4,3,2"], None);
    let found: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(found["regions"], expected["regions"]);
    let wrong = running.grpc().await.segment(message(&[1, 2])).await.unwrap_err();
    assert_eq!(reason(&wrong), (Code::InvalidArgument, "invalid_parameter".to_owned()));
    let ply = running.post("columns=1,2,3", clouds::ply(&clouds::cylinder(300))).await;
    assert_eq!(problem(ply).await, (400, "invalid_parameter".to_owned()));
}

use std::{
    fs::{self, File},
    io::Write,
    path::PathBuf,
    process::{Command, Stdio},
    time::Duration,
};

use reqwest::Client;

use super::{
    block_on,
    cloud::bracket,
    jobs::{Tally, result, settled, submit},
    missed,
    server::Server,
};

/// Room for the database and a few jobs.
const DISK: &str = "12m";
/// Mounts a disk of that size at the first word, in name spaces of its own, and becomes the rest.
const WITHIN: &str = "mount -t tmpfs -o size=\"$1\" tmpfs \"$0\" && shift && exec \"$@\"";
const SMALL: usize = 900;
const LARGE: usize = 20_000;
const WAIT: Duration = Duration::from_secs(30);

pub fn run() -> Vec<String> {
    let usable = Command::new("unshare")
        .args(["--mount", "--map-root-user", "true"])
        .stderr(Stdio::null())
        .status();
    if !usable.is_ok_and(|status| status.success()) {
        return vec!["this system lets nobody mount a disk of his own".to_owned()];
    }
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().to_str().unwrap();
    let data = format!("--data-dir={path}");
    let within = ["unshare", "--mount", "--map-root-user", "sh", "-c", WITHIN, path, DISK];
    let mut server = Server::try_start(&within, &[&data]).unwrap();
    // the disk as the service sees it
    let disk = PathBuf::from(format!("/proc/{}/root{path}", server.id()));
    block_on(fill_and_empty(&mut server, &disk.join("filler")))
}

async fn fill_and_empty(server: &mut Server, filler: &PathBuf) -> Vec<String> {
    let client = Client::new();
    let mut early = Vec::new();
    for _ in 0..10 {
        early.push(submit(server, &client, bracket(SMALL), None).await.1);
    }
    settled(server, &client, &early, WAIT).await;
    fill(filler);
    let (mut told, mut accepted) = (Tally::default(), Vec::new());
    for _ in 0..12 {
        let (status, text) = submit(server, &client, bracket(LARGE), None).await;
        if status == 202 {
            accepted.push(text);
            told.count(status);
        } else {
            told.count(format!("{status} {text}"));
        }
    }
    let ready = status(&format!("{}/readyz", server.admin)).await;
    let mut results = Tally::default();
    for id in &early {
        results.count(result(server, &client, id).await.0);
    }
    let answer = client.post(server.segmentations()).body(bracket(SMALL)).send().await.unwrap();
    println!("full: jobs {told}; readyz {ready}; a caller who waits {}", answer.status());
    println!("full: results of earlier jobs {results}");
    fs::remove_file(filler).unwrap();
    let mut ready_again = 0;
    for _ in 0..100 {
        ready_again = status(&format!("{}/readyz", server.admin)).await;
        if ready_again == 200 {
            break;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    let states = settled(server, &client, &accepted, WAIT).await;
    let mut again = Vec::new();
    for _ in 0..5 {
        again.push(submit(server, &client, bracket(SMALL), None).await.1);
    }
    let after = settled(server, &client, &again, WAIT).await;
    println!("room again: readyz {ready_again}; jobs accepted on the full disk {states}");
    println!("room again: new jobs {after}");
    let refused = told.total() - accepted.len();
    let clean = told.of("507 storage_full") + told.of("503 storage_full");
    missed([
        (format!("{told} on the full disk"), refused == clean),
        (format!("readyz {ready} on the full disk"), ready == 503 || refused == 0),
        (format!("results of earlier jobs: {results}"), results.of("200") == early.len()),
        (format!("readyz {ready_again} with room again"), ready_again == 200),
        (format!("accepted on the full disk: {states}"), states.of("succeeded") == accepted.len()),
        (format!("with room again: {after}"), after.of("succeeded") == again.len()),
        ("the process ended".to_owned(), server.is_alive()),
    ])
}

async fn status(url: &str) -> u16 {
    reqwest::get(url).await.unwrap().status().as_u16()
}

/// Takes all the room there is.
fn fill(path: &PathBuf) {
    let mut file = File::create(path).unwrap();
    for block in [1 << 16, 1 << 10, 1] {
        let zeros = vec![0; block];
        while file.write_all(&zeros).is_ok() {}
    }
}

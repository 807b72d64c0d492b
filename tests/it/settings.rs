//! Settings come from flags, environment and file, in that order, and a wrong one stops the start.

use std::fs;

use super::support::{conicoid, settings, start};

fn file(text: &str) -> (tempfile::TempDir, String) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("conicoid.toml");
    fs::write(&path, text).unwrap();
    let path = path.display().to_string();
    (directory, path)
}

#[test]
fn a_file_gives_settings_and_flags_win() {
    let (_directory, path) = file(
        "queue = 7\nmax-points = 1000\nresult_ttl = 1.5\nallow_anonymous = true\n\
         cors_origins = [\"https://a.example\", \"https://b.example\"]\n",
    );
    let read = settings(&["--config", &path, "--queue=9"]);
    assert_eq!((read.queue.get(), read.max_points), (9, 1000));
    assert_eq!(read.result_ttl.as_secs_f64(), 1.5);
    assert!(read.allow_anonymous);
    assert_eq!(read.cors_origins.len(), 2);
}

#[test]
fn a_wrong_setting_stops_the_start_and_is_named() {
    for (text, words) in [
        ("colour = 'red'\n", "'colour' is no setting"),
        ("max-point = 1\n", "the nearest is 'max_points'"),
        ("[http]\nport = 1\n", "'http' is no table"),
        ("[htpt]\nport = 1\n", "the nearest is 'http'"),
        ("queue = \n", "is not TOML"),
        ("queue = 0\n", "--queue"),
        ("threads = 0\n", "not a whole number above 0"),
        ("max_points = 0\n", "not a whole number above 0"),
        ("max_body_bytes = 0\n", "not a whole number above 0"),
        ("max_bytes_in_flight = 0\n", "not a whole number above 0"),
        ("max_message_bytes = 0\n", "not a whole number above 0"),
        ("key_share = 0\n", "not a number above 0 and up to 1"),
        ("key_share = 1.001\n", "not a number above 0 and up to 1"),
        ("cors_origins = ['viewer.example']\n", "not an origin"),
        ("cors_origins = ['https://viewer.example/']\n", "not an origin"),
        ("cors_origins = ['*']\n", "not an origin"),
        ("otlp_endpoint = 'collector'\n", "not a URL"),
        ("result_ttl = -1\n", "--result-ttl"),
        ("http = 'nowhere'\n", "--http"),
        ("tls_cert = 'cert.pem'\n", "tls_cert and tls_key go together"),
        ("keys = '/nowhere/keys'\n", "cannot read the key file /nowhere/keys"),
        ("log = '!!!'\n", "is not a filter"),
    ] {
        let (_directory, path) = file(text);
        let run = conicoid(
            &[
                "serve",
                "--config",
                &path,
                "--http=127.0.0.1:0",
                "--grpc=127.0.0.1:0",
                "--admin=127.0.0.1:0",
            ],
            None,
        );
        let told = String::from_utf8_lossy(&run.stderr);
        assert!(!run.status.success() && told.contains(words), "{text}: {told}");
        // those of other files than this one tell theirs
        assert!(
            told.contains(&path) || words.contains("key") || words.contains("filter"),
            "{told}"
        );
    }
    let run = conicoid(&["serve", "--config", "/nowhere.toml"], None);
    assert!(String::from_utf8_lossy(&run.stderr).contains("cannot read the settings file"));
}

#[test]
fn a_misspelt_variable_stops_every_command_and_the_nearest_is_named() {
    let run = |args: &[&str], name: &str, value: &str| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_conicoid"));
        command.args(args).env(name, value).stdin(std::process::Stdio::null()).output().unwrap()
    };
    for args in [&["serve"][..], &[], &["segment", "-"], &["openapi"], &["key", "a"], &["health"]] {
        let run = run(args, "CONICOID_MAX_POINT", "5");
        let told = String::from_utf8_lossy(&run.stderr);
        assert!(!run.status.success() && told.contains("nearest is CONICOID_MAX_POINTS"), "{told}");
    }
    assert!(run(&["--help"], "CONICOID_MAX_POINT", "5").status.success());
    // a variable that is one, with a value that its setting does not take
    let wrong = run(&["serve"], "CONICOID_QUEUE", "many");
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("--queue"));
    // one of another command's, and one of a Service in the cluster
    for (name, value) in [("CONICOID_TOLERANCE", "1"), ("CONICOID_PORT", "tcp://10.96.0.7:8080")] {
        assert!(run(&["openapi"], name, value).status.success(), "{name}");
    }
}

#[test]
fn a_wrong_flag_is_not_the_fault_of_the_file() {
    let (_directory, path) = file("queue = 7\n");
    let run = conicoid(&["serve", "--config", &path, "--queue=0"], None);
    let told = String::from_utf8_lossy(&run.stderr);
    assert!(!run.status.success() && told.contains("--queue") && !told.contains(&path), "{told}");
}

#[tokio::test]
async fn a_data_directory_has_one_process() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().to_str().unwrap();
    let _running = start(&["--data-dir", path]).await;
    let flags = ["serve", "--data-dir", path, "--http=127.0.0.1:0", "--grpc=127.0.0.1:0"];
    let run = conicoid(&[&flags[..], &["--admin=127.0.0.1:0"]].concat(), None);
    let told = String::from_utf8_lossy(&run.stderr);
    assert!(!run.status.success() && told.contains(path) && told.contains("another process"));
}

#[test]
fn a_service_that_does_not_answer_is_named() {
    // a port that nobody listens on any more
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    drop(taken);
    let run = conicoid(&["health", "--admin", &address], None);
    let told = String::from_utf8_lossy(&run.stderr);
    assert!(!run.status.success() && told.contains(&address), "{told}");
}

#[test]
fn the_help_is_the_reference_of_every_setting() {
    let help = String::from_utf8(conicoid(&["serve", "--help"], None).stdout).unwrap();
    let flags = help.lines().filter(|line| line.trim_start().starts_with("--")).count();
    let variables = help.matches("[env: CONICOID_").count();
    assert!(flags > 20);
    assert_eq!(flags, variables);
}

#[test]
fn a_worker_reads_the_file_as_well() {
    for (text, words) in [("queue = 0\n", "--queue"), ("threads = 1\n", "no NATS server is named")]
    {
        let (_directory, path) = file(text);
        let run = conicoid(&["worker", "--config", &path, "--admin=127.0.0.1:0"], None);
        let told = String::from_utf8_lossy(&run.stderr);
        assert!(!run.status.success() && told.contains(words), "{told}");
    }
}

#[tokio::test]
async fn the_metrics_show_what_was_done() {
    let running = start(&[]).await;
    assert_eq!(running.post("labels=none", "1 2 3\n".repeat(20)).await.status(), 422);
    let metrics = reqwest::get(running.admin_url("/metrics")).await.unwrap().text().await.unwrap();
    for line in [
        "http_server_request_duration_seconds_bucket{http_request_method=\"POST\",http_route=\"/v1/segmentations\"",
        "conicoid_rejections_total{cause=\"too_few_points\"}",
        "conicoid_queue_length 0",
        "conicoid_bytes_in_flight",
        "conicoid_wait_seconds_bucket{lane=\"small\"",
        "conicoid_run_seconds_bucket{lane=\"small\"",
    ] {
        assert!(metrics.contains(line), "{line} is missing in\n{metrics}");
    }
}

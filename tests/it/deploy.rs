//! What `deploy/` says of the service is true of it: settings, metrics, errors, ports and times.

use std::{collections::BTreeSet, fs, path::Path};

use clap::Args;
use conicoid::{cli::Settings, service::ERRORS};
use serde_json::Value;

use super::support::{settings, start};

fn read(path: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

/// The settings in the order of the reference, with their defaults; `config` names the file itself.
fn reference() -> Vec<(String, Option<String>)> {
    let command = Settings::augment_args(clap::Command::new("serve"));
    let arguments = command.get_arguments().filter(|argument| argument.get_id() != "config");
    let default = |argument: &clap::Arg| {
        let values = argument.get_default_values();
        values.first().map(|value| value.to_string_lossy().into_owned())
    };
    arguments.map(|argument| (argument.get_id().to_string(), default(argument))).collect()
}

/// The example file with the mark taken off each setting.
fn unmarked() -> String {
    let text = read("deploy/conicoid.toml");
    let line = |line: &str| match line.strip_prefix('#') {
        Some(setting) if setting.starts_with(|c: char| c.is_ascii_lowercase()) => {
            setting.to_owned()
        }
        _ => line.to_owned(),
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

fn settings_of(text: &str) -> Settings {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("conicoid.toml");
    fs::write(&path, text).unwrap();
    let path = path.display().to_string();
    conicoid::cli::settings(&["conicoid".into(), "--config".into(), path.into()]).unwrap()
}

#[test]
fn the_example_settings_are_all_settings_in_order_with_their_defaults() {
    let text = unmarked();
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let given: Vec<_> = lines.filter_map(|line| line.split_once(" = ")).collect();
    let reference = reference();
    let keys: Vec<_> = given.iter().map(|(key, _)| *key).collect();
    assert_eq!(keys, reference.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>());
    for ((_, value), (name, default)) in given.iter().zip(&reference) {
        let value = value.trim_matches('"');
        assert_eq!(value, default.as_deref().unwrap_or(value), "{name}");
    }
}

#[test]
fn the_example_settings_are_read_with_and_without_their_marks() {
    assert_eq!(settings_of(&read("deploy/conicoid.toml")).data_dir, None);
    let all = settings_of(&unmarked());
    assert_eq!(all.data_dir.as_deref(), Some(Path::new("/data")));
    assert_eq!(all.threads.map(|n| n.get()), Some(2));
    assert_eq!(all.cors_origins.len(), 1);
}

#[test]
fn every_example_setting_is_explained() {
    let text = read("deploy/conicoid.toml");
    let lines: Vec<_> = text.lines().collect();
    for pair in
        lines.windows(2).filter(|pair| pair[1].contains(" = ") && !pair[1].starts_with("# "))
    {
        assert!(pair[0].starts_with("# "), "nothing stands above {}", pair[1]);
    }
}

/// The expressions of the alert rules and of the dashboard, without line breaks.
fn expressions() -> Vec<String> {
    let rules = read("deploy/prometheus/rules.yaml");
    let mut found = Vec::new();
    for part in rules.split("expr: ").skip(1) {
        let part = part.trim_start_matches(">-");
        let ends = ["\n        for:", "\n        labels:", "\n\n"];
        let end = ends.iter().filter_map(|end| part.find(end)).min().unwrap_or(part.len());
        found.push(part[..end].split_whitespace().collect::<Vec<_>>().join(" "));
    }
    let dashboard: Value = serde_json::from_str(&read("deploy/grafana/conicoid.json")).unwrap();
    for panel in dashboard["panels"].as_array().unwrap() {
        for target in panel["targets"].as_array().into_iter().flatten() {
            found.push(target["expr"].as_str().unwrap().to_owned());
        }
    }
    assert!(found.len() > 20, "{found:?}");
    found
}

/// The metrics an expression reads: words with an underscore, outside quotes and lists of labels, that
/// no function has.
fn metrics_in(expression: &str) -> BTreeSet<String> {
    let unquoted: String = expression.split('"').step_by(2).collect::<Vec<_>>().join(" ");
    let (first, rest) = unquoted.split_once("by (").unwrap_or((&unquoted, ""));
    let after_labels = rest.split("by (").filter_map(|part| Some(part.split_once(')')?.1));
    let unlisted = std::iter::once(first).chain(after_labels).collect::<Vec<_>>().join(" ");
    let words = unlisted.split(|c: char| !c.is_ascii_alphanumeric() && !"_:$".contains(c));
    let words = words.filter(|word| {
        word.contains('_') && !word.contains([':', '$']) && !word.ends_with("_over_time")
    });
    let words = words.filter(|word| *word != "histogram_quantile");
    let base = |word: &str| {
        let ends = ["_bucket", "_sum", "_count"];
        ends.iter().find_map(|end| word.strip_suffix(end)).unwrap_or(word).to_owned()
    };
    words.map(base).collect()
}

/// The names in the source that its metrics are described under.
fn metrics_of_the_source() -> BTreeSet<String> {
    let source = read("src/cli/measure.rs");
    let calls = source.split("describe_").skip(1).filter_map(|call| call.split_once("!("));
    let names =
        calls.filter_map(|(_, rest)| rest.trim_start().strip_prefix('"')?.split('"').next());
    names.map(str::to_owned).collect()
}

#[test]
fn rules_and_dashboard_read_the_metrics_of_the_source_and_miss_none() {
    let read: BTreeSet<_> = expressions().iter().flat_map(|e| metrics_in(e)).collect();
    assert_eq!(read, metrics_of_the_source());
}

#[tokio::test]
async fn the_labels_of_rules_and_dashboard_are_those_of_the_metrics() {
    let running = start(&[]).await;
    assert_eq!(running.post("labels=none", "0 0 0\n".repeat(20)).await.status(), 422);
    let metrics = reqwest::get(running.admin_url("/metrics")).await.unwrap().text().await.unwrap();
    for expression in expressions() {
        for selector in expression.split('{').skip(1).filter_map(|rest| rest.split('}').next()) {
            for matcher in selector.split(", ") {
                let label = matcher.split(['=', '!']).next().unwrap();
                let of_the_scrape = ["job", "instance"].contains(&label);
                let known = of_the_scrape || metrics.contains(&format!("{label}=\""));
                assert!(known, "{label} in {expression}");
                if let Some(cause) = matcher.strip_prefix("cause=\"") {
                    let code = cause.trim_end_matches('"');
                    assert!(ERRORS.iter().any(|row| row.code == code), "{cause} in {expression}");
                }
            }
        }
    }
}

/// The number after each `name` in `text`.
fn numbers_after(text: &str, name: &str) -> Vec<u64> {
    let digits = |rest: &str| rest.chars().take_while(char::is_ascii_digit).collect::<String>();
    text.split(name).skip(1).map(|rest| digits(rest.trim_start()).parse().unwrap()).collect()
}

#[test]
fn all_of_them_name_the_same_ports() {
    let defaults = conicoid::cli::settings(&["conicoid".into()]).unwrap();
    let [http, grpc, admin] = [defaults.http, defaults.grpc, defaults.admin].map(|a| a.port());
    let dockerfile = read("Dockerfile");
    assert!(dockerfile.contains(&format!("EXPOSE {http} {grpc} {admin}\n")));
    for (name, port) in [("HTTP", http), ("GRPC", grpc), ("ADMIN", admin)] {
        assert!(dockerfile.contains(&format!("CONICOID_{name}=0.0.0.0:{port}")), "{name}");
        let compose = read("deploy/compose.yaml");
        assert!(compose.contains(&format!("\"127.0.0.1:{port}:{port}\"")), "{name}");
    }
    let [http, grpc, admin] = [http, grpc, admin].map(u64::from);
    let deployment = read("deploy/kubernetes/deployment.yaml");
    assert_eq!(numbers_after(&deployment, "containerPort:"), [http, grpc, admin]);
    assert!(deployment.contains(&format!("prometheus.io/port: \"{admin}\"")));
    let service = read("deploy/kubernetes/service.yaml");
    assert_eq!(numbers_after(&service, " port:"), [http, grpc]);
    let network = read("deploy/kubernetes/network.yaml");
    assert_eq!(numbers_after(&network, "- port:"), [http, grpc, admin]);
    assert!(read("deploy/prometheus/prometheus.yaml").contains(&format!("conicoid:{admin}")));
}

#[test]
fn the_pods_get_no_variables_made_from_service_names_and_traces_reach_the_collector() {
    assert!(read("deploy/kubernetes/deployment.yaml").contains("enableServiceLinks: false"));
    // nothing goes out but what the component adds
    assert!(read("deploy/kubernetes/network.yaml").contains("egress: []"));
    let traces = read("deploy/kubernetes/traces/kustomization.yaml");
    let endpoint = traces.split("value: http://").nth(1).unwrap();
    let port = numbers_after(endpoint.lines().next().unwrap(), ":")[0];
    assert_eq!(numbers_after(&traces, "- port:"), [port, 53, 53]);
    let variable = traces.split("name: CONICOID_").nth(1).unwrap().lines().next().unwrap();
    assert!(reference().iter().any(|(name, _)| name.to_uppercase() == variable), "{variable}");
}

#[test]
fn images_go_by_the_version_of_this_code() {
    let version = env!("CARGO_PKG_VERSION");
    assert!(read("deploy/compose.yaml").contains(&format!("image: conicoid:{version}\n")));
    assert!(read("deploy/kubernetes/kustomization.yaml").contains(&format!("newTag: {version}\n")));
    assert!(read("CHANGELOG.md").contains(&format!("\n## {version}")));
}

#[test]
fn a_pod_gets_the_time_its_drain_takes() {
    let pods = settings_of(&read("deploy/kubernetes/conicoid.toml"));
    let deployment = read("deploy/kubernetes/deployment.yaml");
    let grace = numbers_after(&deployment, "terminationGracePeriodSeconds:")[0];
    let pause = numbers_after(&deployment, "\n                seconds:")[0];
    assert!(grace > pause + pods.drain_deadline.as_secs() + 1);
    let compose = numbers_after(&read("deploy/compose.yaml"), "stop_grace_period:")[0];
    assert!(compose > settings(&[]).drain_deadline.as_secs() + 1);
    // a caller stays with the pod that knows its job
    let affinity = numbers_after(&read("deploy/kubernetes/service.yaml"), "timeoutSeconds:")[0];
    assert!(affinity >= pods.result_ttl.as_secs());
}

#[test]
fn the_settings_of_compose_are_settings() {
    let known: Vec<_> = reference().into_iter().map(|(name, _)| name.to_uppercase()).collect();
    let compose = read("deploy/compose.yaml");
    let lines = compose.lines().filter_map(|line| line.trim_start().strip_prefix("CONICOID_"));
    let names: Vec<_> =
        lines.filter_map(|line| line.split_once(':').map(|(name, _)| name)).collect();
    assert!(names.len() > 3);
    for name in names {
        assert!(known.iter().any(|k| k == name), "CONICOID_{name} is no setting");
    }
}

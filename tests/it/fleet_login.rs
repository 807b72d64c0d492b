//! NATS servers that ask who calls: certificates, passwords, tokens and credentials files.

use std::{fs, path::Path};

use base64::{Engine, engine::general_purpose::URL_SAFE_NO_PAD};
use conicoid::cli::Server;
use nkeys::KeyPair;
use serde_json::{Value, json};
use tempfile::TempDir;
use tokio_util::sync::CancellationToken;

use super::{
    fleet::{cloud, submit, until},
    support::{conicoid, nats::NatsServer, settings, start},
    tls::{authority, leaf},
};

const PASSWORD: &str = "s3cret/of@all";
const IN_ADDRESS: &str = "s3cret%2Fof%40all";

/// A job goes through a front end and a worker with `flags`.
async fn works(flags: &[&str]) {
    let front = start(flags).await;
    let worker = Server::bind_worker(settings(flags)).await.unwrap();
    let stop = CancellationToken::new();
    let run = worker.run(stop.clone());
    tokio::spawn(async move { run.await.unwrap() });
    let _stop = stop.drop_guard();
    let id = submit(&front, "", cloud()).await;
    until(&front, &id, "succeeded").await;
}

/// What a process says that `flags` do not let in, with all that its log may tell.
async fn refused(flags: &[&str]) -> String {
    let flags: Vec<String> = flags.iter().map(|flag| (*flag).to_owned()).collect();
    let begin = std::time::Instant::now();
    let run = tokio::task::spawn_blocking(move || {
        let flags = flags.iter().map(String::as_str);
        let all = ["worker", "--admin=127.0.0.1:0", "--log=trace"].into_iter().chain(flags);
        conicoid(&all.collect::<Vec<_>>(), None)
    });
    let run = run.await.unwrap();
    assert!(!run.status.success());
    // nothing that time would mend
    assert!(begin.elapsed().as_secs() < 20, "{:?}", begin.elapsed());
    let told = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(!told.contains(PASSWORD) && !told.contains(IN_ADDRESS), "{told}");
    told
}

/// Whether the last line has each of `parts`.
fn ends_with(told: &str, parts: &[&str]) {
    let last = told.lines().last().unwrap_or_default();
    assert!(parts.iter().all(|part| last.contains(part)), "{told}");
}

fn write(directory: &TempDir, name: &str, text: &str) -> String {
    let path = directory.path().join(name);
    fs::write(&path, text).unwrap();
    path.display().to_string()
}

#[tokio::test(flavor = "multi_thread")]
async fn servers_that_want_certificates_get_them() {
    let (own, other) = (authority("own"), authority("other"));
    let files = tempfile::tempdir().unwrap();
    let server = leaf(&own, "server");
    let client = leaf(&own, "client");
    let ca = write(&files, "ca.pem", &own.pem());
    let flag = |name: &str, path: &str| format!("--{name}={path}");
    let nats = NatsServer::start_with(vec![
        "--tls".to_owned(),
        "--tlsverify".to_owned(),
        flag("tlscert", &write(&files, "server.pem", &server.0)),
        flag("tlskey", &write(&files, "server-key.pem", &server.1)),
        flag("tlscacert", &ca),
    ]);
    let ca = flag("nats-ca", &ca);
    let cert = flag("nats-cert", &write(&files, "client.pem", &client.0));
    let key = flag("nats-key", &write(&files, "client-key.pem", &client.1));
    for scheme in ["tls", "nats"] {
        let url = flag("nats", &nats.address(&format!("{scheme}://localhost")));
        works(&[&url, &ca, &cert, &key]).await;
    }
    let url = flag("nats", &nats.address("tls://localhost"));
    ends_with(&refused(&[&url, &ca]).await, &["cannot connect to NATS", "nats_cert"]);
    let wrong = flag("nats-ca", &write(&files, "other.pem", &other.pem()));
    let told = refused(&[&url, &wrong, &cert, &key]).await;
    ends_with(&told, &["UnknownIssuer", "nats_ca must name the authority"]);
    let by_number = flag("nats", &nats.address("tls://127.0.0.1"));
    let told = refused(&[&by_number, &ca, &cert, &key]).await;
    ends_with(&told, &["not valid for name", "a name that is in them"]);
    let absent = flag("nats-ca", "/nowhere/ca.pem");
    ends_with(&refused(&[&url, &absent]).await, &["cannot read nats_ca = /nowhere/ca.pem"]);
    // whoever names an authority does not talk to a server without certificate
    let plain = NatsServer::start();
    let url = flag("nats", &plain.address("nats://localhost"));
    ends_with(&refused(&[&url, &ca]).await, &["nats_ca must name"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_password_or_a_token_in_the_address_is_shown_to_the_servers_and_to_nobody_else() {
    let nats =
        NatsServer::start_with(vec!["--user=fleet".to_owned(), format!("--pass={PASSWORD}")]);
    let url = |login: &str| nats.address(&format!("--nats=nats://{login}127.0.0.1"));
    works(&[&url(&format!("fleet:{IN_ADDRESS}@"))]).await;
    let told = refused(&[&url(&format!("other:{IN_ADDRESS}@"))]).await;
    ends_with(&told, &["authorization violation", "do not let in the user and password"]);
    ends_with(&refused(&[&url("")]).await, &["user and password", "nats_credentials"]);
    let two = format!("{},nats://b:c@127.0.0.1", url(&format!("fleet:{IN_ADDRESS}@")));
    ends_with(&refused(&[&two]).await, &["different users"]);
    // a wrong address with a password is not repeated either
    let wrong = format!("--nats=http://fleet:{IN_ADDRESS}@127.0.0.1");
    assert!(refused(&[&wrong]).await.contains("invalid value 'http://...' for '--nats"));
    let help = std::process::Command::new(env!("CARGO_BIN_EXE_conicoid"))
        .args(["serve", "--help"])
        .env("CONICOID_NATS", format!("nats://fleet:{IN_ADDRESS}@127.0.0.1"))
        .output()
        .unwrap();
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    assert!(help.contains("CONICOID_NATS") && !help.contains(IN_ADDRESS));
    let nats = NatsServer::start_with(vec![format!("--auth={PASSWORD}")]);
    works(&[&nats.address(&format!("--nats=nats://{IN_ADDRESS}@127.0.0.1"))]).await;
}

/// A JWT as NATS has it: `nats` are the claims, `by` signs that it says so of `of`.
fn jwt(by: &KeyPair, of: &KeyPair, nats: Value, expires: Option<u64>) -> String {
    let part = |value: Value| URL_SAFE_NO_PAD.encode(value.to_string());
    let mut claims = json!({
        "jti": "1", "iat": 1, "iss": by.public_key(), "sub": of.public_key(), "name": "n", "nats": nats,
    });
    if let Some(expires) = expires {
        claims["exp"] = expires.into();
    }
    let header = json!({ "typ": "JWT", "alg": "ed25519-nkey" });
    let text = format!("{}.{}", part(header), part(claims));
    let signature = by.sign(text.as_bytes()).unwrap();
    format!("{text}.{}", URL_SAFE_NO_PAD.encode(signature))
}

/// A server of an operator, and the key of its account.
fn operated(directory: &TempDir) -> (NatsServer, KeyPair) {
    let (operator, system, account) =
        (KeyPair::new_operator(), KeyPair::new_account(), KeyPair::new_account());
    let limits = |disk: i64| {
        json!({
            "subs": -1, "data": -1, "payload": -1, "imports": -1, "exports": -1, "wildcards": true,
            "conn": -1, "leaf": -1, "mem_storage": disk, "disk_storage": disk, "streams": disk,
            "consumer": disk,
        })
    };
    let own = json!({ "type": "operator", "version": 2, "system_account": system.public_key() });
    let of = |of: &KeyPair, disk| {
        let claims = json!({ "type": "account", "version": 2, "limits": limits(disk) });
        format!("{}: {}", of.public_key(), jwt(&operator, of, claims, None))
    };
    let text = format!(
        "operator: {}\nsystem_account: {}\nresolver: MEMORY\nresolver_preload: {{\n{}\n{}\n}}\n",
        jwt(&operator, &operator, own, None),
        system.public_key(),
        of(&system, 0),
        of(&account, -1),
    );
    let file = write(directory, "operator.conf", &text);
    (NatsServer::start_with(vec![format!("--config={file}")]), account)
}

/// The credentials file of a new user of `account`.
fn credentials(directory: &TempDir, name: &str, account: &KeyPair, expires: Option<u64>) -> String {
    let user = KeyPair::new_user();
    let claims = json!({ "type": "user", "version": 2, "subs": -1, "data": -1, "payload": -1 });
    let (jwt, seed) = (jwt(account, &user, claims, expires), user.seed().unwrap());
    let text = format!(
        "-----BEGIN NATS USER JWT-----\n{jwt}\n------END NATS USER JWT------\n\n\
         -----BEGIN USER NKEY SEED-----\n{seed}\n------END USER NKEY SEED------\n"
    );
    let path = write(directory, name, &text);
    assert!(Path::new(&path).exists());
    format!("--nats-credentials={path}")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_credentials_file_lets_in_the_user_of_an_account() {
    let files = tempfile::tempdir().unwrap();
    let (nats, account) = operated(&files);
    let url = format!("--nats={}", nats.url());
    let good = credentials(&files, "good.creds", &account, None);
    works(&[&url, &good]).await;
    let late = credentials(&files, "late.creds", &account, Some(2));
    let stranger = credentials(&files, "stranger.creds", &KeyPair::new_account(), None);
    for wrong in [&late, &stranger] {
        ends_with(&refused(&[&url, wrong]).await, &["the user of nats_credentials", "expired"]);
    }
    ends_with(&refused(&[&url]).await, &["nats_credentials"]);
    let empty = write(&files, "empty.creds", "");
    let told = refused(&[&url, &format!("--nats-credentials={empty}")]).await;
    ends_with(&told, &["cannot read nats_credentials", "empty.creds", "JWT"]);
    let both = nats.address("--nats=nats://a:b@127.0.0.1");
    ends_with(&refused(&[&both, &good]).await, &["both name a user"]);
}

//! TLS: both interfaces, client certificates and who they stand for, files that change, failed handshakes.

use std::{
    fs,
    io::{Read, Write},
    net::TcpStream,
    path::PathBuf,
};

use conicoid::service::message::v1::{
    self, jobs_client::JobsClient, segmentations_client::SegmentationsClient,
};
use rcgen::{BasicConstraints, CertificateParams, CertifiedIssuer, DnType, IsCa, KeyPair};
use reqwest::{Client, Response};
use tempfile::TempDir;
use tonic::{
    Code,
    transport::{Certificate, Channel, ClientTlsConfig, Identity},
};

use super::support::{Running, clouds, location, start};
use super::survival::Process;

pub type Authority = CertifiedIssuer<'static, KeyPair>;

/// The certificate and key of a leaf, in PEM.
pub type Leaf = (String, String);

/// An authority of that name.
pub fn authority(name: &str) -> Authority {
    let mut params = CertificateParams::new(Vec::new()).unwrap();
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    params.distinguished_name.push(DnType::CommonName, name);
    CertifiedIssuer::self_signed(params, KeyPair::generate().unwrap()).unwrap()
}

/// A leaf of that name below `authority`.
pub fn leaf(authority: &Authority, name: &str) -> Leaf {
    let key = KeyPair::generate().unwrap();
    let mut params = CertificateParams::new(vec!["localhost".to_owned()]).unwrap();
    params.distinguished_name.push(DnType::CommonName, name);
    (params.signed_by(&key, authority).unwrap().pem(), key.serialize_pem())
}

/// The files of a service with TLS.
struct Files(TempDir);

impl Files {
    /// A certificate, its key and, where it is given, the authority of the clients.
    fn new(server: &Leaf, clients: Option<&Authority>) -> Self {
        let files = Self(tempfile::tempdir().unwrap());
        files.put(server);
        if let Some(clients) = clients {
            fs::write(files.path("ca.pem"), clients.pem()).unwrap();
        }
        files
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn put(&self, (cert, key): &Leaf) {
        fs::write(self.path("cert.pem"), cert).unwrap();
        fs::write(self.path("key.pem"), key).unwrap();
    }

    fn flags(&self) -> Vec<String> {
        let flag = |flag: &str, name: &str| format!("--{flag}={}", self.path(name).display());
        let mut flags = vec![flag("tls-cert", "cert.pem"), flag("tls-key", "key.pem")];
        if self.path("ca.pem").exists() {
            flags.push(flag("client-ca", "ca.pem"));
        }
        flags
    }

    async fn start(&self, more: &[&str]) -> Running {
        let flags = self.flags();
        start(&flags.iter().map(String::as_str).chain(more.iter().copied()).collect::<Vec<_>>())
            .await
    }
}

/// A caller who trusts `authority`, and shows a certificate where it has one.
struct Caller<'a> {
    running: &'a Running,
    authority: &'a Authority,
    identity: Option<&'a Leaf>,
}

impl Caller<'_> {
    /// A client of its own, so that no connection is used again.
    fn client(&self) -> Client {
        let root = reqwest::Certificate::from_pem(self.authority.pem().as_bytes()).unwrap();
        let mut client = Client::builder().add_root_certificate(root).use_rustls_tls();
        if let Some((cert, key)) = self.identity {
            let pem = format!("{cert}{key}");
            client = client.identity(reqwest::Identity::from_pem(pem.as_bytes()).unwrap());
        }
        client.build().unwrap()
    }

    fn url(&self, path: &str) -> String {
        format!("https://localhost:{}{path}", self.running.addresses.http.port())
    }

    async fn get(&self, path: &str) -> reqwest::Result<Response> {
        self.client().get(self.url(path)).send().await
    }

    async fn is_let_in(&self) -> bool {
        self.get("/docs").await.is_ok()
    }

    async fn channel(&self) -> Result<Channel, Code> {
        let mut tls = ClientTlsConfig::new()
            .ca_certificate(Certificate::from_pem(self.authority.pem()))
            .domain_name("localhost");
        if let Some((cert, key)) = self.identity {
            tls = tls.identity(Identity::from_pem(cert, key));
        }
        let url = format!("https://localhost:{}", self.running.addresses.grpc.port());
        let channel = Channel::from_shared(url).unwrap().tls_config(tls).unwrap();
        channel.connect().await.map_err(|_| Code::Unavailable)
    }

    async fn call(&self) -> Result<(), Code> {
        let cloud = clouds::xyz(&clouds::cylinder(200)).into();
        let message = v1::SegmentRequest { cloud, ..Default::default() };
        let answer = SegmentationsClient::new(self.channel().await?).segment(message).await;
        answer.map(|_| ()).map_err(|status| status.code())
    }

    async fn submit(&self, key: Option<&str>) -> Response {
        let request = self.client().post(self.url("/v1/segmentations"));
        let request = request.header("prefer", "respond-async").header("idempotency-key", "same");
        let request = key.into_iter().fold(request, |request, key| request.bearer_auth(key));
        request.body(clouds::xyz(&clouds::cylinder(200))).send().await.unwrap()
    }

    async fn grpc_job(&self, id: &str) -> Result<v1::Job, Code> {
        let message = v1::GetJobRequest { id: id.to_owned() };
        let answer = JobsClient::new(self.channel().await?).get_job(message).await;
        answer.map(tonic::Response::into_inner).map_err(|status| status.code())
    }
}

#[tokio::test]
async fn both_interfaces_speak_tls() {
    let authority = authority("ours");
    let running = Files::new(&leaf(&authority, "server"), None);
    let running = running.start(&[]).await;
    let caller = Caller { running: &running, authority: &authority, identity: None };
    assert_eq!(caller.get("/docs").await.unwrap().status(), 200);
    assert_eq!(caller.call().await, Ok(()));
    assert!(reqwest::get(running.url("/docs")).await.is_err());
}

#[tokio::test]
async fn only_certificates_of_the_right_authority_are_let_in() {
    let authority = authority("ours");
    let files = Files::new(&leaf(&authority, "server"), Some(&authority));
    let running = files.start(&[]).await;
    let (ours, foreign) = (leaf(&authority, "a"), leaf(&self::authority("theirs"), "a"));
    let caller = |identity| Caller { running: &running, authority: &authority, identity };
    assert_eq!(caller(Some(&ours)).get("/docs").await.unwrap().status(), 200);
    assert_eq!(caller(Some(&ours)).call().await, Ok(()));
    for stranger in [None, Some(&foreign)] {
        assert!(!caller(stranger).is_let_in().await);
        assert!(caller(stranger).call().await.is_err());
    }
}

#[tokio::test]
async fn two_client_certificates_see_their_own_jobs_alone() {
    let authority = authority("ours");
    let files = Files::new(&leaf(&authority, "server"), Some(&authority));
    let running = files.start(&[]).await;
    let [press, mill, renewed] = ["press", "mill", "press"].map(|name| leaf(&authority, name));
    let caller = |leaf| Caller { running: &running, authority: &authority, identity: Some(leaf) };
    let place = location(&caller(&press).submit(None).await);
    let id = place.rsplit('/').next().unwrap();
    // the same cloud under the same idempotency key is another job for another tenant
    let theirs = location(&caller(&mill).submit(None).await);
    assert_ne!(place, theirs);
    assert_eq!(location(&caller(&press).submit(None).await), place);
    // a renewed certificate is the same tenant
    for own in [&press, &renewed] {
        let events =
            caller(own).get(&format!("{place}/events")).await.unwrap().text().await.unwrap();
        assert!(events.contains("succeeded"), "{events}");
        assert_eq!(caller(own).get(&place).await.unwrap().status(), 200);
        assert_eq!(caller(own).grpc_job(id).await.unwrap().id, id);
    }
    for path in ["", "/result", "/events"] {
        let answer = caller(&mill).get(&format!("{place}{path}")).await.unwrap();
        assert_eq!(answer.status(), 404, "{path}");
    }
    let other = caller(&mill);
    let refused = other.client().delete(other.url(&place)).send().await.unwrap();
    assert_eq!(refused.status(), 404);
    assert_eq!(caller(&mill).grpc_job(id).await.unwrap_err(), Code::NotFound);
    let message = v1::CancelJobRequest { id: id.to_owned() };
    let refused = JobsClient::new(other.channel().await.unwrap()).cancel_job(message).await;
    assert_eq!(refused.unwrap_err().code(), Code::NotFound);
    assert_eq!(caller(&press).get(&place).await.unwrap().status(), 200);
}

#[tokio::test]
async fn with_keys_and_client_certificates_both_must_hold_and_the_key_is_the_tenant() {
    let authority = authority("ours");
    let files = Files::new(&leaf(&authority, "server"), Some(&authority));
    let sha256 = conicoid::service::sha256;
    let keys = files.path("keys");
    fs::write(&keys, format!("a {}\nb {}\n", sha256(b"alpha"), sha256(b"beta"))).unwrap();
    let running = files.start(&[&format!("--keys={}", keys.display())]).await;
    let [press, mill] = ["press", "mill"].map(|name| leaf(&authority, name));
    let caller = |identity| Caller { running: &running, authority: &authority, identity };
    assert!(!caller(None).is_let_in().await);
    assert_eq!(caller(Some(&press)).submit(None).await.status(), 401);
    let place = location(&caller(Some(&press)).submit(Some("alpha")).await);
    assert_eq!(location(&caller(Some(&mill)).submit(Some("alpha")).await), place);
    assert_ne!(location(&caller(Some(&press)).submit(Some("beta")).await), place);
}

#[tokio::test]
async fn a_renewed_certificate_is_shown_to_the_next_connection() {
    let [old, new] = ["old", "new"].map(authority);
    let files = Files::new(&leaf(&old, "server"), None);
    let running = files.start(&[]).await;
    let caller = |authority| Caller { running: &running, authority, identity: None };
    let kept = caller(&old).client();
    let url = caller(&old).url("/docs");
    assert_eq!(kept.get(&url).send().await.unwrap().status(), 200);
    files.put(&leaf(&new, "server"));
    assert!(caller(&new).is_let_in().await && caller(&new).call().await.is_ok());
    assert!(!caller(&old).is_let_in().await);
    // who is connected stays so
    assert_eq!(kept.get(&url).send().await.unwrap().status(), 200);
}

#[tokio::test]
async fn a_replacement_that_cannot_be_used_leaves_the_old_certificate() {
    let authority = authority("ours");
    let (server, other) = (leaf(&authority, "server"), leaf(&authority, "other"));
    let files = Files::new(&server, Some(&authority));
    let running = files.start(&[]).await;
    let ours = leaf(&authority, "a");
    let caller = Caller { running: &running, authority: &authority, identity: Some(&ours) };
    // the key is not the certificate's, there is no certificate, there is no file
    fs::write(files.path("key.pem"), &other.1).unwrap();
    assert!(caller.is_let_in().await);
    fs::write(files.path("cert.pem"), "half").unwrap();
    assert!(caller.is_let_in().await);
    fs::remove_file(files.path("cert.pem")).unwrap();
    assert!(caller.is_let_in().await);
    fs::write(files.path("ca.pem"), "").unwrap();
    assert!(caller.is_let_in().await);
    assert!(!Caller { identity: None, ..caller }.is_let_in().await);
}

#[tokio::test]
async fn a_changed_authority_lets_its_clients_in_and_the_old_ones_no_more() {
    let [ours, next] = ["ours", "next"].map(authority);
    let files = Files::new(&leaf(&ours, "server"), Some(&ours));
    let running = files.start(&[]).await;
    let (before, after) = (leaf(&ours, "a"), leaf(&next, "a"));
    let caller =
        |identity| Caller { running: &running, authority: &ours, identity: Some(identity) };
    assert!(caller(&before).is_let_in().await && !caller(&after).is_let_in().await);
    // as long as both are there both are let in
    fs::write(files.path("ca.pem"), format!("{}{}", ours.pem(), next.pem())).unwrap();
    assert!(caller(&before).is_let_in().await && caller(&after).is_let_in().await);
    fs::write(files.path("ca.pem"), next.pem()).unwrap();
    assert!(!caller(&before).is_let_in().await && caller(&after).is_let_in().await);
    assert_eq!(caller(&after).call().await, Ok(()));
}

#[test]
fn a_handshake_that_fails_is_told_in_the_log_and_a_flood_of_them_is_counted() {
    const CALLS: usize = 200;
    let authority = authority("ours");
    let files = Files::new(&leaf(&authority, "server"), None);
    let flags = files.flags();
    let flags: Vec<_> = flags.iter().map(String::as_str).chain(["--log=warn"]).collect();
    let process = Process::start(&flags);
    let address = process.http.trim_start_matches("https://").to_owned();
    let begin = std::time::Instant::now();
    let fail = |_| {
        let mut stream = TcpStream::connect(&address).unwrap();
        stream.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
        // until it is closed
        let _ = stream.read_to_end(&mut Vec::new());
        stream.local_addr().unwrap().to_string()
    };
    let peers: Vec<_> = (0..CALLS).map(fail).collect();
    let log = process.stop_and_read();
    // the service tells of a connection after its caller sees it closed
    let lines = 1 + usize::try_from(begin.elapsed().as_secs()).unwrap();
    let told: Vec<_> = log.lines().filter(|line| line.contains("a TLS handshake failed")).collect();
    assert!((1..=lines).contains(&told.len()), "{log}");
    let peer = |line: &&str| peers.iter().any(|peer| line.contains(peer));
    assert!(told.iter().all(peer), "{log}");
}

#[tokio::test]
async fn failed_handshakes_are_counted() {
    let authority = authority("ours");
    let files = Files::new(&leaf(&authority, "server"), Some(&authority));
    let running = files.start(&[]).await;
    let caller = Caller { running: &running, authority: &authority, identity: None };
    assert!(!caller.is_let_in().await);
    let url = running.admin_url("/metrics");
    // the service may see its end later than the caller
    while !reqwest::get(&url)
        .await
        .unwrap()
        .text()
        .await
        .unwrap()
        .contains("conicoid_tls_handshakes_failed_total")
    {
        tokio::task::yield_now().await;
    }
}

use std::{
    fs,
    io::{Read, Write},
    net::{SocketAddr, TcpStream},
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use bytes::Bytes;
use reqwest::{Certificate, Client};
use tokio_rustls::rustls::{ClientConfig, ClientConnection, RootCertStore, crypto::ring};

use super::{
    block_on,
    cloud::bracket,
    missed,
    server::Server,
    wire::{self, frame, preface, request},
};

/// Sockets of each kind, as many as the service has connections.
const SOCKETS: usize = 1000;
/// How long each kind is held. What the service ends is opened anew.
const HELD: Duration = Duration::from_secs(8);
const POINTS: usize = 300;
/// Longest an honest caller may wait, in seconds.
const MOST: f64 = 2.0;
const BYTES_IN_FLIGHT: usize = 64 << 20;
/// What a connection may take beside the bytes in flight, in MiB.
const A_CONNECTION: f64 = 0.13;

/// One kind of strangers: its name, the listener, what is said, and whether TLS is spoken before.
struct Kind {
    name: &'static str,
    grpc: bool,
    tls: Option<bool>,
    said: Vec<u8>,
}

fn kinds() -> Vec<Kind> {
    let settings = [wire::PREFACE, &frame(wire::SETTINGS, 0, 0, b"")].concat();
    let post = "POST /v1/segmentations HTTP/1.1\r\nHost: a\r\n";
    let chunked = format!("{post}Transfer-Encoding: chunked\r\n\r\n1\r\n1\r\n");
    let announced = format!("{post}Content-Length: 60000000\r\n\r\n1");
    let form = format!(
        "{post}Content-Type: multipart/form-data; boundary=X\r\nContent-Length: 60000\r\n\r\n--X\r\nA: b"
    );
    let unread = "GET /docs HTTP/1.1\r\nHost: a\r\n\r\n".repeat(200);
    let streams = |path: &str| {
        let mut said = preface(0);
        (0..32).for_each(|i| said.extend(request(2 * i + 1, "GET", path, &[])));
        said
    };
    let mut call = request(
        1,
        "POST",
        "/conicoid.v1.Segmentations/Segment",
        &[("content-type", "application/grpc"), ("te", "trailers")],
    );
    call[4] = 4; // a message follows, of 63 MB and never whole
    let message = [&[0][..], &(63_u32 << 20).to_be_bytes(), &[0; 1000]].concat();
    let call = [preface(65535), call, frame(0, 0, 1, &message)].concat();
    let kind = |name, said: &[u8]| Kind { name, grpc: false, tls: None, said: said.to_vec() };
    let over = |name, tls, said: &[u8]| Kind { tls: Some(tls), ..kind(name, said) };
    let mut kinds = vec![
        kind("nothing", b""),
        kind("one letter", b"P"),
        kind("half a request line", b"GET /do"),
        kind("half a head", b"GET /docs HTTP/1.1\r\nHost: a\r\n"),
        kind("half the preface", b"PRI * HTTP/2.0\r\n"),
        kind("preface alone", wire::PREFACE),
        kind("settings, then silence", &settings),
        kind("a chunk, then silence", chunked.as_bytes()),
        kind("60 MB announced", announced.as_bytes()),
        kind("half a form", form.as_bytes()),
        kind("200 answers not read", unread.as_bytes()),
        kind("32 pages, no window", &streams("/openapi.json")),
        kind("32 errors, no window", &streams("/v1/jobs/x")),
        over("half a TLS hello", false, b"\x16\x03\x01\x02\0\x01\0\x01\xfc\x03\x03"),
        over("TLS, then silence", true, b""),
    ];
    let grpc = [
        ("gRPC: nothing", b"".as_slice()),
        ("gRPC: settings alone", &settings),
        ("gRPC: 63 MB announced", &call),
    ];
    kinds.extend(grpc.map(|(name, said)| Kind { grpc: true, ..kind(name, said) }));
    kinds
}

/// A certificate of the service's own, and clients that trust it.
struct Authority {
    directory: tempfile::TempDir,
    client: Arc<ClientConfig>,
}

impl Authority {
    fn new() -> Self {
        let names = vec!["localhost".to_owned(), "127.0.0.1".to_owned()];
        let made = rcgen::generate_simple_self_signed(names).unwrap();
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join("cert"), made.cert.pem()).unwrap();
        fs::write(directory.path().join("key"), made.signing_key.serialize_pem()).unwrap();
        let mut roots = RootCertStore::empty();
        roots.add(made.cert.der().clone()).unwrap();
        let client = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_safe_default_protocol_versions()
            .unwrap()
            .with_root_certificates(roots)
            .with_no_client_auth();
        Self { directory, client: Arc::new(client) }
    }

    fn path(&self, name: &str) -> String {
        self.directory.path().join(name).display().to_string()
    }
}

pub fn run() -> Vec<String> {
    raise_handles();
    let authority = Authority::new();
    println!(
        "{SOCKETS} sockets of each kind for {} s, beside an honest caller",
        HELD.as_secs_f64()
    );
    println!("kind                     answers  slowest s  MiB above rest  opened");
    let mut slowest = 0.0_f64;
    let mut most = 0.0_f64;
    for kind in kinds() {
        let (answers, worst, memory, opened) = beside(&kind, &authority);
        println!("{:<24} {answers:>7} {worst:>10.3} {memory:>15.1} {opened:>7}", kind.name);
        (slowest, most) = (slowest.max(worst), most.max(memory));
    }
    let bound = (BYTES_IN_FLIGHT >> 20) as f64 + SOCKETS as f64 * A_CONNECTION;
    missed([
        (format!("an honest caller waited {slowest:.1} s, wanted {MOST}"), slowest <= MOST),
        (format!("{most:.0} MiB above rest, wanted {bound:.0}"), most <= bound),
    ])
}

/// Holds the sockets of one kind beside an honest caller: the answers, the slowest of them in seconds, the
/// most memory above that at rest in MiB, and how many sockets it took.
fn beside(kind: &Kind, authority: &Authority) -> (usize, f64, f64, usize) {
    let budget = format!("--max-bytes-in-flight={BYTES_IN_FLIGHT}");
    let cert = format!("--tls-cert={}", authority.path("cert"));
    let key = format!("--tls-key={}", authority.path("key"));
    let mut flags = vec![budget.as_str()];
    if kind.tls.is_some() {
        flags.extend([cert.as_str(), key.as_str()]);
    }
    let server = Server::start(&flags);
    let client = honest(&authority.directory.path().join("cert"));
    let (url, cloud) = (server.segmentations(), bracket(POINTS));
    for _ in 0..20 {
        block_on(ask(&client, &url, &cloud));
    }
    let rest = server.memory();
    server.forget_peak();
    let stop = Arc::new(AtomicBool::new(false));
    let asking = std::thread::spawn({
        let stop = Arc::clone(&stop);
        move || {
            block_on(async {
                let mut times = Vec::new();
                while !stop.load(Ordering::Relaxed) {
                    times.push(ask(&client, &url, &cloud).await);
                }
                times
            })
        }
    });
    let opened = hold(kind, &server, authority);
    stop.store(true, Ordering::Relaxed);
    let times = asking.join().unwrap();
    let worst = times.iter().copied().fold(0.0, f64::max);
    (times.len(), worst, server.peak_memory() - rest, opened)
}

/// A caller that opens a connection for each request.
fn honest(certificate: &Path) -> Client {
    let certificate = Certificate::from_pem(&fs::read(certificate).unwrap()).unwrap();
    let client = Client::builder().pool_max_idle_per_host(0).add_root_certificate(certificate);
    client.timeout(Duration::from_secs(20)).build().unwrap()
}

/// Seconds until a cloud is answered; the time it was waited for in vain where it is not.
async fn ask(client: &Client, url: &str, cloud: &Bytes) -> f64 {
    let begin = Instant::now();
    let answer = client.post(url).body(cloud.clone()).send().await;
    let good = match answer {
        Ok(answer) => answer.status() == 200 && answer.bytes().await.is_ok(),
        Err(_) => false,
    };
    if good { begin.elapsed().as_secs_f64() } else { f64::INFINITY }
}

/// Keeps the sockets open and opens those anew that the service ends; how many it took.
fn hold(kind: &Kind, server: &Server, authority: &Authority) -> usize {
    let url = if kind.grpc { &server.grpc } else { &server.http };
    let address: SocketAddr = url.rsplit('/').next().unwrap().parse().unwrap();
    let begin = Instant::now();
    let (mut held, mut opened) = (Vec::new(), 0);
    while begin.elapsed() < HELD {
        held.retain_mut(is_open);
        while held.len() < SOCKETS && begin.elapsed() < HELD {
            held.extend(open(kind, address, authority));
            opened += 1;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    opened
}

/// One stranger; none where the service hung up at once.
fn open(kind: &Kind, address: SocketAddr, authority: &Authority) -> Option<TcpStream> {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    stream.set_write_timeout(Some(Duration::from_millis(200))).unwrap();
    if kind.tls == Some(true) {
        let name = "localhost".try_into().unwrap();
        let mut tls = ClientConnection::new(Arc::clone(&authority.client), name).unwrap();
        while tls.is_handshaking() {
            tls.complete_io(&mut stream).ok()?;
        }
    }
    // those that nobody reads may not take it all
    let _ = stream.write_all(&kind.said);
    stream.set_nonblocking(true).unwrap();
    Some(stream)
}

/// Whether the service has not ended it. Nothing but the first bytes of what comes are read.
fn is_open(stream: &mut TcpStream) -> bool {
    match stream.read(&mut [0; 1]) {
        Ok(read) => read > 0,
        Err(error) => error.kind() == std::io::ErrorKind::WouldBlock,
    }
}

/// Sockets are file handles, of which a shell often allows 1024.
fn raise_handles() {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let maximum = getrlimit(Resource::Nofile).maximum;
    setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum }).unwrap();
}

//! NATS servers with JetStream on free ports, for tests; ended when dropped.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use tempfile::TempDir;

/// A server, or one of a cluster.
pub struct NatsServer {
    child: Option<Child>,
    directory: TempDir,
    port: u16,
    more: Vec<String>,
}

/// Ports that were free a moment ago.
fn free_ports<const N: usize>() -> [u16; N] {
    let listeners: Vec<_> =
        (0..N).map(|_| std::net::TcpListener::bind("127.0.0.1:0").unwrap()).collect();
    std::array::from_fn(|i| listeners[i].local_addr().unwrap().port())
}

impl NatsServer {
    /// Starts a server and waits until it answers.
    pub fn start() -> Self {
        Self::start_with(Vec::new())
    }

    /// The same with further flags.
    pub fn start_with(more: Vec<String>) -> Self {
        let ([port], directory) = (free_ports(), tempfile::tempdir().unwrap());
        let mut server = Self { child: None, directory, port, more };
        server.run();
        server
    }

    /// Starts three servers that keep copies of each other's streams.
    pub fn cluster() -> [Self; 3] {
        let ports: [u16; 6] = free_ports();
        let routes: Vec<_> =
            ports[3..].iter().map(|port| format!("nats://127.0.0.1:{port}")).collect();
        let mut servers = std::array::from_fn(|i| {
            let more = [
                "--cluster_name=c".to_owned(),
                format!("--name=n{i}"),
                format!("--cluster=nats://127.0.0.1:{}", ports[3 + i]),
                format!("--routes={}", routes.join(",")),
            ];
            let directory = tempfile::tempdir().unwrap();
            Self { child: None, directory, port: ports[i], more: more.to_vec() }
        });
        servers.iter_mut().for_each(Self::run);
        servers
    }

    /// Its address.
    pub fn url(&self) -> String {
        format!("nats://127.0.0.1:{}", self.port)
    }

    /// Its address with another scheme, with who calls, or with a name for its host.
    pub fn address(&self, before: &str) -> String {
        format!("{before}:{}", self.port)
    }

    /// What it keeps its streams in.
    fn store(&self) -> PathBuf {
        self.directory.path().join("store")
    }

    /// Starts it, again after [`Self::end`], and waits until it answers.
    pub fn run(&mut self) {
        let log = fs::File::create(self.directory.path().join("log")).unwrap();
        let child = Command::new(program())
            .args(["-js", "-a", "127.0.0.1", "-p", &self.port.to_string(), "-sd"])
            .arg(self.store())
            .args(&self.more)
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()
            .expect("nats-server runs: tests/run installs it");
        self.child = Some(child);
        let begin = Instant::now();
        while std::net::TcpStream::connect(("127.0.0.1", self.port)).is_err() {
            assert!(begin.elapsed() < Duration::from_secs(30), "{}", self.log());
            thread::sleep(Duration::from_millis(10));
        }
    }

    /// Ends it as a crash does.
    pub fn end(&mut self) {
        if let Some(mut child) = self.child.take() {
            // it may have ended by itself
            let _ = child.kill();
            let _ = child.wait();
        }
    }

    /// What it has logged.
    pub fn log(&self) -> String {
        fs::read_to_string(self.directory.path().join("log")).unwrap_or_default()
    }
}

impl Drop for NatsServer {
    fn drop(&mut self) {
        self.end();
    }
}

/// Debian puts it where only the administrator's path leads.
fn program() -> &'static str {
    let known = ["/usr/sbin/nats-server", "/usr/local/bin/nats-server"];
    known.into_iter().find(|path| Path::new(path).exists()).unwrap_or("nats-server")
}

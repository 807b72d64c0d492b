use std::{net::SocketAddr, num::NonZeroUsize, path::PathBuf, time::Duration};

use async_nats::ServerAddr;
use axum::http::{HeaderValue, Uri};

use clap::{ArgAction, Args, ValueEnum};

use crate::{
    grpc::GrpcConfig,
    http::{HttpConfig, Patience},
    jobs::{BookConfig, KeyShare, NatsConfig, NatsStorage, PoolConfig},
    service::ServiceConfig,
};

/// Every setting of the service; what stands here is its reference.
#[derive(Clone, Debug, Args)]
pub struct Settings {
    /// File with settings, in TOML: the names below with underscores; flags and environment win
    #[arg(long, env = "CONICOID_CONFIG", value_name = "FILE")]
    pub config: Option<String>,

    /// Address of the HTTP interface; port 0 takes any free one
    #[arg(long, env = "CONICOID_HTTP", default_value = "127.0.0.1:8080", value_name = "ADDR")]
    pub http: SocketAddr,
    /// Address of the gRPC interface
    #[arg(long, env = "CONICOID_GRPC", default_value = "127.0.0.1:50051", value_name = "ADDR")]
    pub grpc: SocketAddr,
    /// Address of the operators' listener (/livez, /readyz, /metrics); always plain text
    #[arg(long, env = "CONICOID_ADMIN", default_value = "127.0.0.1:9090", value_name = "ADDR")]
    pub admin: SocketAddr,

    /// File of the API keys, one 'NAME SHA256' a line ('conicoid key' makes them); read again when it
    /// changes. Without it nobody is asked for a key
    #[arg(long, env = "CONICOID_KEYS", value_name = "FILE")]
    pub keys: Option<PathBuf>,
    /// Listen beyond this machine although neither keys nor client certificates are asked for
    #[arg(
        long,
        env = "CONICOID_ALLOW_ANONYMOUS",
        default_value = "false",
        num_args = 0..=1,
        default_missing_value = "true",
        value_name = "BOOL",
        action = ArgAction::Set
    )]
    pub allow_anonymous: bool,
    /// Certificate chain of the HTTP and gRPC listeners, in PEM, read again when it changes; plain text
    /// when absent
    #[arg(long, env = "CONICOID_TLS_CERT", value_name = "FILE")]
    pub tls_cert: Option<PathBuf>,
    /// Private key of the certificate, in PEM, read again when it changes
    #[arg(long, env = "CONICOID_TLS_KEY", value_name = "FILE")]
    pub tls_key: Option<PathBuf>,
    /// Authority that client certificates must come from, in PEM, read again when it changes; none are
    /// asked for when absent. Without keys the subject of a certificate says whose a job is
    #[arg(long, env = "CONICOID_CLIENT_CA", value_name = "FILE")]
    pub client_ca: Option<PathBuf>,
    /// Origins whose web pages may call, such as https://viewer.example, separated by commas; none when
    /// absent
    #[arg(
        long,
        env = "CONICOID_CORS_ORIGINS",
        value_name = "ORIGINS",
        value_delimiter = ',',
        value_parser = origin
    )]
    pub cors_origins: Vec<HeaderValue>,

    /// Directory where jobs and their results outlive the process; in memory when absent
    #[arg(long, env = "CONICOID_DATA_DIR", value_name = "DIR")]
    pub data_dir: Option<PathBuf>,
    /// Bytes of the file in the data directory that are kept in memory
    #[arg(long, env = "CONICOID_DATA_CACHE_BYTES", default_value_t = 64 << 20, value_name = "BYTES")]
    pub data_cache_bytes: usize,
    /// NATS servers with JetStream over which processes share their jobs, such as nats://a:4222,nats://b:4222 or
    /// tls://USER:PASSWORD@a:4222; each process has its own jobs when absent
    #[arg(
        long,
        env = "CONICOID_NATS",
        hide_env_values = true,
        value_name = "URLS",
        value_delimiter = ',',
        value_parser = nats_server
    )]
    pub nats: Vec<ServerAddr>,
    /// Run shared jobs as well as taking them in; the command 'worker' only runs them
    #[arg(
        long,
        env = "CONICOID_WORK",
        default_value = "false",
        num_args = 0..=1,
        default_missing_value = "true",
        value_name = "BOOL",
        action = ArgAction::Set
    )]
    pub work: bool,
    /// File with the JWT and the key that NATS asks for (.creds)
    #[arg(long, env = "CONICOID_NATS_CREDENTIALS", value_name = "FILE")]
    pub nats_credentials: Option<PathBuf>,
    /// Authority of the NATS servers' certificates, in PEM, which are asked for then; the system's when absent
    #[arg(long, env = "CONICOID_NATS_CA", value_name = "FILE")]
    pub nats_ca: Option<PathBuf>,
    /// Certificate that is shown to the NATS servers, in PEM
    #[arg(long, env = "CONICOID_NATS_CERT", value_name = "FILE", requires = "nats_key")]
    pub nats_cert: Option<PathBuf>,
    /// Private key of that certificate, in PEM
    #[arg(long, env = "CONICOID_NATS_KEY", value_name = "FILE", requires = "nats_cert")]
    pub nats_key: Option<PathBuf>,
    /// What the names of streams, buckets and subjects begin with; processes with the same one share their jobs
    #[arg(
        long,
        env = "CONICOID_NATS_PREFIX",
        default_value = "conicoid",
        value_name = "NAME",
        value_parser = nats_prefix
    )]
    pub nats_prefix: String,
    /// NATS servers that keep a copy of each job: 1, 3 or 5
    #[arg(
        long,
        env = "CONICOID_NATS_REPLICAS",
        default_value = "1",
        value_name = "N",
        value_parser = nats_replicas
    )]
    pub nats_replicas: usize,
    /// Where the NATS servers keep the jobs
    #[arg(long, env = "CONICOID_NATS_STORAGE", default_value = "file", value_name = "PLACE")]
    pub nats_storage: NatsPlace,
    /// Most bytes of clouds and results on NATS; new jobs are refused before that
    #[arg(
        long,
        env = "CONICOID_NATS_BYTES",
        default_value = "4294967296",
        value_name = "BYTES",
        value_parser = clap::value_parser!(u64).range(1 << 20..=1 << 50)
    )]
    pub nats_bytes: u64,
    /// Longest time that anything is kept on NATS, whatever has become of it; a job that waits longer is lost
    #[arg(
        long,
        env = "CONICOID_NATS_MAX_AGE",
        default_value = "86400",
        value_name = "SECONDS",
        value_parser = seconds
    )]
    pub nats_max_age: Duration,
    /// A job whose worker says nothing for so long is given to another worker
    #[arg(
        long,
        env = "CONICOID_NATS_ACK_WAIT",
        default_value = "10",
        value_name = "SECONDS",
        value_parser = seconds
    )]
    pub nats_ack_wait: Duration,
    /// Clouds of more points are cut into parts of so many, which all that work share; 0 cuts none
    #[arg(long, env = "CONICOID_TILE_POINTS", default_value_t = 10_000_000, value_name = "N")]
    pub tile_points: usize,
    /// A job on which so many processes ended suddenly is failed instead of run again
    #[arg(
        long,
        env = "CONICOID_MAX_CRASHES",
        default_value_t = 3,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..)
    )]
    pub max_crashes: u32,
    /// Time after which an ended job and its result are forgotten
    #[arg(
        long,
        env = "CONICOID_RESULT_TTL",
        default_value = "3600",
        value_name = "SECONDS",
        value_parser = seconds
    )]
    pub result_ttl: Duration,
    /// Bytes of ended jobs that are kept, with all they hold; above it the oldest of the key that keeps
    /// most are forgotten
    #[arg(
        long,
        env = "CONICOID_RESULT_BYTES",
        default_value_t = 1 << 30,
        value_name = "BYTES"
    )]
    pub result_bytes: u64,

    /// Threads that segment; one a processor when absent
    #[arg(long, env = "CONICOID_THREADS", value_name = "N", value_parser = number_above_zero)]
    pub threads: Option<NonZeroUsize>,
    /// Requests and jobs that may wait for their turn
    #[arg(
        long,
        env = "CONICOID_QUEUE",
        default_value = "64",
        value_name = "N",
        value_parser = number_above_zero
    )]
    pub queue: NonZeroUsize,
    /// Clouds of up to this many points run side by side, larger ones one by one on all threads
    #[arg(long, env = "CONICOID_SMALL_POINTS", default_value_t = 200_000, value_name = "N")]
    pub small_points: u64,

    /// Connections of callers that are served at one time, over both interfaces, as far as file handles
    /// go; above it the one that has kept the service waiting longest makes room
    #[arg(
        long,
        env = "CONICOID_MAX_CONNECTIONS",
        default_value = "1000",
        value_name = "N",
        value_parser = number_above_zero
    )]
    pub max_connections: NonZeroUsize,
    /// Longest time for the first whole head of a request on a new connection
    #[arg(
        long,
        env = "CONICOID_HEAD_TIMEOUT",
        default_value = "20",
        value_name = "SECONDS",
        value_parser = seconds
    )]
    pub head_timeout: Duration,
    /// Longest time a connection may have no request under way, or a body may stand still; pings count
    /// for nothing
    #[arg(
        long,
        env = "CONICOID_IDLE_TIMEOUT",
        default_value = "90",
        value_name = "SECONDS",
        value_parser = seconds
    )]
    pub idle_timeout: Duration,
    /// Longest time nothing of an answer may be taken
    #[arg(
        long,
        env = "CONICOID_WRITE_TIMEOUT",
        default_value = "30",
        value_name = "SECONDS",
        value_parser = seconds
    )]
    pub write_timeout: Duration,
    /// Longest body of a request, after decompression
    #[arg(
        long,
        env = "CONICOID_MAX_BODY_BYTES",
        default_value_t = 512 << 20,
        value_name = "BYTES",
        value_parser = bytes_above_zero
    )]
    pub max_body_bytes: u64,
    /// Bytes of clouds, as they are sent and 24 more a point, and of answers on their way, held at one
    /// time, over all requests
    #[arg(
        long,
        env = "CONICOID_MAX_BYTES_IN_FLIGHT",
        default_value_t = 2 << 30,
        value_name = "BYTES",
        value_parser = bytes_above_zero
    )]
    pub max_bytes_in_flight: u64,
    /// Part of queue, max_bytes_in_flight and result_bytes that one key may take, above 0 and up to 1;
    /// callers without a key have no part of their own
    #[arg(
        long,
        env = "CONICOID_KEY_SHARE",
        default_value = "0.5",
        value_name = "SHARE",
        value_parser = share_above_zero
    )]
    pub key_share: f64,
    /// Longest gRPC message; larger clouds are sent in chunks
    #[arg(
        long,
        env = "CONICOID_MAX_MESSAGE_BYTES",
        default_value_t = 64 << 20,
        value_name = "BYTES",
        value_parser = size_above_zero
    )]
    pub max_message_bytes: usize,
    /// Most points of one cloud
    #[arg(
        long,
        env = "CONICOID_MAX_POINTS",
        default_value = "50000000",
        value_name = "N",
        value_parser = size_above_zero
    )]
    pub max_points: usize,
    /// Longest time one segmentation may take, whatever its request says
    #[arg(
        long,
        env = "CONICOID_MAX_DEADLINE",
        default_value = "300",
        value_name = "SECONDS",
        value_parser = seconds
    )]
    pub max_deadline: Duration,
    /// Longest time an upload may take
    #[arg(
        long,
        env = "CONICOID_UPLOAD_TIMEOUT",
        default_value = "120",
        value_name = "SECONDS",
        value_parser = seconds
    )]
    pub upload_timeout: Duration,
    /// Longest time requests under way get to end when the service is told to stop
    #[arg(
        long,
        env = "CONICOID_DRAIN_DEADLINE",
        default_value = "30",
        value_name = "SECONDS",
        value_parser = seconds
    )]
    pub drain_deadline: Duration,

    /// What is logged, by module and level
    #[arg(long, env = "CONICOID_LOG", default_value = "info", value_name = "FILTER")]
    pub log: String,
    /// Form of the log
    #[arg(long, env = "CONICOID_LOG_FORMAT", default_value = "text", value_name = "FORM")]
    pub log_format: LogFormat,
    /// Collector that traces are sent to by OTLP over gRPC, such as http://127.0.0.1:4317; no traces
    /// are made when absent
    #[arg(long, env = "CONICOID_OTLP_ENDPOINT", value_name = "URL", value_parser = endpoint)]
    pub otlp_endpoint: Option<String>,
    /// Share of the requests that are traced, 0 to 1; those whose caller traces them always are
    #[arg(
        long,
        env = "CONICOID_TRACE_SHARE",
        default_value = "1",
        value_name = "SHARE",
        value_parser = share
    )]
    pub trace_share: f64,
}

/// The form of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// Lines for people.
    Text,
    /// One JSON object a line.
    Json,
}

/// Where NATS servers keep what they hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum NatsPlace {
    /// On their disks.
    File,
    /// In their memory, for jobs that may be lost with a server.
    Memory,
}

fn nats_server(text: &str) -> Result<ServerAddr, String> {
    let known =
        text.is_empty() || ["nats://", "tls://"].iter().any(|scheme| text.starts_with(scheme));
    let server = text.parse::<ServerAddr>().ok().filter(|_| known || !text.contains("://"));
    server
        .ok_or_else(|| "not the address of a NATS server, such as nats://127.0.0.1:4222".to_owned())
}

/// A token of a subject, and a part of a stream's name.
fn nats_prefix(text: &str) -> Result<String, String> {
    let known = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let good = (1..=32).contains(&text.len()) && text.chars().all(known);
    if good {
        Ok(text.to_owned())
    } else {
        Err("not 1 to 32 of the characters A-Z a-z 0-9 - _".to_owned())
    }
}

fn nats_replicas(text: &str) -> Result<usize, String> {
    let replicas = text.parse().ok().filter(|n| [1, 3, 5].contains(n));
    replicas.ok_or_else(|| "not 1, 3 or 5".to_owned())
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse::<f64>().ok().filter(|s| *s > 0.0 && *s <= 1e9);
    seconds.map(Duration::from_secs_f64).ok_or_else(|| "not a number of seconds above 0".to_owned())
}

fn share(text: &str) -> Result<f64, String> {
    let share = text.parse::<f64>().ok().filter(|share| (0.0..=1.0).contains(share));
    share.ok_or_else(|| "not a number from 0 to 1".to_owned())
}

fn share_above_zero(text: &str) -> Result<f64, String> {
    let share = text.parse::<f64>().ok().filter(|share| *share > 0.0 && *share <= 1.0);
    share.ok_or_else(|| "not a number above 0 and up to 1".to_owned())
}

/// A count of which there must be one at least.
pub fn number_above_zero(text: &str) -> Result<NonZeroUsize, String> {
    text.parse().map_err(|_| "not a whole number above 0".to_owned())
}

/// A limit: nothing is within one of zero.
pub fn size_above_zero(text: &str) -> Result<usize, String> {
    number_above_zero(text).map(NonZeroUsize::get)
}

fn bytes_above_zero(text: &str) -> Result<u64, String> {
    let bytes = text.parse().ok().filter(|bytes| *bytes > 0);
    bytes.ok_or_else(|| "not a whole number above 0".to_owned())
}

/// `http` or `https`, and a host; with a path where there is one.
fn is_web(uri: &Uri) -> bool {
    matches!(uri.scheme_str(), Some("http" | "https")) && uri.host().is_some_and(|h| !h.is_empty())
}

/// An origin as browsers send it: one that is written in another way would never match.
fn origin(text: &str) -> Result<HeaderValue, String> {
    let uri = text.parse::<Uri>().ok().filter(|uri| {
        let host = uri.authority().map(|a| a.as_str()).unwrap_or_default();
        is_web(uri) && text == format!("{}://{host}", uri.scheme_str().unwrap_or_default())
    });
    let value = uri.and_then(|_| HeaderValue::from_str(text).ok());
    value.ok_or_else(|| "not an origin, such as https://viewer.example".to_owned())
}

fn endpoint(text: &str) -> Result<String, String> {
    let uri = text.parse::<Uri>().ok().filter(is_web);
    uri.map(|_| text.to_owned())
        .ok_or_else(|| "not a URL, such as http://127.0.0.1:4317".to_owned())
}

impl Settings {
    /// The settings of the use cases.
    pub fn service(&self) -> ServiceConfig {
        let threads = self.threads.or_else(|| std::thread::available_parallelism().ok());
        ServiceConfig {
            pool: PoolConfig {
                threads: threads.map_or(1, NonZeroUsize::get),
                queue: self.queue.get(),
                small_points: self.small_points,
            },
            max_body_bytes: self.max_body_bytes,
            max_bytes_in_flight: self.max_bytes_in_flight,
            max_points: self.max_points,
            max_deadline: self.max_deadline,
            book: BookConfig {
                result_ttl: self.result_ttl,
                result_bytes: self.result_bytes,
                key_share: KeyShare(self.key_share),
                max_crashes: self.max_crashes,
            },
            nats: self.nats_config(),
            work: self.work,
            tile_points: self.tile_points,
            key_share: KeyShare(self.key_share),
            upload_timeout: self.upload_timeout,
            data_dir: self.data_dir.clone(),
            data_cache_bytes: self.data_cache_bytes,
        }
    }

    /// The settings of the jobs on NATS.
    fn nats_config(&self) -> Option<NatsConfig> {
        (!self.nats.is_empty()).then(|| NatsConfig {
            servers: self.nats.clone(),
            credentials: self.nats_credentials.clone(),
            ca: self.nats_ca.clone(),
            certificate: self.nats_cert.clone().zip(self.nats_key.clone()),
            prefix: self.nats_prefix.clone(),
            replicas: self.nats_replicas,
            storage: match self.nats_storage {
                NatsPlace::File => NatsStorage::File,
                NatsPlace::Memory => NatsStorage::Memory,
            },
            bytes: self.nats_bytes,
            max_age: self.nats_max_age,
            ack_wait: self.nats_ack_wait,
        })
    }

    /// The settings of the HTTP interface.
    pub fn http(&self) -> HttpConfig {
        HttpConfig { cors_origins: self.cors_origins.clone() }
    }

    /// How long callers are waited for.
    pub fn patience(&self) -> Patience {
        Patience { head: self.head_timeout, idle: self.idle_timeout, write: self.write_timeout }
    }

    /// The settings of the gRPC interface.
    pub fn grpc(&self) -> GrpcConfig {
        GrpcConfig { max_message_bytes: self.max_message_bytes }
    }
}

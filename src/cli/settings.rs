use std::{net::SocketAddr, num::NonZeroUsize, path::PathBuf, time::Duration};

use axum::http::{HeaderValue, Uri};

use clap::{ArgAction, Args, ValueEnum};

use crate::{
    grpc::GrpcConfig,
    http::{HttpConfig, Patience},
    jobs::{BookConfig, KeyShare, PoolConfig},
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
    #[arg(long, env = "CONICOID_MAX_BODY_BYTES", default_value_t = 512 << 20, value_name = "BYTES")]
    pub max_body_bytes: u64,
    /// Bytes of clouds, as they are sent and 24 more a point, and of answers on their way, held at one
    /// time, over all requests
    #[arg(
        long,
        env = "CONICOID_MAX_BYTES_IN_FLIGHT",
        default_value_t = 2 << 30,
        value_name = "BYTES"
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
        value_name = "BYTES"
    )]
    pub max_message_bytes: usize,
    /// Most points of one cloud
    #[arg(long, env = "CONICOID_MAX_POINTS", default_value = "50000000", value_name = "N")]
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
            },
            key_share: KeyShare(self.key_share),
            upload_timeout: self.upload_timeout,
            data_dir: self.data_dir.clone(),
            data_cache_bytes: self.data_cache_bytes,
        }
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

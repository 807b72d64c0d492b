//! The connection: which servers, how they are known, and how this process says who it is.

use std::{
    fs,
    path::PathBuf,
    time::{Duration, Instant},
};

use async_nats::{Client, ConnectError, ConnectErrorKind, ConnectOptions, ServerAddr};
use percent_encoding::percent_decode_str;

use super::{
    config::NatsConfig,
    streams::{LONGEST_START, NatsError, PAUSE},
    trouble::told,
};

/// Longest answer of a server that is waited for.
const ANSWER_TIME: Duration = Duration::from_secs(5);
/// Longest pause before servers that are away are tried again.
pub const LONGEST_PAUSE: Duration = Duration::from_secs(1);

/// What to do about a connection that is refused.
const NO_SERVER: &str = "see that a NATS server runs there and can be reached";
const NO_TLS: &str = "nats_ca must name the authority of the servers' certificates, the address a name that \
                      is in them, and nats_cert and nats_key what the servers ask for, if they do";
const NO_LOGIN: &str = "the servers ask who this process is: put a user and password or a token into the \
                        address, or name a file by nats_credentials, or a certificate by nats_cert";
const WRONG_LOGIN: &str =
    "the servers do not let in the user and password, or the token, of the address";
const WRONG_CREDENTIALS: &str = "the servers do not let in the user of nats_credentials: it may have expired, or \
                                 be of an account that they do not know";
const WRONG_CERTIFICATE: &str = "the servers do not let in the user that nats_cert stands for";

/// Who a process says that it is by the addresses of the servers.
#[derive(PartialEq, Eq)]
enum Login {
    Token(String),
    User(String, String),
}

impl Login {
    /// What stands in an address, where it is not of this form `%2F` for `/`.
    fn of(server: &ServerAddr) -> Option<Self> {
        let plain = |text: &str| percent_decode_str(text).decode_utf8_lossy().into_owned();
        let name = plain(server.username()?);
        Some(match server.password() {
            Some(password) => Self::User(name, plain(password)),
            None => Self::Token(name),
        })
    }
}

/// The address alone: the client does not read more of it, and shows all in its log.
fn without_login(server: &ServerAddr) -> ServerAddr {
    let mut url = server.clone().into_inner();
    // neither fails where there is a host
    let _ = (url.set_username(""), url.set_password(None));
    ServerAddr::from_url(url).unwrap_or_else(|_| server.clone())
}

/// The login of the addresses, of which the servers that they tell of get the same.
fn login(servers: &[ServerAddr]) -> Result<Option<Login>, NatsError> {
    let mut logins = servers.iter().filter_map(Login::of);
    let first = logins.next();
    match logins.any(|other| Some(other) != first) {
        true => Err(NatsError::TwoLogins("the addresses name different users")),
        false => Ok(first),
    }
}

/// The options of a connection.
async fn options(config: &NatsConfig) -> Result<ConnectOptions, NatsError> {
    let mut options = ConnectOptions::new()
        .name("conicoid")
        .request_timeout(Some(ANSWER_TIME))
        // a server that hangs is noticed after two of them
        .ping_interval(Duration::from_secs(5))
        .reconnect_delay_callback(pause)
        // a front end has more to say at one time than the default lets wait
        .subscription_capacity(1 << 16);
    let login = login(&config.servers)?;
    if login.is_some() && config.credentials.is_some() {
        return Err(NatsError::TwoLogins("nats_credentials and the address both name a user"));
    }
    options = match login {
        Some(Login::User(name, password)) => options.user_and_password(name, password),
        Some(Login::Token(token)) => options.token(token),
        None => options,
    };
    let failed = |setting, path: &PathBuf| {
        let path = path.display().to_string();
        move |error| NatsError::File { setting, path, error }
    };
    // what is told of them later does not name the file
    let readable = |setting, path| fs::read(path).map(drop).map_err(failed(setting, path));
    if let Some(path) = &config.credentials {
        readable("nats_credentials", path)?;
        let read = options.credentials_file(path).await;
        options = read.map_err(failed("nats_credentials", path))?;
    }
    if let Some(path) = &config.ca {
        readable("nats_ca", path)?;
        options = options.add_root_certificates(path.clone()).require_tls(true);
    }
    if let Some((certificate, key)) = &config.certificate {
        readable("nats_cert", certificate)?;
        readable("nats_key", key)?;
        let (certificate, key) = (certificate.clone(), key.clone());
        options = options.add_client_certificate(certificate, key).require_tls(true);
    }
    Ok(options)
}

/// The pause before the `attempt`-th try: none, 1, 2, 4 ms and so on.
fn pause(attempt: usize) -> Duration {
    // by then it is the longest one
    const LAST: usize = 12;
    let doubled = attempt.clamp(1, LAST) - 1;
    Duration::from_millis((1 << doubled) / 2).min(LONGEST_PAUSE)
}

/// Connects to one of the servers.
///
/// # Errors
/// None lets this process in, or a file cannot be read.
pub async fn connect(config: &NatsConfig) -> Result<Client, NatsError> {
    let begin = Instant::now();
    let servers: Vec<_> = config.servers.iter().map(without_login).collect();
    loop {
        match options(config).await?.connect(&servers).await {
            Ok(client) => return Ok(client),
            Err(error) => {
                let (advice, may_pass) = advice(&error, config);
                if !may_pass || begin.elapsed() > LONGEST_START {
                    let name = |server: &ServerAddr| format!("{}:{}", server.host(), server.port());
                    let servers: Vec<_> = servers.iter().map(name).collect();
                    let (servers, error) = (servers.join(", "), told(&error));
                    return Err(NatsError::Connect { servers, error, advice });
                }
                tokio::time::sleep(PAUSE).await;
            }
        }
    }
}

/// What to do about a failure, and whether it may pass by itself.
fn advice(error: &ConnectError, config: &NatsConfig) -> (&'static str, bool) {
    match error.kind() {
        ConnectErrorKind::Authentication | ConnectErrorKind::AuthorizationViolation => {
            let by_address = config.servers.iter().any(ServerAddr::has_user_pass);
            let advice = match (&config.credentials, &config.certificate) {
                (Some(_), _) => WRONG_CREDENTIALS,
                _ if by_address => WRONG_LOGIN,
                (None, Some(_)) => WRONG_CERTIFICATE,
                (None, None) => NO_LOGIN,
            };
            (advice, false)
        }
        ConnectErrorKind::Tls => (NO_TLS, false),
        _ if is_of_tls(error) => (NO_TLS, false),
        ConnectErrorKind::Io | ConnectErrorKind::TimedOut | ConnectErrorKind::Dns => {
            (NO_SERVER, true)
        }
        _ => (NO_SERVER, false),
    }
}

/// Whether a handshake has failed: the client tells that as any other failure to read, of data that are
/// not valid.
fn is_of_tls(error: &ConnectError) -> bool {
    let cause = std::error::Error::source(error);
    let cause = cause.and_then(|cause| cause.downcast_ref::<std::io::Error>());
    cause.is_some_and(|cause| cause.kind() == std::io::ErrorKind::InvalidData)
}

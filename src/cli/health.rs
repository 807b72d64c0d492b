use std::{
    io::{self, Read, Write},
    net::{SocketAddr, TcpStream},
    time::Duration,
};

use clap::Args;

use super::error::AnyError;

const TIMEOUT: Duration = Duration::from_secs(2);

/// Where the service's operators' listener is.
#[derive(Debug, Args)]
pub struct HealthArgs {
    /// Address of the operators' listener
    #[arg(long, env = "CONICOID_ADMIN", default_value = "127.0.0.1:9090", value_name = "ADDR")]
    admin: SocketAddr,
}

/// Asks `/readyz`; an error unless it answers 200. For container health checks.
pub fn run(args: &HealthArgs) -> Result<(), AnyError> {
    let mut address = args.admin;
    if address.ip().is_unspecified() {
        address.set_ip(std::net::Ipv4Addr::LOCALHOST.into());
    }
    let answer = ask(address).map_err(|error| {
        format!("no service answers at {address}: {error}; --admin names its operators' listener")
    })?;
    let head = answer.lines().next().unwrap_or_default();
    if head.contains(" 200 ") { Ok(()) } else { Err(format!("not ready: {head}").into()) }
}

fn ask(address: SocketAddr) -> io::Result<String> {
    let mut stream = TcpStream::connect_timeout(&address, TIMEOUT)?;
    stream.set_read_timeout(Some(TIMEOUT))?;
    write!(stream, "GET /readyz HTTP/1.1\r\nHost: conicoid\r\nConnection: close\r\n\r\n")?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    Ok(answer)
}

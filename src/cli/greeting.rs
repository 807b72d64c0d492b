//! What somebody is told who starts the service on a terminal.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

use crate::service::Representation;

/// What this is, where its page is, how one file is segmented and how it stops. `scheme` is that of the HTTP
/// interface at `http`.
pub fn greeting(scheme: &str, http: SocketAddr) -> String {
    let page = format!("{scheme}://{}", reachable(http));
    let endings = Representation::ALL.iter().map(|form| form.extension());
    let endings: Vec<_> = endings.filter(|ending| !ending.contains('.')).collect();
    format!(
        "\nconicoid {} finds planes, cylinders, cones, spheres, ellipsoids and tori in 3D point clouds.\n\n  \
         Page       {page}/  (drop a cloud on it)\n  \
         Reference  {page}/docs\n  \
         One file   conicoid part.ply -o report.html  (or {}; 'conicoid segment --help' tells more)\n  \
         Stop       Ctrl+C\n\n",
        env!("CARGO_PKG_VERSION"),
        endings.join(", ")
    )
}

/// The address by which this machine reaches a listener.
fn reachable(mut address: SocketAddr) -> SocketAddr {
    match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => address.set_ip(Ipv4Addr::LOCALHOST.into()),
        IpAddr::V6(ip) if ip.is_unspecified() => address.set_ip(Ipv6Addr::LOCALHOST.into()),
        _ => {}
    }
    address
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_named_by_an_address_that_can_be_opened() {
        for (listener, page) in [
            ("127.0.0.1:8080", "https://127.0.0.1:8080/ "),
            ("0.0.0.0:80", "https://127.0.0.1:80/ "),
            ("[::]:81", "https://[::1]:81/ "),
            ("10.0.0.7:82", "https://10.0.0.7:82/ "),
        ] {
            let text = greeting("https", listener.parse().unwrap());
            assert!(text.contains(page) && text.contains("Ctrl+C"), "{text}");
        }
    }
}

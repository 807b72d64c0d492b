use std::{
    env::vars_os,
    ffi::{OsStr, OsString},
    net::IpAddr,
};

use clap::Command;

/// What the names of all variables begin with.
const PREFIX: &str = "CONICOID_";

/// A variable that looks like a setting and is none.
#[derive(Debug, thiserror::Error)]
#[error(
    "the environment variable {name} is no setting; the nearest is {nearest}. 'conicoid --help' and \
     'conicoid segment --help' list them"
)]
pub struct EnvironmentError {
    name: String,
    nearest: String,
}

/// Refuses variables of the environment that begin as the settings of `command` do and are none of them.
///
/// # Errors
/// There is one.
pub fn check(command: &Command) -> Result<(), EnvironmentError> {
    check_all(&known(command), vars_os())
}

/// The variables of all commands.
fn known(command: &Command) -> Vec<String> {
    let commands = std::iter::once(command).chain(command.get_subcommands());
    let arguments = commands.flat_map(Command::get_arguments);
    let names = arguments.filter_map(|argument| argument.get_env());
    names.map(|name| name.to_string_lossy().into_owned()).collect()
}

fn check_all(
    known: &[String],
    variables: impl Iterator<Item = (OsString, OsString)>,
) -> Result<(), EnvironmentError> {
    for (name, value) in variables {
        let name = name.to_string_lossy();
        let Some(rest) = name.strip_prefix(PREFIX) else { continue };
        if !known.iter().any(|known| *known == name) && !is_service_link(rest, &value) {
            let nearest = nearest(&name, known.iter().map(String::as_str));
            return Err(EnvironmentError { name: name.into_owned(), nearest: nearest.to_owned() });
        }
    }
    Ok(())
}

/// The one of `known` that is spelt most like `name`.
pub fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> &'a str {
    known.min_by_key(|known| strsim::osa_distance(name, known)).unwrap_or_default()
}

/// Whether this is a variable that Kubernetes sets for a Service named `conicoid` or `conicoid-...`: each
/// pod of its namespace gets those, unless its spec has `enableServiceLinks: false`. `rest` is the name
/// without the prefix, such as `SERVICE_HOST`, `GRPC_SERVICE_PORT` or `PORT_8080_TCP_ADDR`.
fn is_service_link(rest: &str, value: &OsStr) -> bool {
    let Some(value) = value.to_str() else { return false };
    let is_number = |text: &str| text.parse::<u16>().is_ok();
    let is_protocol = |text: &str| matches!(text, "TCP" | "UDP" | "SCTP" | "tcp" | "udp" | "sctp");
    let is_address = value.parse::<IpAddr>().is_ok();
    let is_url = value.split_once("://").is_some_and(|(scheme, _)| is_protocol(scheme));
    // the Service's name may go on before these
    let words: Vec<_> = rest.split('_').collect();
    match words[..] {
        [.., "SERVICE", "HOST"] => is_address,
        [.., "PORT", port, protocol, what] if is_number(port) && is_protocol(protocol) => {
            match what {
                "PROTO" => is_protocol(value),
                "PORT" => is_number(value),
                "ADDR" => is_address,
                _ => false,
            }
        }
        [.., "PORT", port, protocol] if is_number(port) && is_protocol(protocol) => is_url,
        // with the port's name behind it, where it has one
        _ if words.windows(2).any(|pair| pair == ["SERVICE", "PORT"]) => is_number(value),
        [.., "PORT"] => is_url,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(variables: &[(&str, &str)]) -> Result<(), String> {
        let known = ["CONICOID_QUEUE", "CONICOID_HTTP", "CONICOID_MIN_POINTS"].map(str::to_owned);
        let variables = variables.iter().map(|(name, value)| (name.into(), value.into()));
        check_all(&known, variables).map_err(|error| error.to_string())
    }

    #[test]
    fn a_misspelt_variable_is_refused_and_the_nearest_named() {
        for (name, nearest) in [
            ("CONICOID_QEUE", "CONICOID_QUEUE"),
            ("CONICOID_MINPOINTS", "CONICOID_MIN_POINTS"),
            ("CONICOID_htpp", "CONICOID_HTTP"),
            ("CONICOID_", "CONICOID_HTTP"),
        ] {
            let told = check(&[("PATH", "/"), (name, "1")]).unwrap_err();
            assert!(
                told.contains(name) && told.contains(&format!("nearest is {nearest}")),
                "{told}"
            );
        }
        assert_eq!(
            check(&[("CONICOID", "1"), ("CONICOID_QUEUE", ""), ("XCONICOID_A", "")]),
            Ok(())
        );
    }

    #[test]
    fn the_variables_of_a_service_in_the_cluster_are_let_pass() {
        // as the kubelet sets them for the Services `conicoid` and `conicoid-grpc`
        for name in ["CONICOID", "CONICOID_GRPC"] {
            for (end, value) in [
                ("SERVICE_HOST", "10.96.0.7"),
                ("SERVICE_HOST", "fd00::7"),
                ("SERVICE_PORT", "8080"),
                ("SERVICE_PORT_HTTP", "8080"),
                ("SERVICE_PORT_PLAIN_HTTP", "8080"),
                ("PORT", "tcp://10.96.0.7:8080"),
                ("PORT_8080_TCP", "tcp://10.96.0.7:8080"),
                ("PORT_8080_TCP_PROTO", "tcp"),
                ("PORT_8080_TCP_PORT", "8080"),
                ("PORT_8080_TCP_ADDR", "10.96.0.7"),
                ("PORT_53_UDP", "udp://10.96.0.7:53"),
            ] {
                assert_eq!(check(&[(&format!("{name}_{end}"), value)]), Ok(()));
            }
        }
        // what somebody may have meant as a setting is none of them
        for (name, value) in [
            ("CONICOID_PORT", "8080"),
            ("CONICOID_HTTP_PORT", "8080"),
            ("CONICOID_PORT_8080", "tcp://10.96.0.7:8080"),
            ("CONICOID_SERVICE_HOST", "conicoid.example"),
            ("CONICOID_SERVICE_PORT", "http"),
            ("CONICOID_SERVICE", "1"),
            ("CONICOID_PORT_8080_TCP_NAME", "x"),
        ] {
            assert!(check(&[(name, value)]).is_err(), "{name}={value}");
        }
    }
}

//! The command line: `serve`, `segment`, `openapi`, `key` and `health`.

mod environment;
mod error;
mod file;
mod handles;
mod health;
mod key;
mod logging;
mod measure;
mod memory;
mod output;
mod segment;
mod serve;
mod settings;
mod tls;
mod traces;

use std::{
    ffi::OsString,
    io::{self, Write},
    process::ExitCode,
};

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

pub use file::FileError;
pub use serve::{Addresses, ServeError, Server};
pub use settings::{LogFormat, Settings};
pub use tls::TlsError;

use error::AnyError;

/// Finds the quadric surfaces in 3D point clouds, as a service or for one file.
#[derive(Debug, Parser)]
#[command(
    name = "conicoid",
    version,
    args_conflicts_with_subcommands = true,
    args_override_self = true
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    settings: Settings,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Start the service (also the default without a command)
    Serve(Box<Settings>),
    /// Segment one file and write the result
    Segment(Box<segment::SegmentArgs>),
    /// Print the OpenAPI document of the HTTP interface
    Openapi,
    /// Make an API key and its line of the key file
    Key {
        /// The name of the key
        name: String,
    },
    /// Ask a running service whether it is ready
    Health(health::HealthArgs),
}

/// The settings that `args`, the environment and the settings file give.
///
/// # Errors
/// The settings file is not usable, a setting is wrong, or a variable `CONICOID_...` is no setting.
pub fn settings(args: &[OsString]) -> Result<Settings, Box<dyn std::error::Error + Send + Sync>> {
    Ok(parse(args)?.settings)
}

fn parse(args: &[OsString]) -> Result<Cli, AnyError> {
    let command = Cli::command();
    let matches = file::matches(command.clone(), args)?;
    // help and version are told in any environment
    environment::check(&command)?;
    Ok(Cli::from_arg_matches(&matches)?)
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    let args: Vec<_> = std::env::args_os().collect();
    let done = parse(&args).and_then(|cli| match cli.command {
        None => serve::run(&cli.settings),
        Some(Command::Serve(settings)) => serve::run(&settings),
        Some(Command::Segment(args)) => segment::run(&args),
        Some(Command::Openapi) => print_openapi(),
        Some(Command::Key { name }) => key::run(&name),
        Some(Command::Health(args)) => health::run(&args),
    });
    match done.map_err(|error| error.downcast::<clap::Error>()) {
        Ok(()) => ExitCode::SUCCESS,
        // help and version come this way too
        Err(Ok(error)) => error.exit(),
        Err(Err(error)) => {
            eprintln!("conicoid: {}", logging::shown(&error.to_string()));
            ExitCode::FAILURE
        }
    }
}

fn print_openapi() -> Result<(), AnyError> {
    Ok(writeln!(io::stdout(), "{}", crate::http::openapi().to_pretty_json()?)?)
}

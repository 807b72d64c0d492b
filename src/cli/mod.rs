//! The command line: `serve`, `worker`, `segment`, `fit`, `openapi`, `key` and `health`.

mod cut_short;
mod environment;
mod error;
mod file;
mod fit;
mod greeting;
mod handles;
mod health;
mod input;
mod key;
mod logging;
mod measure;
mod memory;
mod output;
mod result;
mod room;
mod segment;
mod serve;
mod settings;
mod table;
mod tls;
mod traces;

use std::{
    ffi::OsString,
    io::{self, Write},
    path::Path,
    process::ExitCode,
};

use clap::{Command, CommandFactory, FromArgMatches, Parser, Subcommand};

pub use file::FileError;
pub use serve::{Addresses, ServeError, Server};
pub use settings::{LogFormat, Settings};
pub use tls::TlsError;

use error::AnyError;

/// Finds planes, cylinders, cones, spheres, ellipsoids and tori in 3D point clouds, as a service or for one file.
///
/// Without a command, or with `serve`, it starts the service, whose page is at http://127.0.0.1:8080/ and which stops
/// with Ctrl+C. The name of a cloud in place of a command segments that file: `conicoid part.ply -o report.html` is
/// `conicoid segment part.ply -o report.html`.
#[derive(Debug, Parser)]
#[command(
    name = "conicoid",
    version,
    override_usage = "conicoid [OPTIONS]\n       conicoid CLOUD [-o RESULT] [OPTIONS]\n       conicoid <COMMAND>",
    args_conflicts_with_subcommands = true,
    args_override_self = true
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Task>,
    #[command(flatten)]
    settings: Settings,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Start the service (also the default without a command)
    Serve(Box<Settings>),
    /// Run the jobs that processes share over NATS, and take none in
    Worker(Box<Settings>),
    /// Segment one file and write the result (also the default before the name of a cloud)
    Segment(Box<segment::SegmentArgs>),
    /// Fit one geometric feature to all points of a file, with its uncertainty
    Fit(Box<fit::FitArgs>),
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
    let matches = file::matches(command.clone(), &with_command(&command, args))?;
    // help and version are told in any environment
    environment::check(&command)?;
    Ok(Cli::from_arg_matches(&matches)?)
}

/// `args` with `segment` before the name of a cloud that stands where a command would.
fn with_command(command: &Command, args: &[OsString]) -> Vec<OsString> {
    let mut args = args.to_vec();
    let is_command = |arg: &OsString| command.get_subcommands().any(|c| arg == c.get_name());
    let is_cloud = |arg: &OsString| {
        let path = Path::new(arg);
        arg == "-" || path.extension().is_some() || path.components().count() > 1 || path.is_file()
    };
    // a misspelt command is left to be told as one
    if args.get(1).is_some_and(|first| {
        let is_flag = first != "-" && first.to_string_lossy().starts_with('-');
        !is_flag && !is_command(first) && is_cloud(first)
    }) {
        args.insert(1, "segment".into());
    }
    args
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    let args: Vec<_> = std::env::args_os().collect();
    let done = parse(&args).and_then(|cli| match cli.command {
        None => serve::run(&cli.settings),
        Some(Task::Serve(settings)) => serve::run(&settings),
        Some(Task::Worker(settings)) => serve::work(&settings),
        Some(Task::Segment(args)) => segment::run(&args),
        Some(Task::Fit(args)) => fit::run(&args),
        Some(Task::Openapi) => print_openapi(),
        Some(Task::Key { name }) => key::run(&name),
        Some(Task::Health(args)) => health::run(&args),
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

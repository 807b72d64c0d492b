//! The command line: `serve`, `segment` and `openapi`.

mod logging;
mod segment;
mod serve;
mod settings;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

pub use serve::{Addresses, ServeError, Server};
pub use settings::{LogFormat, Settings};

/// Finds the quadric surfaces in 3D point clouds, as a service or for one file.
#[derive(Debug, Parser)]
#[command(name = "conicoid", version, args_conflicts_with_subcommands = true)]
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
    /// Segment one file and write the result as JSON
    Segment(Box<segment::SegmentArgs>),
    /// Print the OpenAPI document of the HTTP interface
    Openapi,
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match cli.command {
        None => serve::run(&cli.settings),
        Some(Command::Serve(settings)) => serve::run(&settings),
        Some(Command::Segment(args)) => segment::run(&args),
        Some(Command::Openapi) => print_openapi(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("conicoid: {error}");
            ExitCode::FAILURE
        }
    }
}

type AnyError = Box<dyn std::error::Error + Send + Sync>;

fn print_openapi() -> Result<(), AnyError> {
    println!("{}", crate::http::openapi().to_pretty_json()?);
    Ok(())
}

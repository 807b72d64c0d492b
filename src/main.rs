//! The `conicoid` command.

fn main() -> std::process::ExitCode {
    conicoid::cli::main()
}

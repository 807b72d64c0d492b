//! The `conicoid` command.

fn main() {}

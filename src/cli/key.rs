use std::io::{self, Write};

use super::error::AnyError;
use crate::service::sha256;

/// Makes an API key: prints it, and the line of the key file that lets it in.
pub fn run(name: &str) -> Result<(), AnyError> {
    if name.is_empty() || name.contains(|c: char| c.is_whitespace() || c == '#') {
        return Err(format!("'{name}' is no name for a key: use one word without #").into());
    }
    let mut random = [0_u8; 32];
    getrandom::fill(&mut random).map_err(|error| format!("no random numbers: {error}"))?;
    let key: String = random.iter().map(|byte| format!("{byte:02x}")).collect();
    writeln!(io::stdout(), "{name} {}", sha256(key.as_bytes()))?;
    eprintln!("The line above goes into the key file. The key, shown only now: {key}");
    Ok(())
}

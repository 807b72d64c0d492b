//! Compiles the gRPC contract without protoc and keeps its descriptor for server reflection.

use std::error::Error;

/// The library alone has no contract.
#[cfg(not(feature = "service"))]
fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=proto/build.rs");
    Ok(())
}

#[cfg(feature = "service")]
fn main() -> Result<(), Box<dyn Error>> {
    use std::{env, fs, path::PathBuf};

    use prost::Message;

    println!("cargo::rerun-if-changed=proto");
    let contract = protox::compile(["conicoid/v1/conicoid.proto"], ["proto"])?;
    let descriptor = PathBuf::from(env::var("OUT_DIR")?).join("descriptor.bin");
    fs::write(descriptor, contract.encode_to_vec())?;
    tonic_prost_build::configure().bytes(".conicoid.v1").compile_fds(contract)?;
    Ok(())
}

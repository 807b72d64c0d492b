//! Compiles the gRPC contract without protoc and keeps its descriptor for server reflection.

use std::{env, error::Error, fs, path::PathBuf};

use prost::Message;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=proto");
    let contract = protox::compile(["conicoid/v1/conicoid.proto"], ["proto"])?;
    let descriptor = PathBuf::from(env::var("OUT_DIR")?).join("descriptor.bin");
    fs::write(descriptor, contract.encode_to_vec())?;
    tonic_prost_build::configure().bytes(".conicoid.v1").compile_fds(contract)?;
    Ok(())
}

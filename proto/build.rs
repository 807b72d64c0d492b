//! Compiles the gRPC contract without protoc and keeps its descriptor for server reflection; tells the program which sources it
//! is built of.

use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
};

/// Every file below a folder, or the file itself, in rising order of their names.
fn files(place: &Path, into: &mut Vec<PathBuf>) -> std::io::Result<()> {
    if !place.is_dir() {
        into.push(place.to_owned());
        return Ok(());
    }
    let mut inside: Vec<PathBuf> =
        fs::read_dir(place)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    inside.sort();
    inside.iter().try_for_each(|path| files(path, into))
}

/// The digest of the sources (FNV-1a, 128 bits): the same wherever and however they are built.
fn tell_build() -> Result<(), Box<dyn Error>> {
    let mut all = Vec::new();
    for place in ["Cargo.toml", "proto", "src"] {
        println!("cargo::rerun-if-changed={place}");
        files(Path::new(place), &mut all)?;
    }
    let mut hash = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d_u128;
    let mut add = |bytes: &[u8]| {
        for byte in bytes {
            hash =
                (hash ^ u128::from(*byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    };
    for path in all {
        // the same name on every system
        add(path.to_string_lossy().replace('\\', "/").as_bytes());
        add(&[0]);
        add(&fs::read(path)?);
        add(&[0]);
    }
    println!("cargo::rustc-env=SOURCES_DIGEST={hash:032x}");
    Ok(())
}

/// The library alone has no contract.
#[cfg(not(feature = "service"))]
fn main() -> Result<(), Box<dyn Error>> {
    tell_build()
}

#[cfg(feature = "service")]
fn main() -> Result<(), Box<dyn Error>> {
    use std::env;

    use prost::Message;

    tell_build()?;
    let contract = protox::compile(["conicoid/v1/conicoid.proto"], ["proto"])?;
    let descriptor = PathBuf::from(env::var("OUT_DIR")?).join("descriptor.bin");
    fs::write(descriptor, contract.encode_to_vec())?;
    // maps in order: the same answer has the same bytes
    tonic_prost_build::configure()
        .bytes(".conicoid.v1")
        .btree_map(".conicoid.v1")
        .compile_fds(contract)?;
    Ok(())
}

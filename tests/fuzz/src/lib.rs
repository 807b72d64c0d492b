//! What the targets share: any bytes must be answered with a cloud or an error, without a panic, runaway
//! memory or time, and never with more points than are announced before they are read.
//!
//! Compiles the modules that read clouds, not the servers. From this folder, for each format:
//! `mkdir -p corpus/ply`, then
//! `cargo +nightly fuzz run --fuzz-dir . ply corpus/ply seeds/ply -- -malloc_limit_mb=1000 -timeout=10`.
//! `grown/ply.tar.xz` and its like hold what earlier runs of our own parsers found worth keeping: unpack it into
//! `corpus/ply` first. Those of formats that libraries read are not kept.
//! The target `read` tells the format from the bytes; give it all of `seeds/*`.
#![allow(dead_code, unused_imports)]

#[path = "../../../src/formats/mod.rs"]
pub mod formats;
#[path = "../../../src/geometry/mod.rs"]
pub mod geometry;

use std::sync::Once;

use formats::{Columns, Format, Hints, Limits, announced_points, read};

static HOOK: Once = Once::new();

/// Reads `bytes` as `format`, or as the format they show.
pub fn answer(bytes: &[u8], format: Option<Format>) {
    // the fuzzer's hook ends the process at any panic, those of libraries that `formats` catches too;
    // a panic that gets out of `read` is still a find
    HOOK.call_once(|| std::panic::set_hook(Box::new(|_| {})));
    let mut bytes = bytes.to_vec();
    repair_e57(&mut bytes);
    let parameters = match format {
        Some(Format::Xyz) => vec![(None, 0), (Columns::new([2, 3, 4]), 0), (None, 1)],
        _ => vec![(None, 0)],
    };
    for (columns, skip_lines) in parameters {
        let hints = Hints { format, columns, skip_lines };
        let announced = announced_points(&bytes, hints);
        if let Ok(cloud) = read(&bytes, hints, &Limits::of(200_000)) {
            assert!(cloud.input_len as u64 <= announced, "{} points", cloud.input_len);
        }
    }
}

/// Sets the checksum of every page, without which no change would get past the first check.
fn repair_e57(bytes: &mut [u8]) {
    if !bytes.starts_with(b"ASTM-E57") {
        return;
    }
    for page in bytes.chunks_exact_mut(1024) {
        let (data, checksum) = page.split_at_mut(1020);
        checksum.copy_from_slice(&crc32c(data).to_be_bytes());
    }
}

fn crc32c(data: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in data {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0x82f6_3b78 & (crc & 1).wrapping_neg());
        }
    }
    !crc
}

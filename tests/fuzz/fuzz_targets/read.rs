//! Any bytes must be answered with a cloud or an error: no panic, no runaway memory or time.
//!
//! From this folder: `mkdir -p corpus/read`, then
//! `cargo +nightly fuzz run --fuzz-dir . read corpus/read seeds -- -malloc_limit_mb=1000 -timeout=10`.
#![no_main]
#![allow(dead_code, unused_imports)]

#[path = "../../../src/formats/mod.rs"]
mod formats;
#[path = "../../../src/geometry/mod.rs"]
mod geometry;

use std::sync::Once;

use libfuzzer_sys::fuzz_target;

static HOOK: Once = Once::new();

fuzz_target!(|bytes: &[u8]| {
    // the fuzzer's hook ends the process at any panic, those of libraries that `formats` catches too;
    // a panic that gets out of `read` is still a find
    HOOK.call_once(|| std::panic::set_hook(Box::new(|_| {})));
    let mut bytes = bytes.to_vec();
    repair_e57(&mut bytes);
    let _ = formats::read(&bytes, None, &formats::Limits { max_points: 200_000 });
});

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

#![no_main]

use conicoid_fuzz::{answer, formats::Format};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| answer(bytes, Some(Format::Ptx)));

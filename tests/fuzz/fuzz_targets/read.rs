#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| conicoid_fuzz::answer(bytes, None));

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| tetvec_fuzz::slab(data));

#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| trimray_fuzz::picture(data));

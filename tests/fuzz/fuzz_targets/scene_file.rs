#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;

use nestrad_common::formats::scene_file;

fuzz_target!(|bytes: &[u8]| {
    let _ = scene_file::parse("f", bytes, Path::new(""));
});

#![no_main]

use libfuzzer_sys::fuzz_target;
use nestrad_common::bounded::Limit;
use nestrad_common::formats::{can, read};

fuzz_target!(|bytes: &[u8]| {
    // what comes out of the decompressor goes where a canopy would go
    if let Ok(unpacked) = read::gunzip(bytes.to_vec(), Limit::fixed(1 << 20)) {
        assert!(unpacked.len() <= bytes.len().max(1 << 20));
        let _ = can::parse("f", &unpacked);
    }
});

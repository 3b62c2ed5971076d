#![no_main]

use libfuzzer_sys::fuzz_target;
use nestrad_common::formats::pattern;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(rectangle) = pattern::parse("f", bytes) {
        assert!((rectangle.max - rectangle.min).min_element() >= pattern::MIN_SIDE);
    }
});

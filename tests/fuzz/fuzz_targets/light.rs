#![no_main]

use libfuzzer_sys::fuzz_target;
use nestrad_common::formats::light;
use nestrad_common::light::MIN_DESCENT;

fuzz_target!(|bytes: &[u8]| {
    for source in light::parse("f", bytes).unwrap_or_default() {
        assert!(source.irradiance_W_m2.is_finite() && source.irradiance_W_m2 >= 0.0);
        assert!((source.direction.length() - 1.0).abs() < 1e-12);
        assert!(source.direction.z <= -MIN_DESCENT);
    }
});

#![no_main]

use libfuzzer_sys::fuzz_target;
use nestrad_common::formats::opt;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(opt) = opt::parse("f", bytes) {
        assert!((0.0..=1.0).contains(&opt.soil_albedo));
        assert!(
            opt.species
                .iter()
                .all(|species| species.leaf.check().is_ok())
        );
    }
});

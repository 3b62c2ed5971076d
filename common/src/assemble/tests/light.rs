//! Files and skies to light.

use std::collections::BTreeMap;

use super::*;
use crate::light::{CieType, MIN_DESCENT, SunnySky};

#[test]
fn light_per_band_shares_directions_and_leaves_out_the_dark() {
    let mut case = Case::new(LEAF);
    let second = BandInput {
        name: "NIR".into(),
        ..case.inputs.bands[0].clone()
    };
    case.inputs.bands.push(second);
    let par = case.file("par.light", "0 1 0 -1\n100 0 0 -1\n30 0 0.5 -1\n");
    let nir = case.file("nir.light", "80 0 0 -2\n0 1 0 -1\n7 0 -0.5 -1\n1 -0 0 -1\n");
    let files = [("PAR".to_owned(), par.clone()), ("NIR".to_owned(), nir)];
    case.inputs.light = Some(LightInput::Files(files.into()));
    let light = case.loaded().scene.light;
    let sources = &light.suns;
    let irradiance: Vec<&[f64]> = sources.iter().map(|s| &s.irradiance_W_m2[..]).collect();
    assert_eq!(irradiance, [[100.0, 81.0], [30.0, 0.0], [0.0, 7.0]]);

    let files = [("PAR".to_owned(), par), ("UV".to_owned(), "x".into())];
    case.inputs.light = Some(LightInput::Files(files.into()));
    assert_eq!(
        case.refusal(),
        "light is given for bands PAR, UV, expected PAR, NIR"
    );
    let dark = case.file("dark.light", "0 0 0 -1\n");
    case.inputs.light = Some(LightInput::File(dark));
    let loaded = case.loaded();
    assert!(loaded.scene.light.suns.is_empty());
    assert_eq!(
        loaded.inspection.warnings,
        ["no source has any light in any band"]
    );
}

#[test]
fn fault_at_sunrise_a_leaf_got_27_kW_m2() {
    let mut case = Case::new(LEAF);
    let mut at = |time_utc: &str| {
        case.inputs.light = Some(LightInput::Sky {
            sky: Sky::Sunny {
                model: SunnySky::Cie(CieType::CLEAR),
                time_utc: time_utc.into(),
                latitude_deg: 43.6,
                longitude_deg: 3.9,
                diffuse_fraction: 0.5,
            },
            irradiance_W_m2: BTreeMap::from([("PAR".to_owned(), 1.0)]),
        });
        load(&case.inputs)
    };
    // second by second: no beam is stronger than a .light file could have it, and all that are absurd are said
    let mut absurd = 0;
    for second in 0..600 {
        let time = format!("2024-03-20T05:{:02}:{:02}Z", 42 + second / 60, second % 60);
        match at(&time) {
            Err(error) => assert!(error.to_string().starts_with("the sun is "), "{error}"),
            Ok(loaded) => {
                let beam_W_m2 = 0.5 / -loaded.scene.light.suns[0].direction.z;
                assert!(beam_W_m2 <= 0.5 / MIN_DESCENT);
                let said = loaded
                    .inspection
                    .warnings
                    .iter()
                    .any(|w| w.contains("is its irradiance right"));
                assert_eq!(said, beam_W_m2 > 0.39 * 1361.0, "{time}");
                absurd += usize::from(said);
            }
        }
    }
    assert!(absurd > 0);
}

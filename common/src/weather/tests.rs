use super::*;
use crate::formats::weather::parse;
use crate::light::CieType;

const PLACE: Site = Site {
    latitude_deg: 43.6,
    longitude_deg: 3.9,
};

fn moments(text: &str, sky: SkyModel) -> Result<Vec<Moment>, String> {
    let weather = parse("w.csv", text.as_bytes()).unwrap();
    let band_fraction = BTreeMap::from([("PAR".to_owned(), 0.5)]);
    let to_light = ToLight {
        site: PLACE,
        sky,
        bands: &["PAR".to_owned()],
        band_fraction: &band_fraction,
    };
    to_light
        .moments(&weather)
        .map_err(|error| error.to_string())
}

fn refusal(text: &str) -> String {
    moments(text, SkyModel::Uniform).unwrap_err()
}

#[test]
fn two_of_three_irradiances_give_the_same_light() {
    let sun = Sun::at("2026-06-21T12:00:00Z", 43.6, 3.9).unwrap();
    let (dni, dhi) = (800.0, 100.0);
    let ghi = dhi + dni * sun.towards().z;
    let row = |header: &str, values: [f64; 2]| {
        let [a, b] = values;
        format!("time,{header}\n2026-06-21T12:00Z,{a},{b}\n2026-06-21T13:00Z,0,0\n")
    };
    for text in [
        row("dhi,dni", [dhi, dni]),
        row("ghi,dhi", [ghi, dhi]),
        row("ghi,dni", [ghi, dni]),
    ] {
        let found = &moments(&text, SkyModel::Perez).unwrap()[0];
        let light = found.light.as_ref().unwrap();
        let sun_W_m2 = light.suns[0].irradiance_W_m2[0];
        assert!((sun_W_m2 - 0.5 * (ghi - dhi)).abs() < 1e-9, "{text}");
        let sky = light.sky.as_ref().unwrap();
        assert!((sky.irradiance_W_m2[0] - 0.5 * dhi).abs() < 1e-9, "{text}");
        let Radiance::Perez(perez) = sky.radiance else {
            panic!("{sky:?}")
        };
        // 20.35 degrees from the zenith: kappa = 0.04667
        assert!(
            (perez.clearness - 9.04667 / 1.04667).abs() < 1e-3,
            "{perez:?}"
        );
        assert!((perez.towards_sun - sun.towards()).length() < 1e-9);
    }
}

#[test]
fn bands_have_columns_of_their_own_or_a_part() {
    let text =
        "time,direct_PAR_W_m2,diffuse_PAR_W_m2\n2026-06-21T12:00Z,200,50\n2026-06-21T13:00Z,0,50\n";
    let found = moments(text, SkyModel::MoonSpencer).unwrap();
    let light = found[0].light.as_ref().unwrap();
    assert_eq!(light.irradiance_W_m2(0), 250.0);
    assert!(found[1].light.as_ref().unwrap().suns.is_empty());
    let error = moments(text, SkyModel::Perez).unwrap_err();
    assert!(error.contains("for a sky of Perez"), "{error}");
    let weather = parse(
        "w.csv",
        b"time,ghi,dhi\n2026-06-21T12:00Z,2,1\n2026-06-21T13:00Z,2,1\n",
    )
    .unwrap();
    let none = BTreeMap::new();
    let bands = ["NIR".to_owned()];
    let to_light = ToLight {
        site: PLACE,
        sky: SkyModel::Uniform,
        bands: &bands,
        band_fraction: &none,
    };
    let error = to_light.moments(&weather).unwrap_err().to_string();
    assert!(error.contains("--band-fraction NIR=0.5"), "{error}");
}

#[test]
fn what_the_sun_does_not_allow_is_named_by_its_line() {
    for (rows, expected) in [
        (
            "ghi,dhi\n2026-06-21T12:00Z,5,6\n2026-06-21T13:00Z,0,0\n",
            "w.csv, line 2: expected DHI of at most GHI",
        ),
        (
            "ghi,dhi\n2026-06-21T12:00Z,5,5\n2026-06-21T22:00Z,2,1\n",
            "w.csv, line 3: expected no direct light at",
        ),
        (
            "dhi,dni\n2026-06-21T12:00Z,5,5\n2026-06-21T22:00Z,0,1\n",
            "w.csv, line 3: expected no direct light at",
        ),
        (
            "ghi,dni\n2026-06-21T12:00Z,5,800\n2026-06-21T13:00Z,0,0\n",
            "w.csv, line 2: expected direct light on the horizontal of at most GHI",
        ),
        (
            "ghi,dhi\n2026-06-21T10:00Z,5,5\n2026-06-21T11:00Z,5,5\n2026-06-21T13:00Z,0,0\n",
            "w.csv, line 4: expected a row at 2026-06-21T12:00:00Z",
        ),
    ] {
        // two rows ten hours apart are the spacing of their file
        let found = refusal(&format!("time,{rows}"));
        assert!(found.starts_with(expected), "{found}");
    }
}

#[test]
fn a_night_may_be_left_out_and_counts_as_nothing() {
    let text = "time,ghi,dhi\n2026-06-21T18:00Z,30,30\n2026-06-21T19:00Z,5,5\n2026-06-22T05:00Z,40,40\n2026-06-22T06:00Z,50,50\n";
    let found = moments(text, SkyModel::Cie(CieType::CLEAR)).unwrap();
    let weights: Vec<f64> = found.iter().map(|moment| moment.weight_s).collect();
    assert_eq!(weights, [1800.0, 3600.0, 3600.0, 1800.0]);
    // a night that is there is dark, and has no light to be computed
    let text = "time,ghi,dhi\n2026-06-21T22:00Z,0,0\n2026-06-21T23:00Z,0,0\n";
    assert!(
        moments(text, SkyModel::Perez)
            .unwrap()
            .iter()
            .all(|m| m.light.is_none())
    );
}

#[test]
fn dusk_has_a_sky_without_a_sun() {
    let text = "time,ghi,dhi\n2026-06-21T19:00Z,5,5\n2026-06-21T20:00Z,1,1\n";
    for sky in [
        SkyModel::Perez,
        SkyModel::Cie(CieType::CLEAR),
        SkyModel::MoonSpencer,
    ] {
        let found = moments(text, sky).unwrap();
        assert!(!found[1].sun.is_up(), "{found:?}");
        let light = found[1].light.as_ref().unwrap();
        assert!(light.suns.is_empty() && light.sky.is_some());
    }
}

//! Scene files, good and bad.

use super::*;
use crate::inputs::{LightInput, PatternInput};
use crate::light::{CieType, Sky, SunnySky};
use crate::optics::LeafOptics;
use crate::options::{Diameter, TableFormat, Unit, Up};

const WHOLE: &str = r#"
scene = ["maize.can.gz", "/abs/soil.obj"]
unit = "cm"
up = "y"
pattern = [-40, -75, 40, 75.5]
soil = -0.2
light = "clear.light"

[[bands]]
name = "PAR"
optics = "par.opt"

[[bands]]
name = "NIR"
soil_albedo = 0.25
[bands.materials]
bark = { rho = 0.4 }
leaf = { upper = { rho = 0.44, tau = 0.45 }, lower = { rho = 0.46, tau = 0.44 } }

[options]
diameter = 0.4
accuracy_percent = 0.5
memory_GiB = 2
threads = 2
seed = 7
format = "parquet"
vtp = true
"#;

fn parsed(text: &str) -> Inputs {
    parse("a.toml", text.as_bytes(), Path::new("dir")).unwrap()
}

fn refusal(text: &str) -> String {
    parse("a.toml", text.as_bytes(), Path::new("dir"))
        .unwrap_err()
        .to_string()
}

#[test]
fn everything_can_be_said() {
    let inputs = parsed(WHOLE);
    let paths: Vec<_> = inputs.scenes.iter().map(|path| path.to_str()).collect();
    assert_eq!(paths, [Some("dir/maize.can.gz"), Some("/abs/soil.obj")]);
    assert_eq!(inputs.unit, Some(Unit::Centimetre));
    assert_eq!(inputs.up, Some(Up::Y));
    let corners = PatternInput::Corners([-40.0, -75.0, 40.0, 75.5]);
    assert_eq!(inputs.pattern, Some(corners));
    assert_eq!(inputs.soil, Some(-0.2));
    assert_eq!(
        inputs.light,
        Some(LightInput::File("dir/clear.light".into()))
    );
    assert_eq!(inputs.bands[0].optics, Some("dir/par.opt".into()));
    assert_eq!(inputs.bands[1].soil_albedo, Some(0.25));
    assert_eq!(inputs.bands[1].materials["bark"], LeafOptics::opaque(0.4));
    assert_eq!(inputs.bands[1].materials["leaf"].lower.tau, 0.44);
    assert_eq!(inputs.bands[1].place, Some(Place::line("a.toml", 13)));
    let options = inputs.options;
    assert_eq!(options.diameter, Some(Diameter::Metres(0.4)));
    assert_eq!(options.accuracy_percent, Some(0.5));
    assert_eq!(options.memory_GiB, Some(2.0));
    assert_eq!((options.threads, options.seed), (Some(2), Some(7)));
    assert_eq!(options.format, Some(TableFormat::Parquet));
    assert_eq!(options.vtp, Some(true));
}

#[test]
fn nothing_has_to_be_said() {
    assert_eq!(parsed(""), Inputs::default());
    assert_eq!(parsed("\r\n# nothing\r\n"), Inputs::default());
}

#[test]
fn flags_win_over_the_file() {
    let mut flags = Inputs::default();
    flags.options.seed = Some(9);
    flags.unit = Some(Unit::Metre);
    let both = flags.over(parsed(WHOLE));
    assert_eq!(both.options.seed, Some(9));
    assert_eq!(both.options.threads, Some(2));
    assert_eq!(both.unit, Some(Unit::Metre));
    assert_eq!(both.bands.len(), 2);
}

#[test]
fn light_is_a_file_a_file_per_band_or_a_sky() {
    let light = |text: &str| parsed(text).light.unwrap();
    let LightInput::Files(files) = light("[light.files]\nPAR = 'a.light'\nNIR = 'b.light'") else {
        panic!("expected files")
    };
    assert_eq!(files["NIR"], Path::new("dir/b.light"));

    for time in ["2024-06-21T12:00:00Z", "'2024-06-21T12:00:00Z'"] {
        let text = format!(
            "[light.sky]\nkind = 'clear'\ntime_utc = {time}\nlatitude_deg = 43.6\n\
             longitude_deg = 3.9\ndiffuse_fraction = 0.2\nirradiance_W_m2 = {{ PAR = 400 }}"
        );
        let LightInput::Sky {
            sky,
            irradiance_W_m2,
        } = light(&text)
        else {
            panic!("expected a sky")
        };
        let expected = Sky::Sunny {
            model: SunnySky::Cie(CieType::CLEAR),
            time_utc: "2024-06-21T12:00:00Z".into(),
            latitude_deg: 43.6,
            longitude_deg: 3.9,
            diffuse_fraction: 0.2,
        };
        assert_eq!(sky, expected);
        assert_eq!(irradiance_W_m2["PAR"], 400.0);

        let error = refusal(&text.replace("43.6", "95.0"));
        assert_eq!(
            error,
            "a.toml, line 1: latitude_deg: expected -90 to 90, found 95"
        );
    }
}

#[test]
fn a_sky_may_be_of_any_model() {
    let sky = |kind: &str, more: &str| {
        format!(
            "[light.sky]\nkind = '{kind}'\ntime_utc = 2024-06-21T12:00:00Z\nlatitude_deg = 43.6\n\
             longitude_deg = 3.9\ndiffuse_fraction = 0.2\n{more}\nirradiance_W_m2 = {{ PAR = 400 }}"
        )
    };
    let model = |text: &str| match parsed(text).light {
        Some(LightInput::Sky {
            sky: Sky::Sunny { model, .. },
            ..
        }) => model,
        other => panic!("{other:?}"),
    };
    let cie = |number| SunnySky::Cie(CieType::new(number).unwrap());
    assert_eq!(model(&sky("cie_3", "")), cie(3));
    assert_eq!(model(&sky("cie-15", "")), cie(15));
    let global_W_m2 = 812.5;
    assert_eq!(
        model(&sky("perez", "ghi_W_m2 = 812.5")),
        SunnySky::Perez { global_W_m2 }
    );
    for (text, expected) in [
        (sky("perez", ""), "ghi_W_m2, the global irradiance"),
        (sky("cie_16", ""), "kind of sky: perez, cie-1 to cie-15"),
        (
            sky("clear", "ghi_W_m2 = 1"),
            "ghi_W_m2 with kind = \"perez\" alone",
        ),
        (
            sky("perez", "ghi_W_m2 = 0.5"),
            "ghi_W_m2: expected 1 to 2000, found 0.5",
        ),
        (sky("standard_overcast", ""), "irradiance_W_m2 alone"),
    ] {
        assert!(refusal(&text).contains(expected), "{}", refusal(&text));
    }
}

#[test]
fn diameters_are_words_or_metres() {
    let diameter = |text: &str| {
        parsed(&format!("[options]\ndiameter = {text}"))
            .options
            .diameter
    };
    assert_eq!(diameter("'auto'"), Some(Diameter::Auto));
    assert_eq!(diameter("'inf'"), Some(Diameter::Infinite));
    assert_eq!(diameter("inf"), Some(Diameter::Infinite));
    assert_eq!(diameter("2"), Some(Diameter::Metres(2.0)));
    for bad in ["0", "-1", "nan", "'wide'", "[]"] {
        let error = refusal(&format!("[options]\ndiameter = {bad}"));
        assert!(
            error.contains("auto, inf or a number of metres above 0"),
            "{error}"
        );
    }
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    for (text, expected) in [
        ("scenes = 'a'\n", "a.toml, line 1: unknown field `scenes`"),
        (
            "\nunit = 'inch'\n",
            "a.toml, line 2: unknown variant `inch`",
        ),
        (
            "up = 'x'\n",
            "a.toml, line 1: unknown variant `x`, expected `z` or `y`",
        ),
        (
            "\n\nsoil = nan\n",
            "a.toml, line 3: expected a finite soil height, found NaN",
        ),
        ("soil = 1\nsoil = 2\n", "a.toml, line 2: duplicate key"),
        (
            "scene = 3\n",
            "a.toml, line 1: expected a file or a list of files",
        ),
        (
            "pattern = [0, 0, 1]",
            "a.toml, line 1: expected a file or [x0, y0, x1, y1]",
        ),
        (
            "pattern = [0, 0, 0, 1]",
            "a.toml, line 1: expected corners 1e-9 or more apart",
        ),
        (
            "light = 3",
            "a.toml, line 1: invalid type: integer `3`, expected a file, [light.files]",
        ),
        (
            "[light]\n",
            "a.toml, line 1: expected either [light.files] or [light.sky]",
        ),
        (
            "[light]\nskies = 1\n",
            "a.toml, line 2: unknown field `skies`",
        ),
        (
            "[light.sky]\nkind = 'grey'\nirradiance_W_m2 = {}\n",
            "a.toml, line 2: expected kind of sky: perez, cie-1 to cie-15",
        ),
        (
            "[light.sky]\nkind = 'clear'\nirradiance_W_m2 = {}\n",
            "a.toml, line 1: expected time_utc, latitude_deg",
        ),
        (
            "[light.sky]\nkind = 'uniform_overcast'\nirradiance_W_m2 = { PAR = -1 }\n",
            "a.toml, line 1: irradiance in band PAR: expected 0 or 1e-100 to 1e100",
        ),
        (
            "[light.sky]\nkind = 'uniform_overcast'\nlatitude_deg = 3\nirradiance_W_m2 = {}\n",
            "a.toml, line 1: expected irradiance_W_m2 alone",
        ),
        (
            "[options]\nthreads = -1\n",
            "a.toml, line 2: invalid value: integer `-1`",
        ),
        (
            "[options]\nthreads = 70000\n",
            "a.toml, line 1: threads: expected a whole number from 0 to 4096, found 70000",
        ),
        (
            "[options]\n\naccuracy_percent = 0\n",
            "a.toml, line 1: accuracy: expected a number above 0",
        ),
        ("[[bands]]\n", "a.toml, line 1: missing field `name`"),
        (
            "\n[kinds]\nmaterials = { panel = 'glass' }\n",
            "a.toml, line 3: unknown variant `glass`, expected one of `leaf`, `stem`, `structure`, `soil`",
        ),
        (
            "[kinds]\nspecies = { 0 = 'soil' }\n",
            "a.toml, line 1: expected numbers from 1 for species, found 0",
        ),
        (
            "[[bands]]\nname = 'A'\nsoil_albedo = 1.1\n",
            "a.toml, line 3: expected an albedo from 0 to 1, found 1.1",
        ),
        (
            "[[bands]]\nname = 'A'\noptics = 'x'\nsoil_albedo = 0.1\n",
            "a.toml, line 4: expected the albedo of the soil in the optics file or here",
        ),
        (
            "[[bands]]\nname = 'A'\n[bands.materials]\nm = { rho = 0.6, tau = 0.5 }\n",
            "a.toml, line 4: rho = 0.6 and tau = 0.5: expected rho + tau <= 1",
        ),
        (
            "[[bands]]\nname = 'A'\n[bands.materials]\nm = { rho = 0.6, upper = { rho = 0 } }\n",
            "a.toml, line 4: expected rho (and tau) of both faces",
        ),
    ] {
        let error = refusal(text);
        assert!(error.starts_with(expected), "{error}");
        assert!(!error.contains('\n'));
    }
}

#[test]
fn fault_numbers_and_texts_that_toml_has_no_form_for_were_not_explained() {
    for (line, expected) in [
        (
            "soil = .1",
            "expected a number written as in TOML, 0.1, found .1",
        ),
        (
            "soil = -.5e-3 # m",
            "expected a number written as in TOML, -0.5e-3, found -.5e-3",
        ),
        (
            "soil = 1.",
            "expected a number written as in TOML, 1.0, found 1.",
        ),
        (
            "soil = +2.e3",
            "expected a number written as in TOML, +2.0e3, found +2.e3",
        ),
        (
            "soil = 01.5",
            "expected a number written as in TOML, 1.5, found 01.5",
        ),
        (
            "soil = 0,5",
            "expected a number written as in TOML, 0.5, found 0,5",
        ),
        (
            "pattern = [0, .5, 1, 1]",
            "expected a number written as in TOML, 0.5, found .5",
        ),
        (
            "bands = [{ name = 'A', materials = { m = { rho = .1, tau = 0.2 } } }]",
            "expected a number written as in TOML, 0.1, found .1",
        ),
        ("unit = cm", "expected text in quotes, \"cm\", found cm"),
        (
            "scene = a.can",
            "expected text in quotes, \"a.can\", found a.can",
        ),
        (
            "options = { vtp = True }",
            "expected true, in lower case, found True",
        ),
        (
            "leaf one = 1",
            "expected a name with blanks in quotes, \"leaf one\", found leaf one",
        ),
        (
            "scene = \"C:\\users\\a.can\"",
            "expected a path with / or in single quotes, found a \\, which begins an escape sequence in double quotes",
        ),
        (
            "soil = '0.1'",
            "invalid type: string \"0.1\", expected a number",
        ),
        (
            "options = { threads = 3.5 }",
            "invalid type: floating point `3.5`, expected a whole number, 0 or more",
        ),
    ] {
        assert_eq!(
            refusal(&format!("\n{line}\n")),
            format!("a.toml, line 2: {expected}")
        );
    }
}

#[test]
fn fault_a_lone_carriage_return_did_not_end_a_line() {
    for end in ["\r", "\r\n"] {
        assert_eq!(parsed(&WHOLE.replace('\n', end)), parsed(WHOLE));
        let error = refusal(&format!("# a{end}{end}soil = nan{end}"));
        assert!(error.starts_with("a.toml, line 3: "), "{error}");
    }
    assert_eq!(parsed("\u{feff}soil = 1\n").soil, Some(1.0));
}

#[test]
fn fault_overcast_skies_had_another_name_here_than_in_flags() {
    for (names, sky) in [
        (
            ["uniform_overcast", "uniform-overcast"],
            Sky::UniformOvercast,
        ),
        (
            ["standard_overcast", "standard-overcast"],
            Sky::StandardOvercast,
        ),
    ] {
        for name in names {
            let text = format!("[light.sky]\nkind = '{name}'\nirradiance_W_m2 = {{ PAR = 1 }}\n");
            let light = parsed(&text).light;
            assert!(matches!(light, Some(LightInput::Sky { sky: found, .. }) if found == sky));
        }
    }
}

#[test]
fn a_sun_below_the_horizon_is_named_with_its_line() {
    let text = "soil = 0\n[light.sky]\nkind = 'clear'\ntime_utc = 2024-06-21T00:00:00Z\nlatitude_deg = 43.6\n\
                longitude_deg = 3.9\ndiffuse_fraction = 0.2\nirradiance_W_m2 = { PAR = 400 }\n";
    let error = refusal(text);
    assert!(
        error.starts_with("a.toml, line 2: the sun is below the horizon at 2024"),
        "{error}"
    );
    assert!(
        parse(
            "a.toml",
            text.replace("T00:00:00Z", "T12:00:00+00:00").as_bytes(),
            Path::new("")
        )
        .is_ok()
    );
}

#[test]
fn binary_files_are_refused() {
    let error = parse("a.toml", b"soil = 1\n\xff", Path::new("")).unwrap_err();
    assert_eq!(
        error.to_string(),
        "a.toml, line 2: expected UTF-8 text, found other bytes"
    );
    assert!(refusal("\0\u{1}").starts_with("a.toml, line 1: "));
    for opening in ["[", "a = [", "a = {b = "] {
        refusal(&opening.repeat(100_000));
    }
}

use super::*;
use glam::{DVec2, DVec3};
use nestrad_common::canopy::{Material, Mesh, Organ, Pattern, Triangle};
use nestrad_engine::solution::{ItemLight, MaterialLight};

fn estimate(value: f64, se: f64) -> Estimate {
    Estimate { value, se }
}

fn band(name: &str, factor: f64) -> Balance {
    Balance {
        band: name.into(),
        incoming_W: 900.0 * factor,
        absorbed_plants_W: estimate(760.246 * factor, 0.3 * factor),
        absorbed_soil_W: estimate(80.0 * factor, 0.21 * factor),
        escaped_up_W: estimate(59.79 * factor, 0.24 * factor),
        escaped_down_W: estimate(0.0, 0.0),
        closure_W: estimate(-0.004 * factor, 0.02 * factor),
        ..Balance::default()
    }
}

/// Two triangles: a leaf of 1 m², whose standard error is 0.5 %, and soil.
fn canopy_and_solution(pattern: Option<Pattern>, balance: Vec<Balance>) -> (Canopy, Solution) {
    let organ = |id: &str| Organ {
        species: "1".into(),
        plant: "1".into(),
        id: id.into(),
    };
    let triangle = |number| Triangle {
        corners_m: [DVec3::ZERO; 3],
        organ: number,
        material: number,
    };
    let mut canopy = Canopy::of_meshes(vec![Mesh::from_iter([0, 1].map(triangle))]);
    canopy.organs = vec![organ("1001"), organ("0")];
    canopy.materials = vec![Material::Leaf { species: 1 }, Material::Soil];
    canopy.pattern = pattern;
    let light = |absorbed_se_W| ItemLight {
        absorbed_W: 2.0,
        absorbed_se_W,
        ..ItemLight::default()
    };
    let mut organs = vec![light(0.01); balance.len()];
    organs.extend(vec![light(1.0); balance.len()]);
    let solution = Solution {
        organs,
        organ_area_m2: vec![1.0, 50.0],
        triangle_area_m2: vec![1.0, 50.0],
        balance,
        ..Solution::default()
    };
    (canopy, solution)
}

fn shown(pattern: Option<Pattern>, balance: Vec<Balance>) -> String {
    let (canopy, solution) = canopy_and_solution(pattern, balance);
    let usage = Usage {
        wall_s: 1.234,
        cpu_s: 2.345,
        peak_memory_bytes: Some(300 << 20),
    };
    let mut out = Vec::new();
    write(&mut out, &canopy, &solution, usage).expect("written");
    String::from_utf8_lossy(&out).into_owned()
}

fn two_square_metres() -> Option<Pattern> {
    Some(Pattern {
        min_m: DVec2::ZERO,
        size_m: DVec2::new(1.0, 2.0),
    })
}

#[test]
fn a_canopy_over_soil() {
    let text = shown(
        two_square_metres(),
        vec![band("PAR", 1.0), band("NIR", 0.8)],
    );
    let expected = "\
light in W per m² of ground (± one standard error)
band  incoming        plants         soil   escaped up     closure
PAR     450.00  380.12 ±0.15  40.00 ±0.10  29.89 ±0.12  0.00 ±0.01
NIR     360.00  304.10 ±0.12  32.00 ±0.08  23.92 ±0.10  0.00 ±0.01
standard error of organs, rms, in percent of the mean: PAR 0.50 %; NIR 0.50 %
1.23 s elapsed, 2.35 s of CPU time, at most 300 MiB of memory
";
    assert_eq!(text, expected);
}

#[test]
fn an_isolated_plant_above_a_void() {
    let mut balance = band("PAR", 1e-4);
    balance.escaped_down_W = std::mem::take(&mut balance.absorbed_soil_W);
    let text = shown(None, vec![balance]);
    let expected = "\
light in mW, whole scene (± one standard error)
band  incoming         plants  escaped down    escaped up       closure
PAR     90.000  76.025 ±0.030  8.000 ±0.021  5.979 ±0.024  0.000 ±0.002
standard error of organs, rms, in percent of the mean: PAR 0.50 %
1.23 s elapsed, 2.35 s of CPU time, at most 300 MiB of memory
";
    assert_eq!(text, expected);
}

#[test]
fn fault_a_panel_and_a_film_were_plants() {
    let material = |name: &str, kind, watts| MaterialLight {
        name: name.into(),
        kind,
        absorbed_W: estimate(watts, 0.2),
    };
    let mut band = band("PAR", 1.0);
    band.absorbed_plants_W = estimate(560.246, 0.3);
    band.absorbed_structures_W = estimate(200.0, 0.3);
    band.materials = vec![
        material("leaf of species 1", Kind::Leaf, 500.0),
        material("panel", Kind::Structure, 150.0),
        material("stem of species 1", Kind::Stem, 60.246),
        material("film of a greenhouse long ago", Kind::Structure, 50.0),
    ];
    let expected = "\
light in W per m² of ground (± one standard error)
band  incoming        plants    structures         soil   escaped up     closure
PAR     450.00  280.12 ±0.15  100.00 ±0.15  40.00 ±0.10  29.89 ±0.12  0.00 ±0.01
absorbed by                    kind           PAR
leaf of species 1              leaf  250.00 ±0.10
stem of species 1              stem   30.12 ±0.10
panel                     structure   75.00 ±0.10
film of a greenhouse lo…  structure   25.00 ±0.10
";
    let text = shown(two_square_metres(), vec![band]);
    assert!(text.starts_with(expected), "{text}");
}

#[test]
fn many_bands_with_long_names_fit_into_80_columns() {
    let bands = (0..12).map(|number| {
        let mut band = band(&format!("waveband number {number}"), 0.02);
        band.escaped_down_W = estimate(3.0, 0.5);
        band
    });
    let text = shown(None, bands.collect());
    assert!(text.contains("waveband nu…"), "{text}");
    assert!(
        text.lines().all(|line| line.chars().count() <= COLUMNS),
        "{text}"
    );
}

#[test]
fn a_dark_scene_is_shown_too() {
    let text = shown(
        None,
        vec![Balance {
            band: "PAR".into(),
            ..Balance::default()
        }],
    );
    assert!(text.contains("PAR     0.0000  0.0000 ±0.0000"), "{text}");
}

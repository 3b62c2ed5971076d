//! The sample scenes and the reference solutions that belong to them.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use nestrad_common::assemble::load;
use nestrad_common::inputs::{BandInput, Inputs, LightInput, PatternInput};
use nestrad_common::scene::Scene;
use nestrad_engine::solution::Solution;

/// The folder of sample scenes (`NESTRAD_SHARED`, or `../shared` beside the workspace), if this
/// machine has it.
#[allow(clippy::print_stderr, reason = "a skipped test has to say so")]
pub fn shared() -> Option<PathBuf> {
    let near = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared");
    let folder = std::env::var_os("NESTRAD_SHARED").map_or_else(|| near.into(), PathBuf::from);
    if folder.join("scenes").is_dir() && folder.join("reference").is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: no sample scenes in {}", folder.display());
    None
}

/// A sample scene in two bands under a clear sky.
pub fn sample(folder: &Path, name: &str, soil_m: f64) -> Scene {
    let scenes = folder.join("scenes");
    let band = |band: &str, file: &str| BandInput {
        name: band.into(),
        optics: Some(scenes.join(file)),
        ..BandInput::default()
    };
    let inputs = Inputs {
        scenes: vec![scenes.join(format!("{name}.can.gz"))],
        pattern: Some(PatternInput::File(scenes.join(format!("{name}.8")))),
        soil: Some(soil_m),
        bands: vec![band("PAR", "par.opt"), band("NIR", "nir.opt")],
        light: Some(LightInput::File(scenes.join("clear.light"))),
        ..Inputs::default()
    };
    load(&inputs).unwrap().scene
}

/// An absorbed power and its standard error, W, by organ and band.
pub type Organs = HashMap<(String, String), (f64, f64)>;

/// The reference solution of a sample scene, by organ.
pub fn organs(folder: &Path, name: &str) -> Organs {
    let table = folder.join(format!("reference/{name}.clear.organs.csv"));
    let table = fs::read_to_string(table).unwrap();
    let row = |line: &str| {
        let f: Vec<&str> = line.split(',').collect();
        let number = |k: usize| f[k].parse().unwrap();
        ((f[0].to_owned(), f[2].to_owned()), (number(3), number(4)))
    };
    table.lines().skip(1).map(row).collect()
}

/// Totals of a band in the reference balance, W: absorbed by plants, by the soil, escaped upwards.
///
/// The file is JSON of one value a line; all that is read is `"value"` after a name after the band.
pub fn totals(folder: &Path, name: &str, band: &str) -> [f64; 3] {
    let text = folder.join(format!("reference/{name}.clear.balance.json"));
    let text = fs::read_to_string(text).unwrap();
    let of_band = &text[text.find(&format!("\"{band}\"")).unwrap()..];
    ["absorbed_scene", "soil_absorbed", "escaped_up"].map(|key| {
        let from = &of_band[of_band.find(&format!("\"{key}\"")).unwrap()..];
        let from = &from[from.find("\"value\":").unwrap() + 8..];
        let end = from.find([',', '}', '\n']).unwrap();
        from[..end].trim().parse().unwrap()
    })
}

/// Organs smaller than this (m²) have too few particles in the reference to be judged by.
const LEAST_ORGAN_M2: f64 = 1e-4;

/// How far the organs of a solution are from a reference.
#[derive(Clone, Copy, Debug)]
pub struct Misfit {
    /// Area-weighted rms of the error in absorbed W m⁻² over the mean, the reference's own standard
    /// errors taken off in quadrature.
    pub rms: f64,
    /// The same of the solution's own standard errors.
    pub stated: f64,
    /// Rms of error over combined standard error.
    pub rms_z: f64,
    /// Number of organs.
    pub organs: usize,
}

/// Compares the organs of a band.
pub fn misfit(scene: &Scene, solution: &Solution, reference: &Organs, band: usize) -> Misfit {
    let bands = scene.optics.len();
    let (mut error2, mut own2, mut stated2, mut z2) = (0.0, 0.0, 0.0, 0.0);
    let (mut area, mut absorbed, mut organs) = (0.0, 0.0, 0);
    for (o, organ) in scene.canopy.organs.iter().enumerate() {
        let a = solution.organ_area_m2[o];
        if a < LEAST_ORGAN_M2 {
            continue;
        }
        let key = (organ.id.clone(), scene.optics.bands[band].name.clone());
        let (value, se) = reference[&key];
        let item = &solution.organs[o * bands + band];
        let error = item.absorbed_W - value;
        error2 += error * error / a;
        own2 += se * se / a;
        stated2 += item.absorbed_se_W.powi(2) / a;
        z2 += error * error / (se * se + item.absorbed_se_W.powi(2));
        area += a;
        absorbed += value;
        organs += 1;
    }
    let mean = absorbed / area;
    Misfit {
        rms: ((error2 - own2) / area).max(0.0).sqrt() / mean,
        stated: (stated2 / area).sqrt() / mean,
        rms_z: (z2 / organs as f64).sqrt(),
        organs,
    }
}

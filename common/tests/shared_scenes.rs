//! The sample scenes: read whole, and compared with the areas of the reference solutions.

#![allow(non_snake_case, clippy::unwrap_used, clippy::print_stderr)]

use std::collections::HashMap;
use std::fs;
use std::path::PathBuf;

use nestrad_common::assemble::{Loaded, load};
use nestrad_common::formats::{can, read};
use nestrad_common::geometry::area;
use nestrad_common::inputs::{BandInput, Inputs, LightInput, PatternInput};

/// The folder of sample scenes, if this machine has it.
fn shared() -> Option<PathBuf> {
    let near = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared");
    let folder = std::env::var_os("NESTRAD_SHARED").map_or_else(|| near.into(), PathBuf::from);
    if folder.join("scenes").is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: no sample scenes in {}", folder.display());
    None
}

fn rows(folder: &std::path::Path, name: &str, soil: f64) -> Loaded {
    let scenes = folder.join("scenes");
    let band = |band: &str, file: &str| BandInput {
        name: band.into(),
        optics: Some(scenes.join(file)),
        ..BandInput::default()
    };
    load(&Inputs {
        scenes: vec![scenes.join(format!("{name}.can.gz"))],
        pattern: Some(PatternInput::File(scenes.join(format!("{name}.8")))),
        soil: Some(soil),
        bands: vec![band("PAR", "par.opt"), band("NIR", "nir.opt")],
        light: Some(LightInput::File(scenes.join("clear.light"))),
        ..Inputs::default()
    })
    .unwrap()
}

#[test]
fn sample_scenes_have_the_organs_and_areas_of_the_reference() {
    let Some(folder) = shared() else { return };
    for (name, soil, triangles, area_index) in [
        ("maize_rows", -0.002, 63_786, 4.7),
        ("bean_rows", -0.01, 117_915, 5.4),
    ] {
        let Loaded {
            scene, inspection, ..
        } = rows(&folder, name, soil);
        assert_eq!(inspection.triangles, triangles);
        assert_eq!(inspection.plants, 8);
        assert!((inspection.area_index.unwrap() - area_index).abs() < 0.06);
        assert_eq!(scene.light.suns.len(), 47);
        assert_eq!(scene.optics.bands[1].materials[1].lower.rho, 0.46);

        let mut areas: HashMap<&str, f64> = HashMap::new();
        let canopy = &scene.canopy;
        for triangle in canopy.triangles() {
            let id = &canopy.organs[triangle.organ as usize].id;
            *areas.entry(id).or_default() += area(&triangle.corners_m);
        }
        let table = folder.join(format!("reference/{name}.clear.organs.csv"));
        let table = fs::read_to_string(table).unwrap();
        let mut seen = std::collections::HashSet::new();
        for line in table.lines().skip(1) {
            let fields: Vec<&str> = line.split(',').collect();
            let reference: f64 = fields[1].parse().unwrap();
            let area = areas[fields[0]];
            assert!(
                (area - reference).abs() <= 1e-6 * reference,
                "{line}: {area}"
            );
            seen.insert(fields[0]);
        }
        assert_eq!(seen.len(), areas.len());
    }
}

#[test]
fn a_large_canopy_is_read_in_no_time() {
    let Some(folder) = shared() else { return };
    let path = folder.join("scenes/bean_rows.can.gz");
    let start = std::time::Instant::now();
    let bytes = read::read(&path, read::geometry_limit(None), "CAN").unwrap();
    let unpacked = start.elapsed();
    let file = can::parse("bean_rows.can.gz", &bytes).unwrap();
    let all = start.elapsed();
    eprintln!("unpacked in {unpacked:?}, parsed after {all:?}");
    assert_eq!(file.mesh.len(), 117_915);
    // 0.1 s of work: the bound leaves room for a busy machine
    assert!(all.as_secs_f64() < 3.0, "{all:?}");
}

//! A small result, byte for byte, and what a failure leaves behind.

use std::fs;

use glam::{DVec2, DVec3};
use nestrad_common::canopy::{Kind, Material, Mesh, Organ, Pattern, Triangle};
use nestrad_engine::solution::{Estimate, ItemLight, SoilMap};

use super::*;

const BANDS: [&str; 2] = ["PAR", "NIR"];

/// A leaf, and a stem without area, far from the origin of the user's coordinates.
fn canopy() -> Canopy {
    canopy_of_organs([1, 0])
}

/// The same with triangles that are of these organs.
fn canopy_of_organs(organs: [u32; 2]) -> Canopy {
    let organ = |id: &str, plant: &str| Organ {
        species: "3".into(),
        plant: plant.into(),
        id: id.into(),
    };
    let leaf = [
        DVec3::ZERO,
        DVec3::new(1.0, 0.0, 0.0),
        DVec3::new(0.0, 1.0, 0.5),
    ];
    let triangle = |(corners_m, organ)| Triangle {
        corners_m,
        organ,
        material: u32::from(organ == 0),
    };
    let triangles = [(leaf, organs[0]), ([DVec3::ONE; 3], organs[1])];
    let mut canopy = Canopy::of_meshes(vec![Mesh::from_iter(triangles.map(triangle))]);
    canopy.organs = vec![organ("leaf 1, \"flag\"", "2"), organ("1001", "1")];
    let panel = Material::Named("panel".to_owned());
    canopy.materials = vec![Material::Leaf { species: 3 }, panel.clone()];
    canopy.declared = [(panel, Kind::Structure)].into();
    canopy.origin_m = DVec3::new(500_000.25, 100.0, -1.0);
    canopy.pattern = Some(Pattern {
        min_m: DVec2::ZERO,
        size_m: DVec2::splat(2.0),
    });
    canopy
}

fn light(scale: f64) -> ItemLight {
    ItemLight {
        irradiance_upper_W_m2: 300.0 * scale,
        irradiance_lower_W_m2: 20.0 * scale,
        absorbed_W: 100.0 * scale / 3.0,
        absorbed_direct_W: 30.0 * scale,
        absorbed_se_W: 0.125 * scale,
    }
}

fn solution() -> Solution {
    let irradiance = |value| Estimate { value, se: 0.5 };
    Solution {
        organs: vec![ItemLight::default(), light(0.0), light(1.0), light(0.1)],
        triangles: vec![light(1.0), light(0.1), light(1.0), light(1.0)],
        organ_bias_W: vec![0.0, 0.0, 0.25, 0.0],
        organ_area_m2: vec![0.0, 0.625],
        triangle_area_m2: vec![0.625, 0.0],
        soil: Some(SoilMap {
            min_m: DVec2::new(0.0, -1.0),
            cell_m: DVec2::new(2.0, 1.0),
            nx: 1,
            ny: 2,
            irradiance_W_m2: vec![
                irradiance(1.0),
                irradiance(2.0),
                irradiance(3.0),
                irradiance(4.0),
            ],
        }),
        ..Solution::default()
    }
}

fn summary() -> Summary<'static> {
    Summary {
        version: "0.1.0",
        options: &(),
        scene: &(),
        plan: &(),
        energy_balance: &[],
        error_estimates: &(),
        counters: &(),
        stages: &[],
        resources: Default::default(),
    }
}

fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(dir)
        .expect("a folder")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}

const CSV: Formats = Formats {
    table: TableFormat::Csv,
    vtp: false,
};
const PARQUET_AND_VTP: Formats = Formats {
    table: TableFormat::Parquet,
    vtp: true,
};

#[test]
fn tables_byte_for_byte() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("new").join("out");
    write_all(&out, &canopy(), &BANDS, &solution(), CSV, &summary()).expect("written");
    let read = |name: &str| fs::read_to_string(out.join(name)).expect("a file");
    assert_eq!(
        names(&out),
        ["organs.csv", "soil.csv", "summary.json", "triangles.csv"]
    );
    assert_eq!(
        read("organs.csv"),
        r#"species,plant,organ,kind,area_m2,band,irradiance_upper_W_m2,irradiance_lower_W_m2,absorbed_W,absorbed_direct_W,absorbed_se_W,absorbed_bias_W
3,2,"leaf 1, ""flag""",structure,0.0,PAR,0.0,0.0,0.0,0.0,0.0,0.0
3,2,"leaf 1, ""flag""",structure,0.0,NIR,0.0,0.0,0.0,0.0,0.0,0.0
3,1,1001,leaf,0.625,PAR,300.0,20.0,33.3333333,30.0,0.125,0.25
3,1,1001,leaf,0.625,NIR,30.0,2.0,3.33333333,3.0,0.0125,0.0
"#
    );
    assert_eq!(
        read("triangles.csv"),
        r#"triangle,species,plant,organ,kind,area_m2,band,irradiance_upper_W_m2,irradiance_lower_W_m2,absorbed_W_m2,absorbed_direct_W_m2,absorbed_se_W_m2
0,3,1,1001,leaf,0.625,PAR,300.0,20.0,53.3333333,48.0,0.2
0,3,1,1001,leaf,0.625,NIR,30.0,2.0,5.33333333,4.8,0.02
1,3,2,"leaf 1, ""flag""",structure,0.0,PAR,0.0,0.0,0.0,0.0,0.0
1,3,2,"leaf 1, ""flag""",structure,0.0,NIR,0.0,0.0,0.0,0.0,0.0
"#
    );
    assert_eq!(
        read("soil.csv"),
        r#"ix,iy,x_m,y_m,cell_x_m,cell_y_m,band,irradiance_W_m2,irradiance_se_W_m2
0,0,500001.25,99.5,2.0,1.0,PAR,1.0,0.5
0,0,500001.25,99.5,2.0,1.0,NIR,2.0,0.5
0,1,500001.25,100.5,2.0,1.0,PAR,3.0,0.5
0,1,500001.25,100.5,2.0,1.0,NIR,4.0,0.5
"#
    );
}

#[test]
fn another_format_replaces_all_of_an_earlier_result() {
    let dir = tempfile::tempdir().expect("a folder");
    fs::write(dir.path().join("notes.txt"), "the user's own").expect("written");
    write_all(dir.path(), &canopy(), &BANDS, &solution(), CSV, &summary()).expect("written");
    let mut bare = solution();
    bare.soil = None;
    write_all(
        dir.path(),
        &canopy(),
        &BANDS,
        &bare,
        PARQUET_AND_VTP,
        &summary(),
    )
    .expect("written");
    assert_eq!(
        names(dir.path()),
        [
            "canopy.vtp",
            "notes.txt",
            "organs.parquet",
            "summary.json",
            "triangles.parquet"
        ]
    );
}

#[test]
fn a_bad_number_leaves_the_earlier_result_alone() {
    let dir = tempfile::tempdir().expect("a folder");
    write_all(dir.path(), &canopy(), &BANDS, &solution(), CSV, &summary()).expect("written");
    let before = fs::read(dir.path().join("organs.csv")).expect("a file");
    let mut bad = solution();
    bad.organs[3].absorbed_W = 5.0;
    bad.triangles[1].absorbed_W = f64::NAN;
    for formats in [CSV, PARQUET_AND_VTP] {
        let error = write_all(dir.path(), &canopy(), &BANDS, &bad, formats, &summary())
            .expect_err("refused");
        let OutputError::File { path, fault } = error else {
            panic!("{error}")
        };
        assert!(path.to_string_lossy().contains("triangles."), "{path:?}");
        assert_eq!(
            fault.to_string(),
            "absorbed_W_m2 in row 1 is NaN, not a finite number"
        );
        assert_eq!(
            names(dir.path()),
            ["organs.csv", "soil.csv", "summary.json", "triangles.csv"]
        );
        assert_eq!(
            fs::read(dir.path().join("organs.csv")).expect("a file"),
            before
        );
    }
}

#[test]
fn staged_files_appear_only_when_committed() {
    let dir = tempfile::tempdir().expect("a folder");
    let staged = stage(dir.path(), &canopy(), &BANDS, &solution(), CSV).expect("staged");
    assert!(
        names(dir.path())
            .iter()
            .all(|name| name.starts_with(".nestrad-"))
    );
    drop(staged);
    assert!(names(dir.path()).is_empty());
}

#[test]
fn a_solution_of_another_canopy_is_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let refused = |change: fn(&mut Canopy, &mut Solution)| {
        let (mut canopy, mut solution) = (canopy(), solution());
        change(&mut canopy, &mut solution);
        stage(dir.path(), &canopy, &BANDS, &solution, CSV)
            .expect_err("refused")
            .to_string()
    };
    assert_eq!(
        refused(|_, solution| solution.triangles.truncate(3)),
        "the solution does not fit the scene: 3 triangle values instead of 4"
    );
    assert_eq!(
        refused(|canopy, _| *canopy = canopy_of_organs([2, 0])),
        "the solution does not fit the scene: 2 organs instead of 3"
    );
    refused(|_, solution| solution.organ_area_m2.clear());
    refused(|_, solution| solution.organ_bias_W.clear());
    refused(|_, solution| solution.soil.iter_mut().for_each(|soil| soil.nx = 3));
    assert!(names(dir.path()).is_empty());
}

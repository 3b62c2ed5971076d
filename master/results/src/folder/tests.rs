//! A small result, byte for byte, and what a failure leaves behind.

use std::fs;

use glam::{DVec2, DVec3};
use nestrad_common::canopy::{Kind, Material, Mesh, Organ, Pattern, Triangle};
use nestrad_common::sensors::{Receives, Sensor, Shape};
use nestrad_engine::solution::{Estimate, ItemLight, Reading, SensorLight, SoilMap};

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
        organ_sunlit_m2: [(0.0, 0.0), (0.5, 0.01)]
            .map(|(value, se)| Estimate { value, se })
            .into(),
        readings: readings(),
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

/// The lower side of a cell of a grid, a sphere, and what it sees from a side.
fn readings() -> Vec<Reading> {
    let light = |scale: f64| SensorLight {
        direct: Estimate {
            value: 10.0 * scale,
            se: 3.0 * scale,
        },
        scattered: Estimate {
            value: 20.0 * scale,
            se: 4.0 * scale,
        },
        bias: 0.5 * scale,
    };
    let cell = Shape::Parallelogram(DVec3::new(0.0, 0.0, 0.5), [2.0 * DVec3::X, 2.0 * DVec3::Y]);
    let bud = Shape::Point(DVec3::Z);
    let lower = Receives::Side {
        facing: -DVec3::Z,
        lower: true,
    };
    let reading = |(name, shape, receives): (&str, Shape, Receives)| Reading {
        sensor: Sensor {
            name: name.to_owned(),
            shape,
            receives,
            rays: 64,
        },
        light: vec![light(1.0), light(0.1)],
    };
    [
        ("floor", cell, lower),
        ("bud", bud, Receives::Everywhere),
        ("bud", bud, Receives::From(DVec3::X)),
    ]
    .map(reading)
    .into()
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
        [
            "organs.csv",
            "radiance.csv",
            "sensors.csv",
            "soil.csv",
            "summary.json",
            "triangles.csv"
        ]
    );
    assert_eq!(
        read("organs.csv"),
        r#"species,plant,organ,kind,area_m2,band,irradiance_upper_W_m2,irradiance_lower_W_m2,absorbed_W,absorbed_direct_W,absorbed_se_W,absorbed_bias_W,sunlit_area_m2,shaded_area_m2,sunlit_area_se_m2
3,2,"leaf 1, ""flag""",structure,0.0,PAR,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0
3,2,"leaf 1, ""flag""",structure,0.0,NIR,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0
3,1,1001,leaf,0.625,PAR,300.0,20.0,33.3333333,30.0,0.125,0.25,0.5,0.125,0.01
3,1,1001,leaf,0.625,NIR,30.0,2.0,3.33333333,3.0,0.0125,0.0,0.5,0.125,0.01
"#
    );
    assert_eq!(
        read("sensors.csv"),
        r#"name,x_m,y_m,z_m,side,band,irradiance_direct_W_m2,irradiance_scattered_W_m2,irradiance_W_m2,irradiance_direct_se_W_m2,irradiance_scattered_se_W_m2,irradiance_se_W_m2,irradiance_bias_W_m2
floor,500001.25,101.0,-0.5,lower,PAR,10.0,20.0,30.0,3.0,4.0,5.0,0.5
floor,500001.25,101.0,-0.5,lower,NIR,1.0,2.0,3.0,0.3,0.4,0.5,0.05
bud,500000.25,100.0,0.0,sphere,PAR,10.0,20.0,30.0,3.0,4.0,5.0,0.5
bud,500000.25,100.0,0.0,sphere,NIR,1.0,2.0,3.0,0.3,0.4,0.5,0.05
"#
    );
    assert_eq!(
        read("radiance.csv"),
        r#"name,x_m,y_m,z_m,from_x,from_y,from_z,band,radiance_sky_W_m2_sr,radiance_scattered_W_m2_sr,radiance_W_m2_sr,radiance_se_W_m2_sr,radiance_bias_W_m2_sr
bud,500000.25,100.0,0.0,1.0,0.0,0.0,PAR,10.0,20.0,30.0,5.0,0.5
bud,500000.25,100.0,0.0,1.0,0.0,0.0,NIR,1.0,2.0,3.0,0.5,0.05
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
    bare.readings.clear();
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
    let all = names(dir.path());
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
        assert_eq!(names(dir.path()), all);
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
    refused(|_, solution| solution.organ_sunlit_m2.truncate(1));
    refused(|_, solution| solution.readings[1].light.clear());
    refused(|_, solution| solution.soil.iter_mut().for_each(|soil| soil.nx = 3));
    assert!(names(dir.path()).is_empty());
}

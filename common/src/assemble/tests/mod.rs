//! From files to scenes, and from bad files to messages.

mod light;
mod organs;
mod sensors;

use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;

use super::*;
use crate::canopy::Material;
use crate::inputs::{BandInput, PatternInput};
use crate::light::Sky;
use crate::optics::LeafOptics;
use crate::options::{Unit, Up};

const LEAF: &str = "p 1 100001001001 3 0 0 1 1 0 1 0 1 1\n";

/// A folder with a small valid scene, of which a test changes what it is about.
struct Case {
    folder: TempDir,
    inputs: Inputs,
}

impl Case {
    fn new(can: &str) -> Self {
        let mut case = Self {
            folder: tempfile::tempdir().unwrap(),
            inputs: Inputs::default(),
        };
        case.inputs.scenes = vec![case.file("a.can", can)];
        let optics = case.file("a.opt", "n 1\ns d 0.15\ne d 0.12 d 0.09 0.05 d 0.11 0.05\n");
        case.inputs.bands = vec![BandInput {
            name: "PAR".into(),
            optics: Some(optics),
            ..BandInput::default()
        }];
        let light = case.file("a.light", "100 0 0 -1\n");
        case.inputs.light = Some(LightInput::File(light));
        case
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.folder.path().join(name);
        fs::write(&path, text).unwrap();
        path
    }

    fn pattern(mut self, corners: [f64; 4]) -> Self {
        self.inputs.pattern = Some(PatternInput::Corners(corners));
        self
    }

    fn soil(mut self, height: f64) -> Self {
        self.inputs.soil = Some(height);
        self
    }

    fn loaded(&self) -> Loaded {
        load(&self.inputs).unwrap()
    }

    /// The message, without the name of the folder.
    fn refusal(&self) -> String {
        let message = load(&self.inputs).unwrap_err().to_string();
        message.replace(&format!("{}/", self.folder.path().display()), "")
    }
}

#[test]
fn a_scene_is_moved_to_the_lower_corner_of_its_pattern() {
    let case = Case::new(LEAF).pattern([3.0, 2.0, -1.0, -2.0]).soil(-0.5);
    let scene = case.loaded().scene.canopy;
    assert_eq!(scene.origin_m.to_array(), [-1.0, -2.0, 1.0]);
    assert_eq!(scene.triangle(0).corners_m[0].to_array(), [1.0, 2.0, 0.0]);
    let pattern = scene.pattern.unwrap();
    assert_eq!(pattern.min_m.to_array(), [0.0, 0.0]);
    assert_eq!(pattern.size_m.to_array(), [4.0, 4.0]);
    assert_eq!(scene.soil_z_m, Some(-1.5));
}

#[test]
fn fault_results_do_not_depend_on_the_unit_of_length() {
    let numbers = [0.123_456_7, -0.25, 1.0, 1.000_3, 0.1, 1.01, 0.3, 0.7, 0.9];
    let scene = |unit: Unit| {
        let scale = unit.per_metre();
        let texts = numbers.map(|x| format!("{}", x * scale));
        let line = format!("p 1 100001001001 3 {}", texts.join(" "));
        let mut case = Case::new(&line)
            .pattern([-0.4, -0.75, 0.4, 0.75].map(|x| x * scale))
            .soil(-0.002 * scale);
        case.inputs.unit = Some(unit);
        case.loaded().scene.canopy
    };
    let metres = scene(Unit::Metre);
    for other in [scene(Unit::Centimetre), scene(Unit::Millimetre)] {
        for (a, b) in metres
            .triangle(0)
            .corners_m
            .iter()
            .zip(&other.triangle(0).corners_m)
        {
            assert!(a.abs_diff_eq(*b, 1e-15));
        }
        let (a, b) = (metres.pattern.unwrap(), other.pattern.unwrap());
        assert!(a.size_m.abs_diff_eq(b.size_m, 1e-15));
        assert!((metres.soil_z_m.unwrap() - other.soil_z_m.unwrap()).abs() < 1e-15);
    }
}

#[test]
fn with_y_up_the_scene_is_the_one_that_stands() {
    let lying = |text: &str| {
        let mut case = Case::new("").pattern([-1.0, -2.0, 1.0, 2.0]).soil(0.25);
        case.inputs.up = Some(Up::Y);
        let scene = case.file("a.obj", text);
        case.inputs.scenes = vec![
            scene,
            case.file("b.can", &LEAF.replace("0 1 1\n", "0 2 1\n")),
        ];
        case.inputs.bands[0]
            .materials
            .insert("default".to_owned(), LeafOptics::opaque(0.1));
        case.loaded().scene.canopy
    };
    // x to the right, y up, z to the viewer; the left-hand face looks up once it stands
    let scene = lying("v 0 0.5 0\nv 1 0.5 0\nv 1 0.5 -1\nf 1 2 3\n");
    let user = |t: usize| {
        scene
            .triangle(t)
            .corners_m
            .map(|v| (v + scene.origin_m).to_array())
    };
    assert_eq!(user(0), [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [1.0, 1.0, 0.5]]);
    assert_eq!(
        user(1),
        [[0.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, -1.0, 2.0]]
    );
    assert_eq!(scene.soil_z_m, Some(0.25));
    assert_eq!(scene.pattern.unwrap().size_m.to_array(), [2.0, 4.0]);
    assert_eq!(scene.origin_m.z, 0.0);
}

#[test]
fn a_scene_of_an_odd_size_has_an_odd_unit() {
    for (size, warns) in [
        ("0.0099", true),
        ("0.01", false),
        ("1e4", false),
        ("1.01e4", true),
    ] {
        let can = LEAF.replace(
            "3 0 0 1 1 0 1 0 1 1",
            &format!("3 0 0 0 {size} 0 0 0 0 {size}"),
        );
        let warnings = Case::new(&can).loaded().inspection.warnings;
        let unit = "the unit may be wrong (m, cm or mm)";
        assert_eq!(warnings.iter().any(|w| w.ends_with(unit)), warns, "{size}");
    }
}

#[test]
fn fault_a_scene_far_from_the_origin_is_the_same_scene() {
    let far = LEAF.replace(
        "3 0 0 1 1 0 1 0 1 1",
        "3 9e5 -9e5 1 900001 -9e5 1 9e5 -899999 1",
    );
    let near = Case::new(LEAF)
        .pattern([0.0, 0.0, 1.0, 1.0])
        .soil(0.0)
        .loaded();
    let far = Case::new(&far)
        .pattern([9e5, -9e5, 900_001.0, -899_999.0])
        .soil(0.0)
        .loaded();
    let corners = |loaded: &Loaded| loaded.scene.canopy.corners_m().collect::<Vec<_>>();
    assert_eq!(corners(&near), corners(&far));
    assert_eq!(near.scene.canopy.pattern, far.scene.canopy.pattern);
    assert_eq!(near.inspection.area_index, far.inspection.area_index);
    assert!(far.inspection.warnings.is_empty());
}

#[test]
fn fault_overhang_past_the_pattern_is_kept_and_reported() {
    let loaded = Case::new(LEAF).pattern([0.0, 0.0, 0.25, 2.0]).loaded();
    assert_eq!(loaded.scene.canopy.len(), 1);
    assert_eq!(loaded.inspection.overhang_m, 0.75);
    assert_eq!(loaded.inspection.area_index, Some(1.0));
    assert!(loaded.inspection.warnings.is_empty());

    let loaded = Case::new(LEAF).pattern([0.0, 0.0, 0.01, 0.01]).loaded();
    assert!(loaded.inspection.warnings[0].ends_with("is the unit right?"));
}

#[test]
fn fault_an_unknown_species_is_refused() {
    let case = Case::new(&format!("{LEAF}\np 1 300002001001 3 0 0 1 1 0 1 0 1 1\n"));
    assert_eq!(
        case.refusal(),
        "a.can, line 3: species 3 is not in a.opt, which has 1 (band PAR)"
    );
}

#[test]
fn an_empty_scene_is_refused() {
    assert_eq!(
        Case::new("# nothing\n").refusal(),
        "a.can: expected at least one triangle, found none"
    );
}

#[test]
fn what_is_missing_is_named() {
    let mut case = Case::new(LEAF);
    case.inputs.light = None;
    assert_eq!(
        case.refusal(),
        "expected light (--light or --sky, or light in a scene file), found none"
    );
    case.inputs.scenes.clear();
    assert_eq!(
        case.refusal(),
        "expected a scene: a CAN or OBJ file, found none"
    );
    case.inputs.bands.clear();
    assert_eq!(
        case.refusal(),
        "expected at least one band with its optics (--optics, or [[bands]] in a scene file), found none"
    );

    let mut case = Case::new(LEAF);
    case.inputs.scenes = vec![case.folder.path().join("no.can")];
    assert!(case.refusal().starts_with("no.can: cannot be read: "));
}

#[test]
fn patterns_without_area_and_soil_nowhere_are_refused() {
    let case = Case::new(LEAF).pattern([1.0, 0.0, 1.0, 5.0]);
    assert_eq!(
        case.refusal(),
        "pattern: expected corners 1e-9 or more apart in x and in y, in the file's unit and in metres, found 1 0 1 5"
    );
    for bad in [f64::NAN, f64::NEG_INFINITY, 2e12] {
        let refusal = Case::new(LEAF).soil(bad).refusal();
        assert!(refusal.starts_with("soil height: expected a finite number"));
    }
}

#[test]
fn bands_must_differ_in_name() {
    let mut case = Case::new(LEAF);
    case.inputs.bands.push(case.inputs.bands[0].clone());
    assert!(
        case.refusal()
            .ends_with("found 'PAR' twice, empty or too long")
    );
}

#[test]
fn materials_by_name_come_from_the_scene_file() {
    let mut case = Case::new("");
    let square = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl leaf\nf 1 2 3\nusemtl bark\nf 1 2 3\n";
    case.file("a.obj", square);
    let scene_file = "scene = 'a.obj'\n\n[[bands]]\nname = 'PAR'\n[bands.materials]\n\
                      leaf = { rho = 0.1, tau = 0.1 }\n[light.sky]\nkind = 'standard_overcast'\n\
                      irradiance_W_m2 = { PAR = 100 }\n";
    case.inputs = load_scene_file(&case.file("scene.toml", scene_file)).unwrap();
    assert_eq!(
        case.refusal(),
        "a.obj, line 7: material 'bark' has no optical properties in band PAR (scene.toml, line 3)"
    );
    let complete = scene_file.replace("leaf =", "bark = { rho = 0.3 }\nleaf =");
    case.inputs = load_scene_file(&case.file("scene.toml", &complete)).unwrap();
    let loaded = case.loaded();
    assert_eq!(loaded.scene.optics.bands[0].materials[1].upper.rho, 0.3);
    assert_eq!(loaded.scene.optics.bands[0].soil_albedo, 0.0);
    assert!(loaded.scene.light.suns.is_empty());
    let expected = Sky::StandardOvercast.light(vec![100.0]).unwrap();
    assert_eq!(*loaded.scene.light, expected);

    case.inputs.soil = Some(0.0);
    assert_eq!(
        case.refusal(),
        "band PAR (scene.toml, line 3) has no soil albedo, but the scene has soil"
    );
    case.inputs.bands[0].soil_albedo = Some(1.5);
    assert!(
        case.refusal()
            .starts_with("soil in band PAR (scene.toml, line 3): rho = 1.5")
    );
}

#[test]
fn files_are_joined_by_the_names_of_materials() {
    let mut case = Case::new(&format!("{LEAF}p 1 0 3 0 0 0 1 0 0 0 1 0\n"));
    let second = "\np 1 100001002001 3 0 0 2 1 0 2 0 1 2\np 1 100001002009 3 0 0 3 1 0 3 0 1 3\n\
                  p 1 0 3 0 0 0 1 0 0 0 1 0\np 1 400001003001 3 0 0 1 1 0 1 0 1 1\n";
    case.inputs.scenes.push(case.file("b.can", second));
    // the species that is missing is in the second file
    assert!(
        case.refusal()
            .starts_with("b.can, line 5: species 4 is not in a.opt")
    );

    let known = second.replace("400001003001", "100001003001");
    case.file("b.can", &known);
    let scene = case.loaded().scene.canopy;
    let organ: Vec<u32> = scene.triangles().map(|t| t.organ).collect();
    // soil is nobody's organ, and may be in all files
    assert_eq!(organ, [0, 1, 2, 2, 1, 3]);
    let material: Vec<u32> = scene.triangles().map(|t| t.material).collect();
    assert_eq!(material, [0, 1, 0, 0, 1, 0]);
    assert_eq!(scene.materials[1], Material::Soil);
}

#[test]
fn odd_triangles_are_kept_and_reported() {
    let text = format!(
        "{LEAF}p 1 100001001001 3 1 0 1 0 0 1 0 1 1\n\
         p 1 100001001001 3 0.1 0.1 1 0.2 0.2 1 0.3 0.3 1\np 1 100001001001 3 5 5 5 5 5 5 5 5 5\n\
         p 1 100001001001 3 0 0 1 1 0 1 0 1 -1\n"
    );
    let loaded = Case::new(&text).soil(0.0).loaded();
    assert_eq!(loaded.scene.canopy.len(), 5);
    let facts = loaded.inspection;
    assert_eq!(
        (facts.degenerate, facts.duplicates, facts.below_soil),
        (2, 1, 1)
    );
    assert_eq!((facts.organs, facts.plants), (1, 1));
    assert_eq!(facts.smallest_m2, 0.5);
    let warnings: Vec<&str> = facts
        .warnings
        .iter()
        .filter_map(|warning| warning.split_once(", the first in ").map(|(what, _)| what))
        .collect();
    assert_eq!(
        warnings,
        [
            "2 triangles without area, for which no light is computed",
            "1 triangle with the same vertices as an earlier one",
            "1 triangle partly or wholly below the soil plane",
        ]
    );
    assert!(facts.warnings[0].ends_with("a.can, line 3"));
    assert!(facts.warnings[1].ends_with("a.can, line 2"));
    assert!(facts.warnings[2].ends_with("a.can, line 5"));
}

#[test]
fn soil_triangles_are_no_part_of_the_area_index() {
    let text = format!("{LEAF}p 1 0 4 0 0 0 2 0 0 2 2 0 0 2 0\n");
    let facts = Case::new(&text)
        .pattern([0.0, 0.0, 2.0, 2.0])
        .loaded()
        .inspection;
    assert_eq!(facts.area_index, Some(0.125));
    assert_eq!(facts.materials[1].name, "soil");
    assert_eq!(
        (facts.materials[1].triangles, facts.materials[1].area_m2),
        (2, 4.0)
    );
}

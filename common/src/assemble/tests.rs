//! From files to scenes, and from bad files to messages.

use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;

use super::*;
use crate::canopy::{Kind, Material};
use crate::inputs::BandInput;
use crate::light::Sky;
use crate::options::Unit;

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
        "pattern: expected corners that differ in x and in y, found 1 0 1 5"
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
    assert!(case.refusal().ends_with("found 'PAR' twice or empty"));
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
fn fault_organs_of_two_species_with_equal_numbers_became_one() {
    let case = Case::new(&format!("{LEAF}p 1 200001001001 3 0 0 2 1 0 2 0 1 2\n"));
    case.file(
        "a.opt",
        "n 2\ns d 0.15\ne d 0.1 d 0.1 0.1 d 0.1 0.1\ne d 0.2 d 0.2 0.2 d 0.2 0.2\n",
    );
    let loaded = case.loaded();
    let organs = loaded.scene.canopy.organs.iter();
    let names: Vec<[&str; 3]> = organs
        .map(|organ| [&organ.species[..], &organ.plant, &organ.id])
        .collect();
    assert_eq!(names, [["1", "1", "1001"], ["2", "1", "1001"]]);
    assert_eq!((loaded.inspection.organs, loaded.inspection.plants), (2, 2));
}

/// Two trees in files of their own, with the same names of objects and groups.
fn trees(first: &str, second: &str) -> Case {
    let mut case = Case::new("");
    let tree = "o 1\ng leaf\nusemtl leaf\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for folder in ["p", "q"] {
        fs::create_dir(case.folder.path().join(folder)).unwrap();
    }
    let files = [case.file(first, tree), case.file(second, tree)];
    let bands = "[[bands]]\nname = 'PAR'\n[bands.materials]\nleaf = { rho = 0.1 }\n";
    case.inputs.scenes = files.into();
    let file = case.file("scene.toml", bands);
    case.inputs.bands = load_scene_file(&file).unwrap().bands;
    case
}

#[test]
fn fault_organs_of_two_obj_files_with_equal_names_became_one() {
    for (first, second, expected) in [
        ("oak.obj", "elm.obj", ["oak", "elm"]),
        ("p/tree.obj", "q/tree.obj", ["p/tree.obj", "q/tree.obj"]),
        ("oak.obj", "oak.v2.obj", ["oak", "oak.v2"]),
    ] {
        let loaded = trees(first, second).loaded();
        let organs = &loaded.scene.canopy.organs;
        let species: Vec<&str> = organs.iter().map(|organ| &organ.species[..]).collect();
        assert_eq!(species, expected);
        assert_eq!((loaded.inspection.organs, loaded.inspection.plants), (2, 2));
    }
}

#[test]
fn fault_organs_of_two_files_with_one_name_became_one() {
    let mut case = Case::new(LEAF);
    let second = format!("p 1 100001002001 3 0 0 1 1 0 1 0 1 1\n{LEAF}");
    case.inputs.scenes.push(case.file("b.can", &second));
    assert_eq!(
        case.refusal(),
        "b.can, line 2: organ 1001 of plant 1 of species 1 is in a.can, line 1 already; \
         expected every organ in one file: number plants or species through all files"
    );
    // one file twice
    let refusal = trees("oak.obj", "p/../oak.obj").refusal();
    assert!(
        refusal.starts_with(
            "p/../oak.obj, line 7: organ leaf of plant 1 of species oak.obj is in oak.obj"
        ),
        "{refusal}"
    );
}

#[test]
fn kinds_are_declared_for_materials_and_species() {
    let mut case = Case::new(&format!("{LEAF}p 1 200002000001 3 0 0 2 1 0 2 0 1 2\n"));
    case.file(
        "a.opt",
        "n 2\ns d 0.15\ne d 0.1 d 0.1 0.1 d 0.1 0.1\ne d 0.2 d 0.2 0.2 d 0.2 0.2\n",
    );
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\no a\nusemtl bark\nf 1 2 3\nusemtl earth\nf 1 2 3\n\
                o b\nusemtl bark\nf 1 2 3\n";
    case.inputs.scenes.push(case.file("b.obj", text));
    let declared = "[kinds]\nmaterials = { bark = 'stem', earth = 'soil', pannel = 'structure' }\n\
                    species = { 2 = 'structure', 7 = 'soil' }\n\
                    [[bands]]\nname = 'PAR'\noptics = 'a.opt'\n\
                    [bands.materials]\nbark = { rho = 0.3 }\nearth = { rho = 0.2 }\n";
    let file = case.file("scene.toml", declared);
    let said = load_scene_file(&file).unwrap();
    (case.inputs.kinds, case.inputs.bands) = (said.kinds, said.bands);
    let loaded = case.loaded();
    let canopy = &loaded.scene.canopy;
    let (stem, soil, built) = (Kind::Stem, Kind::Soil, Kind::Structure);
    assert_eq!(canopy.kinds(), [Kind::Leaf, built, stem, soil]);
    // a structure has two faces, a stem of OBJ is no solid
    assert_eq!(canopy.solid(), [false; 4]);
    assert_eq!(canopy.plants(), [true, false, true, true]);
    let organs = [Some(Kind::Leaf), Some(built), None, Some(stem)];
    assert_eq!(canopy.organ_kinds(), organs);
    let facts = &loaded.inspection;
    assert_eq!((facts.organs, facts.plants), (4, 3));
    // of leaves and stems alone
    assert_eq!(facts.area_index, Some(1.5));
    assert_eq!(
        facts.warnings[facts.warnings.len() - 2..],
        [
            "a kind is given for material 'pannel', which the scene does not have",
            "a kind is given for species 7, which the scene does not have",
        ]
    );

    case.file(
        "scene.toml",
        &declared.replace("earth = { rho = 0.2 }", "earth = { rho = 0.2, tau = 0.1 }"),
    );
    case.inputs.bands = load_scene_file(&file).unwrap().bands;
    assert_eq!(
        case.refusal(),
        "earth in band PAR (scene.toml, line 4): expected tau = 0, because it is declared to be soil"
    );
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

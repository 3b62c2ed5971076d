//! What organs are known by, and what they count as.

use super::*;
use crate::canopy::Kind;

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
         expected each organ in one file only: give plants or species of each file other numbers"
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
    // a structure has two faces, an opaque stem may be solid in any format
    assert_eq!(canopy.may_be_solid(), [false, false, true, false]);
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

//! Species and kinds, from files to tables.

use serde_json::Value;

use super::desk::Desk;

/// Two plants of two species with equal numbers, and a panel above them.
const CAN: &str = "\
p 1 100001001001 3 0.10 0.10 0.25 0.45 0.12 0.28 0.20 0.40 0.30
p 1 200001001001 3 0.60 0.60 0.20 0.95 0.62 0.22 0.70 0.90 0.25
p 1 300001001001 4 0.00 0.00 1.00 0.50 0.00 1.00 0.50 1.00 1.00 0.00 1.00 1.00
";
const OPT: &str = "\
n 3
s d 0.15
e d 0.12 d 0.09 0.05 d 0.11 0.05
e d 0.12 d 0.19 0.05 d 0.11 0.05
e d 0.12 d 0.05 0.60 d 0.05 0.60
";
const KINDS: &str = "[kinds]\nspecies = { 3 = \"structure\" }\n";

fn desk(kinds: &str) -> Desk {
    let desk = Desk::new();
    desk.put("plants.can", CAN);
    for opt in ["par.opt", "nir.opt"] {
        desk.put(opt, OPT);
    }
    let scene = desk
        .text("scene.toml")
        .replace("[[bands]]\nname = \"PAR\"", kinds);
    desk.put("scene.toml", scene);
    desk
}

fn with_kinds() -> Desk {
    desk(&format!("{KINDS}[[bands]]\nname = \"PAR\""))
}

/// The columns of these names, row by row.
fn columns<const N: usize>(table: &str, names: [&str; N]) -> Vec<[String; N]> {
    let mut lines = table
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let head = lines.next().unwrap();
    let places = names.map(|name| head.iter().position(|column| *column == name).unwrap());
    lines
        .map(|cells| places.map(|place| cells[place].to_owned()))
        .collect()
}

#[test]
fn fault_two_species_with_equal_numbers_were_one_row() {
    let desk = with_kinds();
    desk.done(&["solve", "scene.toml", "--out", "out"]);
    let names = ["species", "plant", "organ", "kind", "band"];
    let expected = ["1", "2", "3"].map(|species| {
        let kind = if species == "3" { "structure" } else { "leaf" };
        ["PAR", "NIR"].map(|band| [species, "1", "1001", kind, band])
    });
    assert_eq!(
        columns(&desk.text("out/organs.csv"), names),
        expected.concat()
    );
    let triangles = columns(
        &desk.text("out/triangles.csv"),
        ["triangle", "species", "kind"],
    );
    assert_eq!(triangles[0], ["0", "1", "leaf"]);
    assert_eq!(triangles[7], ["3", "3", "structure"]);
}

#[test]
fn fault_a_panel_was_a_plant() {
    let desk = with_kinds();
    let ran = desk.done(&["solve", "scene.toml", "--out", "out"]);
    for part in ["structures", "absorbed by", "leaf of species 3  structure"] {
        assert!(ran.stdout.contains(part), "{part}: {}", ran.stdout);
    }
    let summary: Value = serde_json::from_str(&desk.text("out/summary.json")).unwrap();
    let absorbed = columns(&desk.text("out/organs.csv"), ["band", "kind", "absorbed_W"]);
    for balance in summary["energy_balance"].as_array().unwrap() {
        let of_kind = |kind: &str| -> f64 {
            let rows = absorbed.iter();
            let rows = rows.filter(|row| balance["band"] == row[0] && row[1] == kind);
            rows.map(|row| row[2].parse::<f64>().unwrap()).sum()
        };
        let value = |name: &str| balance[name]["value"].as_f64().unwrap();
        for (name, kind) in [
            ("absorbed_plants_W", "leaf"),
            ("absorbed_leaves_W", "leaf"),
            ("absorbed_structures_W", "structure"),
        ] {
            let (all, organs) = (value(name), of_kind(kind));
            assert!(organs > 0.0 && (all - organs).abs() < 1e-7 * all, "{name}");
        }
        let materials = balance["materials"].as_array().unwrap();
        assert_eq!(materials.len(), 3);
        assert_eq!(materials[2]["name"], "leaf of species 3");
        assert_eq!(materials[2]["kind"], "structure");
        let [panel, all] = [
            materials[2]["absorbed_W"]["value"].as_f64().unwrap(),
            value("absorbed_structures_W"),
        ];
        assert_eq!(panel, all);
    }
    assert_eq!(summary["scene"]["plants"], 2);

    // the page has them too, without the scene file
    desk.done(&["report", "out"]);
    let page = desk.text("out/report.html");
    assert!(page.contains("\"absorbed_structures_W\"") && page.contains("\"structure\""));
}

#[test]
fn what_is_declared_changes_no_number() {
    let (plain, declared) = (desk("[[bands]]\nname = \"PAR\""), with_kinds());
    let tables = [plain, declared].map(|desk| {
        desk.done(&["solve", "scene.toml", "--out", "out"]);
        let table = desk.text("out/organs.csv");
        columns(
            &table,
            ["species", "absorbed_W", "absorbed_se_W", "absorbed_bias_W"],
        )
    });
    assert_eq!(tables[0], tables[1]);
}

#[test]
fn kinds_of_what_is_not_there_are_a_warning() {
    let kinds = KINDS.replace('3', "4");
    let desk = desk(&format!("{kinds}[[bands]]\nname = \"PAR\""));
    let said = desk.done(&["check", "scene.toml"]).stdout;
    let warning = "a kind is given for species 4, which the scene does not have";
    assert!(said.contains(warning), "{said}");
}

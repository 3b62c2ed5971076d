//! CAN: one polygon a line, with a label that says which leaf of which plant it is.
//!
//! `p N label... V x y z ...`: N labels, of which the first counts; V vertices of a polygon.
//! From the right, a label is element (3 digits), leaf (3), plant (5), species (what is left).

use std::collections::HashMap;
use std::str;

use glam::DVec3;

use super::error::FormatError;
use super::geometry_file::{GeometryFile, numbered, vertex};
use super::lines::{Fields, Lines};
use super::polygon::{Cutter, MAX_VERTICES};
use crate::canopy::{Material, Organ};

/// Parses a CAN file (unpacked); `file` is its name in messages.
pub fn parse(file: &str, bytes: &[u8]) -> Result<GeometryFile, FormatError> {
    let mut mesh = GeometryFile::new(file);
    let mut groups = Groups::default();
    let (mut polygon, mut cutter) = (Vec::new(), Cutter::default());
    let mut lines = Lines::new(file, bytes);
    while let Some(mut fields) = lines.next()? {
        let mut found = fields.clone();
        if fields.next() != Some(b"p") {
            let expected = "'p', with which each line of a CAN file begins (the name of an OBJ file ends in .obj)";
            return Err(fields.fault(expected, found.next()));
        }
        let (organ, material) = groups.indices(&mut mesh, label(&mut fields)?);
        vertices(&mut fields, &mut polygon)?;
        mesh.push_polygon(&mut cutter, &fields, &polygon, organ, material)?;
    }
    Ok(mesh)
}

fn vertices(fields: &mut Fields<'_>, polygon: &mut Vec<DVec3>) -> Result<(), FormatError> {
    let mut found = fields.clone();
    let count = fields.count("a number of vertices")?;
    if !(3..=MAX_VERTICES).contains(&count) {
        let expected = format_args!("3 to {MAX_VERTICES} vertices").to_string();
        return Err(fields.fault(expected, found.next()));
    }
    polygon.clear();
    for number in 1..=count {
        polygon.push(vertex(fields, number)?);
    }
    fields.end()
}

/// What a label says, less the element number.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Label {
    species: u32,
    plant: u32,
    leaf: u32,
}

impl Label {
    fn is_soil(self) -> bool {
        self.species == 0
    }

    fn material(self) -> Material {
        let Self { species, leaf, .. } = self;
        match (species, leaf) {
            (0, _) => Material::Soil,
            (_, 0) => Material::Stem { species },
            _ => Material::Leaf { species },
        }
    }

    fn organ(self) -> Organ {
        // Soil is nobody's organ, whatever plant number its label has: it must not join a stem.
        if self.is_soil() {
            return Organ::soil();
        }
        Organ {
            species: self.species.to_string(),
            plant: self.plant.to_string(),
            id: (self.plant * 1000 + self.leaf).to_string(),
        }
    }
}

/// Reads the labels of a line; `p` has been read.
fn label(fields: &mut Fields<'_>) -> Result<Label, FormatError> {
    let mut found = fields.clone();
    let labels = fields.count("a number of labels")?;
    if labels == 0 {
        return Err(fields.fault("at least 1 label", found.next()));
    }
    let field = fields.required("a label")?;
    let label = decode(field).ok_or_else(|| {
        fields.fault(
            "a label of digits: species (0 only for soil, with leaf 0), plant (5), leaf (3), element (3)",
            Some(field),
        )
    })?;
    for number in 2..=labels {
        fields.required(format_args!("label {number} of {labels}"))?;
    }
    Ok(label)
}

fn decode(field: &[u8]) -> Option<Label> {
    if !field.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let digits = str::from_utf8(field).ok()?.parse::<u64>().ok()?;
    let label = Label {
        species: u32::try_from(digits / 100_000_000_000).ok()?,
        plant: u32::try_from(digits / 1_000_000 % 100_000).ok()?,
        leaf: u32::try_from(digits / 1000 % 1000).ok()?,
    };
    (!label.is_soil() || label.leaf == 0).then_some(label)
}

/// Organ and material of the labels met so far.
#[derive(Default)]
struct Groups {
    organs: HashMap<Organ, u32>,
    materials: HashMap<Material, u32>,
    known: HashMap<Label, (u32, u32)>,
    // Triangles of a leaf follow one another: most labels are the one before.
    last: Option<(Label, (u32, u32))>,
}

impl Groups {
    fn indices(&mut self, file: &mut GeometryFile, label: Label) -> (u32, u32) {
        if let Some((known, indices)) = self.last
            && known == label
        {
            return indices;
        }
        let indices = *self.known.entry(label).or_insert_with(|| {
            (
                numbered(&mut self.organs, &mut file.organs, label.organ()),
                numbered(&mut self.materials, &mut file.materials, label.material()),
            )
        });
        self.last = Some((label, indices));
        indices
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEAF: &str = "p 1 200007003001 3 0 0 1 1 0 1 0 1 1\n";

    fn parsed(text: &str) -> GeometryFile {
        parse("a.can", text.as_bytes()).unwrap()
    }

    fn corners(file: &GeometryFile) -> Vec<[DVec3; 3]> {
        let mesh = &file.mesh;
        (0..mesh.len())
            .map(|t| mesh.triangle(t).corners_m)
            .collect()
    }

    fn refusal(bytes: impl AsRef<[u8]>) -> String {
        parse("a.can", bytes.as_ref()).unwrap_err().to_string()
    }

    #[test]
    fn labels_are_read_from_the_right() {
        for (label, id, plant, material) in [
            ("100001000001", "1000", "1", Material::Stem { species: 1 }),
            (
                "1299999123001",
                "99999123",
                "99999",
                Material::Leaf { species: 12 },
            ),
            ("000000000000", "0", "0", Material::Soil),
            ("0", "0", "0", Material::Soil),
            ("000012000034", "0", "0", Material::Soil),
        ] {
            let mesh = parsed(&LEAF.replace("200007003001", label));
            assert_eq!(mesh.organs[0].id, id, "{label}");
            assert_eq!(mesh.organs[0].plant, plant, "{label}");
            assert_eq!(mesh.materials, [material], "{label}");
        }
        for label in [
            "100001x00001",
            "-1",
            "1e11",
            "99999999999999999999999",
            "1001000",
        ] {
            let line = LEAF.replace("200007003001", label);
            assert!(refusal(line).starts_with("a.can, line 1: expected a label of digits"));
        }
    }

    #[test]
    fn triangles_of_a_leaf_share_an_organ_and_the_first_label_counts() {
        let text = "# plant\n\np 2 100001001001 77 3 0 0 0 1 0 0 0 1 0 # first\n\
                    p 1 100001002001 3 0 0 0 1 0 0 0 1 0\n\
                    p 1 100001001002 3 0 0 1 1 0 1 0 1 1\n";
        let mesh = parsed(text);
        assert_eq!(mesh.mesh.organ, [0, 1, 0]);
        assert_eq!(mesh.mesh.material, [0, 0, 0]);
        assert_eq!(mesh.line, [3, 4, 5]);
    }

    #[test]
    fn polygons_are_split_and_keep_their_sides() {
        let mesh = parsed("p 1 100001001001 5 0 0 0 2 0 0 3 1 0 1 2 0 -1 1 0\n");
        assert_eq!(mesh.mesh.len(), 3);
        for [a, b, c] in corners(&mesh) {
            assert!((b - a).cross(c - a).z > 0.0);
        }
        assert_eq!((mesh.mesh.organ, mesh.line), (vec![0; 3], vec![1; 3]));
    }

    #[test]
    fn fault_a_concave_polygon_was_cut_as_a_fan() {
        let file = parsed("p 1 100001001001 6 2 0 1 2 1 1 1 1 1 1 2 1 0 2 1 0 0 1\n");
        let doubled = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
        let doubled: Vec<DVec3> = corners(&file).into_iter().map(doubled).collect();
        assert!(doubled.iter().all(|area| area.z > 0.0));
        assert_eq!(
            doubled.into_iter().sum::<DVec3>(),
            DVec3::new(0.0, 0.0, 6.0)
        );
        assert_eq!(file.line, [1; 4]);
    }

    #[test]
    fn polygons_that_cross_themselves_or_are_not_flat_are_refused() {
        let bow_tie = format!("{LEAF}p 1 100001001001 4 0 0 1 1 1 1 1 0 1 0 1 1\n");
        assert_eq!(
            refusal(bow_tie),
            "a.can, line 2: expected a polygon whose edges do not cross, found a crossing of the edges \
             that begin at vertex 1 and at vertex 3"
        );
        assert_eq!(
            refusal("p 1 100001001001 4 0 0 1 1 0 1 1 1 3 0 1 1\n"),
            "a.can, line 1: expected a nearly flat polygon, whose triangles have at most 10 % \
             more area than it has in its mean plane, found 29 % more"
        );
    }

    #[test]
    fn line_ends_of_all_systems_and_a_byte_order_mark_are_read() {
        let plain = parsed(&LEAF.repeat(2));
        for end in ["\r\n", "\r"] {
            assert_eq!(parsed(&LEAF.repeat(2).replace('\n', end)), plain);
            let error = refusal(format!("#{end}{end}p 1{end}"));
            assert!(error.starts_with("a.can, line 3: "), "{error}");
        }
        assert_eq!(parsed(&format!("\u{feff}{LEAF}{LEAF}")), plain);
        assert_eq!(parsed(&LEAF.repeat(2).replace(' ', "\t  ")), plain);
    }

    #[test]
    fn fault_a_missing_last_newline_is_no_fault() {
        assert_eq!(parsed(LEAF.trim_end()), parsed(LEAF));
    }

    #[test]
    fn fault_a_nan_vertex_is_refused() {
        for bad in ["nan", "NaN", "inf", "-infinity", "1e999"] {
            let text = format!("{LEAF}p 1 100001001001 3 0 0 1 1 {bad} 1 0 1 1\n");
            let expected =
                format!("a.can, line 2: expected y of vertex 2, a finite number, found '{bad}'");
            assert_eq!(refusal(text), expected);
        }
    }

    #[test]
    fn fault_a_missing_coordinate_is_refused() {
        assert_eq!(
            refusal("p 1 100001001001 3 0 0 1 1 0 1 0 1\n"),
            "a.can, line 1: expected z of vertex 3, a finite number, found the end of the line"
        );
        assert_eq!(
            refusal("p 1 100001001001 3 0 0 1 1 0 1 0 1 1 5\n"),
            "a.can, line 1: expected the end of the line, found '5'"
        );
    }

    #[test]
    fn fault_a_long_line_is_refused() {
        let mut text = LEAF.repeat(3).into_bytes();
        text.resize(100 << 20, b'7');
        let error = refusal(text);
        assert!(error.starts_with("a.can, line 4: expected a line of at most 1048576 bytes"));
        assert!(error.len() < 200);
    }

    #[test]
    fn fault_far_coordinates_are_taken_and_absurd_ones_refused() {
        let mesh = parsed("p 1 100001001001 3 9e5 0 1 900001 0 1 9e5 1 1\n");
        assert_eq!(corners(&mesh)[0][1].x, 900_001.0);
        let error = refusal("p 1 100001001001 3 0 0 1 1 0 -2e12 0 1 1\n");
        assert_eq!(
            error,
            "a.can, line 1: expected z of vertex 2 within 1e12 of zero, found '-2e12'"
        );
    }

    #[test]
    fn huge_and_small_counts_are_refused_before_memory_is_taken() {
        for count in ["18446744073709551615", "10001", "2", "0"] {
            let error = refusal(format!("p 1 100001001001 {count} 0 0 0\n"));
            let expected = "a.can, line 1: expected 3 to 10000 vertices, found ";
            assert_eq!(error, format!("{expected}'{count}'"));
        }
        for (labels, expected) in [
            ("0", "at least 1 label"),
            ("-1", "a number of labels, a whole number"),
            ("99999999999999999999", "a number of labels, a whole number"),
            ("4000000000", "label 12 of 4000000000"),
        ] {
            let error = refusal(LEAF.replace("p 1 ", &format!("p {labels} ")));
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn truncated_garbled_and_binary_files_are_refused() {
        for end in 1..LEAF.trim_end().len() - 1 {
            refusal(&LEAF[..end]);
        }
        assert_eq!(
            refusal(LEAF.replace("p ", "q ")),
            "a.can, line 1: expected 'p', with which each line of a CAN file begins (the name of an OBJ file ends in .obj), found 'q'"
        );
        let error = refusal([0x7f, b'E', b'L', b'F', 0, 0, 0xff, b' ', 0x80]);
        assert_eq!(
            error,
            "a.can, line 1: expected 'p', with which each line of a CAN file begins (the name of an OBJ file ends in .obj), found '\\u{7f}ELF\\0\\0\u{fffd}'"
        );
    }

    #[test]
    fn a_file_of_nothing_is_an_empty_mesh() {
        for text in ["", "\n\n", "# nothing\n"] {
            assert!(parsed(text).mesh.is_empty());
        }
    }
}

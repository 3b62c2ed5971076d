//! CAN: one polygon a line, with a label that says which leaf of which plant it is.
//!
//! `p N label... V x y z ...`: N labels, of which the first counts; V vertices of a convex polygon.
//! From the right, a label is element (3 digits), leaf (3), plant (5), species (what is left).

use std::collections::HashMap;
use std::str;

use glam::DVec3;

use super::error::FormatError;
use super::lines::{Fields, Lines};
use super::mesh::{Mesh, numbered, vertex};
use crate::scene::{Material, Organ};

/// A polygon of more vertices is taken for a garbled count.
pub const MAX_VERTICES: usize = 10_000;

/// Parses a CAN file (unpacked); `file` is its name in messages.
pub fn parse(file: &str, bytes: &[u8]) -> Result<Mesh, FormatError> {
    let mut mesh = Mesh::new(file);
    let mut groups = Groups::default();
    let mut polygon = Vec::new();
    let mut lines = Lines::new(file, bytes);
    while let Some(mut fields) = lines.next()? {
        fields.keyword("p")?;
        let (organ, material) = groups.indices(&mut mesh, label(&mut fields)?);
        vertices(&mut fields, &mut polygon)?;
        mesh.push_polygon(&fields, &polygon, organ, material)?;
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
        let plant = if self.is_soil() { 0 } else { self.plant };
        Organ {
            id: (plant * 1000 + self.leaf).to_string(),
            plant: plant.to_string(),
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
    fn indices(&mut self, mesh: &mut Mesh, label: Label) -> (u32, u32) {
        if let Some((known, indices)) = self.last
            && known == label
        {
            return indices;
        }
        let indices = *self.known.entry(label).or_insert_with(|| {
            (
                numbered(&mut self.organs, &mut mesh.organs, label.organ()),
                numbered(&mut self.materials, &mut mesh.materials, label.material()),
            )
        });
        self.last = Some((label, indices));
        indices
    }
}

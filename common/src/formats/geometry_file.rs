//! What one geometry file holds, in the file's own unit and coordinates.

use std::collections::HashMap;
use std::hash::Hash;

use glam::DVec3;

use super::error::{FormatError, Place};
use super::lines::Fields;
use super::polygon::Cutter;
use crate::canopy::{Material, Mesh, Organ, Triangle, Welder};

/// Farther from zero no coordinate is taken: at this distance a double still resolves 0.1 mm in
/// metres, beyond it leaves would collapse.
pub const MAX_COORDINATE: f64 = 1e12;

/// More triangles than this are refused: an element's two faces, and pieces, must fit 32 bits.
pub const MAX_TRIANGLES: usize = (u32::MAX / 4) as usize;

/// What a geometry file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GeometryFile {
    /// The file as the user named it.
    pub file: String,
    /// Its triangles: its unit, its origin; coordinates finite, at most [`MAX_COORDINATE`] from zero; organs and
    /// materials as numbered here.
    pub mesh: Mesh,
    /// The line that each triangle comes from.
    pub line: Vec<u32>,
    /// In order of first appearance.
    pub organs: Vec<Organ>,
    /// In order of first appearance.
    pub materials: Vec<Material>,
    /// What of the file is not in the mesh, each a sentence, lower-case.
    pub warnings: Vec<String>,
    welder: Welder,
}

impl GeometryFile {
    /// Nothing yet, of that file.
    pub fn new(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            ..Self::default()
        }
    }

    /// Adds a triangle.
    pub fn push(&mut self, triangle: &Triangle) {
        self.mesh.push(&mut self.welder, triangle);
    }

    /// Where a triangle was read.
    pub fn place(&self, triangle: usize) -> Place {
        Place {
            file: self.file.clone(),
            line: self.line.get(triangle).map(|&line| line as usize),
        }
    }

    /// Adds a polygon as triangles.
    pub(super) fn push_polygon(
        &mut self,
        cutter: &mut Cutter,
        fields: &Fields<'_>,
        polygon: &[DVec3],
        organ: u32,
        material: u32,
    ) -> Result<(), FormatError> {
        let content = |expected: String, found: String| FormatError::Content {
            place: fields.place(),
            expected,
            found,
        };
        let cut = cutter.cut(polygon);
        let triangles = cut.map_err(|fault| content(fault.expected(), fault.to_string()))?;
        if self.mesh.len() + triangles.len() > MAX_TRIANGLES {
            let expected = format!("at most {MAX_TRIANGLES} triangles");
            return Err(content(expected, "more".to_owned()));
        }
        // a line holds a byte or more, so only a file of 4 GiB of blank lines could saturate this
        let line = u32::try_from(fields.line()).unwrap_or(u32::MAX);
        for corners in triangles {
            self.push(&Triangle {
                corners_m: corners.map(|vertex| polygon[vertex]),
                organ,
                material,
            });
            self.line.push(line);
        }
        Ok(())
    }
}

/// The three coordinates of a vertex; `vertex` counts from 1.
pub(super) fn vertex(fields: &mut Fields<'_>, vertex: usize) -> Result<DVec3, FormatError> {
    let mut coordinates = [0.0; 3];
    for (axis, value) in ["x", "y", "z"].into_iter().zip(&mut coordinates) {
        let mut found = fields.clone();
        *value = fields.number(format_args!("{axis} of vertex {vertex}"))?;
        if value.abs() > MAX_COORDINATE {
            return Err(fields.fault(
                format_args!("{axis} of vertex {vertex} within {MAX_COORDINATE:e} of zero"),
                found.next(),
            ));
        }
    }
    Ok(DVec3::from_array(coordinates))
}

/// The number of an item in a list that grows by what is new; `known` mirrors the list.
pub(crate) fn numbered<T: Clone + Eq + Hash>(
    known: &mut HashMap<T, u32>,
    list: &mut Vec<T>,
    item: T,
) -> u32 {
    *known.entry(item).or_insert_with_key(|item| {
        list.push(item.clone());
        // a list grows with the triangles at most, and MAX_TRIANGLES fit
        (list.len() - 1) as u32
    })
}

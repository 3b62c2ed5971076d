//! Wavefront OBJ: faces of numbered vertices. Groups are organs, objects are plants, materials have
//! names. Texture coordinates, normals, smoothing, lines and points are passed over.

use std::collections::HashMap;

use glam::DVec3;

use super::error::FormatError;
use super::lines::{Fields, Lines};
use super::mesh::{Mesh, numbered, vertex};
use crate::scene::{Material, Organ};

/// The name of a group, object or material where the file has none.
pub const UNNAMED: &str = "default";

/// Longer names are refused, as every organ of an object holds a copy of its name.
pub const MAX_NAME_BYTES: usize = 255;

/// Parses an OBJ file (unpacked); `file` is its name in messages.
pub fn parse(file: &str, bytes: &[u8]) -> Result<Mesh, FormatError> {
    let mut mesh = Mesh::new(file);
    let mut vertices = Vec::new();
    let mut names = Names::default();
    let mut polygon = Vec::new();
    let mut lines = Lines::new(file, bytes);
    while let Some(mut fields) = lines.next()? {
        match fields.required("a statement")? {
            // what follows x y z is a weight or a colour
            b"v" => vertices.push(vertex(&mut fields, vertices.len() + 1)?),
            b"f" => {
                face(&mut fields, &vertices, &mut polygon)?;
                let (organ, material) = names.indices(&mut mesh);
                mesh.push_polygon(&fields, &polygon, organ, material)?;
            }
            b"o" => {
                names.object = name(&mut fields)?;
                names.group = None;
                names.current = None;
            }
            b"g" => {
                names.group = name(&mut fields)?;
                names.current = None;
            }
            b"usemtl" => {
                names.material = name(&mut fields)?;
                names.current = None;
            }
            b"vt" | b"vn" | b"vp" | b"s" | b"mtllib" | b"l" | b"p" => {}
            other => {
                return Err(fields.fault("an OBJ statement (v, f, g, o, usemtl, ...)", Some(other)));
            }
        }
    }
    Ok(mesh)
}

fn name(fields: &mut Fields<'_>) -> Result<Option<String>, FormatError> {
    let text = fields.text();
    if text.is_empty() {
        return Ok(None);
    }
    let name = std::str::from_utf8(text).ok();
    match name.filter(|name| name.len() <= MAX_NAME_BYTES) {
        Some(name) => Ok(Some(name.to_owned())),
        None => Err(fields.fault(
            format_args!("a name in UTF-8 of at most {MAX_NAME_BYTES} bytes"),
            Some(text),
        )),
    }
}

/// What the faces that follow belong to.
#[derive(Default)]
struct Names {
    object: Option<String>,
    group: Option<String>,
    material: Option<String>,
    /// Organ and material of the names above, once a face has asked for them.
    current: Option<(u32, u32)>,
    organs: HashMap<Organ, u32>,
    materials: HashMap<Material, u32>,
}

impl Names {
    fn indices(&mut self, mesh: &mut Mesh) -> (u32, u32) {
        if let Some(current) = self.current {
            return current;
        }
        let named = |name: &Option<String>| name.clone().unwrap_or_else(|| UNNAMED.to_owned());
        let organ = Organ {
            id: named(self.group.as_ref().map_or(&self.object, |_| &self.group)),
            plant: named(&self.object),
        };
        let material = Material::Named(named(&self.material));
        let current = (
            numbered(&mut self.organs, &mut mesh.organs, organ),
            numbered(&mut self.materials, &mut mesh.materials, material),
        );
        self.current = Some(current);
        current
    }
}

fn face(
    fields: &mut Fields<'_>,
    vertices: &[DVec3],
    polygon: &mut Vec<DVec3>,
) -> Result<(), FormatError> {
    polygon.clear();
    while let Some(field) = fields.next() {
        let found = resolve(field, vertices).ok_or_else(|| {
            let known = vertices.len();
            fields.fault(
                format_args!("a vertex from 1 to {known}, or from -{known} to -1"),
                Some(field),
            )
        })?;
        polygon.push(found);
    }
    if polygon.len() < 3 {
        return Err(fields.fault("at least 3 vertices", None));
    }
    Ok(())
}

/// The vertex of `v`, `v/vt`, `v//vn` or `v/vt/vn`; negative numbers count back from the last.
fn resolve(field: &[u8], vertices: &[DVec3]) -> Option<DVec3> {
    let number = field.split(|&byte| byte == b'/').next()?;
    let number: i64 = std::str::from_utf8(number).ok()?.parse().ok()?;
    let index = if number < 0 {
        let back = usize::try_from(number.unsigned_abs()).ok()?;
        vertices.len().checked_sub(back)?
    } else {
        usize::try_from(number).ok()?.checked_sub(1)?
    };
    vertices.get(index).copied()
}

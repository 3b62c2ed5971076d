//! Wavefront OBJ: faces of numbered vertices. Groups are organs, objects are plants, materials have
//! names. Texture coordinates, normals, smoothing, levels of detail, lines and points are passed over; so are curves
//! and curved surfaces, with a warning.

use std::collections::HashMap;

use glam::DVec3;

use super::error::{FormatError, Place};
use super::geometry_file::{GeometryFile, numbered, vertex};
use super::lines::{Fields, Lines};
use super::polygon::{Cutter, MAX_VERTICES};
use crate::canopy::{Material, Organ};

/// The name of a group, object or material where the file has none.
pub const UNNAMED: &str = "default";

/// Longer names are refused, as every organ of an object holds a copy of its name.
pub const MAX_NAME_BYTES: usize = 255;

/// Parses an OBJ file (unpacked); `file` is its name in messages.
pub fn parse(file: &str, bytes: &[u8]) -> Result<GeometryFile, FormatError> {
    let mut mesh = GeometryFile::new(file);
    // faces may come before their vertices
    let vertices = vertices(file, bytes)?;
    let mut before = 0;
    let mut names = Names::default();
    let (mut polygon, mut cutter) = (Vec::new(), Cutter::default());
    let mut curved = None;
    let mut lines = Lines::joined(file, bytes);
    while let Some(mut fields) = lines.next()? {
        match fields.required("a statement")? {
            b"v" => before += 1,
            b"f" | b"fo" => {
                face(&mut fields, &vertices, before, &mut polygon)?;
                let (organ, material) = names.indices(&mut mesh);
                mesh.push_polygon(&mut cutter, &fields, &polygon, organ, material)?;
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
            other if CURVED.contains(&other) => {
                curved.get_or_insert_with(|| fields.place());
            }
            other if PASSED_OVER.contains(&other) => {}
            other => {
                return Err(fields.fault("an OBJ statement (v, f, g, o, usemtl, ...)", Some(other)));
            }
        }
    }
    mesh.warnings.extend(curved.map(passed_over));
    Ok(mesh)
}

/// Statements that say nothing of triangles. Not among them are `call` and `csh`, which bring in other files.
const PASSED_OVER: [&[u8]; 31] = [
    // vertices of other kinds, lines and points
    b"vt",
    b"vn",
    b"vp",
    b"l",
    b"p",
    // weights of bones, and tags of subdivision
    b"vw",
    b"t",
    // how faces look
    b"s",
    b"mg",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
    b"mtllib",
    b"usemap",
    b"maplib",
    b"shadow_obj",
    b"trace_obj",
    // what belongs to curves and curved surfaces
    b"cstype",
    b"deg",
    b"bmat",
    b"step",
    b"parm",
    b"trim",
    b"hole",
    b"scrv",
    b"sp",
    b"end",
    b"con",
    b"ctech",
    b"stech",
];

/// Curves and curved surfaces, of today and of older versions.
const CURVED: [&[u8]; 7] = [b"curv", b"curv2", b"surf", b"bsp", b"bzp", b"cdc", b"cdp"];

fn passed_over(place: Place) -> String {
    format!("curves and curved surfaces are ignored, the first in {place}")
}

/// All vertices of the file.
fn vertices(file: &str, bytes: &[u8]) -> Result<Vec<DVec3>, FormatError> {
    let mut vertices = Vec::new();
    let mut lines = Lines::joined(file, bytes);
    while let Some(mut fields) = lines.next()? {
        if fields.next() == Some(b"v") {
            // what follows x y z is a weight or a colour
            vertices.push(vertex(&mut fields, vertices.len() + 1)?);
        }
    }
    Ok(vertices)
}

/// A name, or several, with one blank between them.
fn name(fields: &mut Fields<'_>) -> Result<Option<String>, FormatError> {
    let mut name = Vec::new();
    while let Some(field) = fields.next_of_name() {
        if !name.is_empty() {
            name.push(b' ');
        }
        name.extend_from_slice(field);
        if name.len() > MAX_NAME_BYTES {
            break;
        }
    }
    if name.is_empty() {
        return Ok(None);
    }
    let text = std::str::from_utf8(&name).ok();
    match text.filter(|name| name.len() <= MAX_NAME_BYTES) {
        Some(name) => Ok(Some(name.to_owned())),
        None => Err(fields.fault(
            format_args!("a name in UTF-8 of at most {MAX_NAME_BYTES} bytes"),
            Some(&name),
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
    fn indices(&mut self, file: &mut GeometryFile) -> (u32, u32) {
        if let Some(current) = self.current {
            return current;
        }
        let named = |name: &Option<String>| name.clone().unwrap_or_else(|| UNNAMED.to_owned());
        let organ = Organ {
            // whoever knows the other files of the scene gives this one a name
            species: String::new(),
            id: named(self.group.as_ref().map_or(&self.object, |_| &self.group)),
            plant: named(&self.object),
        };
        let material = Material::Named(named(&self.material));
        let current = (
            numbered(&mut self.organs, &mut file.organs, organ),
            numbered(&mut self.materials, &mut file.materials, material),
        );
        self.current = Some(current);
        current
    }
}

/// `before` vertices stand before the face in the file.
fn face(
    fields: &mut Fields<'_>,
    vertices: &[DVec3],
    before: usize,
    polygon: &mut Vec<DVec3>,
) -> Result<(), FormatError> {
    polygon.clear();
    while let Some(field) = fields.next() {
        let Some(found) = resolve(field, before).and_then(|index| vertices.get(index)) else {
            let expected = match (vertices.len(), before) {
                (0, _) => "vertices (v) for the faces of the file".to_owned(),
                (all, 0) => format!("a vertex from 1 to {all}"),
                (all, before) => format!("a vertex from 1 to {all}, or from -{before} to -1"),
            };
            return Err(fields.fault(expected, Some(field)));
        };
        if polygon.len() == MAX_VERTICES {
            let expected = format_args!("a face of at most {MAX_VERTICES} vertices");
            return Err(fields.fault(expected, Some(field)));
        }
        polygon.push(*found);
    }
    if polygon.len() < 3 {
        return Err(fields.fault("at least 3 vertices", None));
    }
    Ok(())
}

/// The index of the vertex of `v`, `v/vt`, `v//vn` or `v/vt/vn`; negative numbers count back from the last one before
/// the face.
fn resolve(field: &[u8], before: usize) -> Option<usize> {
    let number = field.split(|&byte| byte == b'/').next()?;
    let number: i64 = std::str::from_utf8(number).ok()?.parse().ok()?;
    if number < 0 {
        let back = usize::try_from(number.unsigned_abs()).ok()?;
        before.checked_sub(back)
    } else {
        usize::try_from(number).ok()?.checked_sub(1)
    }
}

#[cfg(test)]
#[path = "obj_tests.rs"]
mod tests;

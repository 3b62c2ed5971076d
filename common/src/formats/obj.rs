//! Wavefront OBJ: faces of numbered vertices. Groups are organs, objects are plants, materials have
//! names. Texture coordinates, normals, smoothing, lines and points are passed over.

use std::collections::HashMap;

use glam::DVec3;

use super::error::FormatError;
use super::geometry_file::{GeometryFile, numbered, vertex};
use super::lines::{Fields, Lines};
use crate::canopy::{Material, Organ};

/// The name of a group, object or material where the file has none.
pub const UNNAMED: &str = "default";

/// Longer names are refused, as every organ of an object holds a copy of its name.
pub const MAX_NAME_BYTES: usize = 255;

/// Parses an OBJ file (unpacked); `file` is its name in messages.
pub fn parse(file: &str, bytes: &[u8]) -> Result<GeometryFile, FormatError> {
    let mut mesh = GeometryFile::new(file);
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

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = "v 0 0 1\nv 1 0 1\nv 1 1 1 0.5 0.5 0.5\nv 0 1 1\n";

    fn parsed(faces: &str) -> Result<GeometryFile, String> {
        let text = format!("{SQUARE}{faces}");
        parse("a.obj", text.as_bytes()).map_err(|error| error.to_string())
    }

    #[test]
    fn all_ways_to_name_a_vertex_mean_the_same() {
        let expected = parsed("f 1 2 3 4").unwrap();
        assert_eq!(expected.mesh.len(), 2);
        for face in [
            "f 1/1 2/2 3/3 4/4",
            "f 1//7 2//7 3//7 4//7",
            "f 1/1/1 2/1/1 3/1/1 4/1/1",
            "f -4 -3 -2 -1",
        ] {
            assert_eq!(parsed(face).unwrap().mesh, expected.mesh);
        }
    }

    #[test]
    fn groups_are_organs_objects_are_plants_and_materials_have_names() {
        let faces = "mtllib a.mtl\nvn 0 0 1\ns off\nf 1 2 3\n\
                     o oak\nusemtl bark\nf 1 2 3\ng leaf one\nusemtl leaf\nf 1 2 3\nf 2 3 4\n\
                     o elm\nf 1 2 3\ng leaf one\nf 1 2 3\n";
        let mesh = parsed(faces).unwrap();
        let organs: Vec<(&str, &str)> = mesh
            .organs
            .iter()
            .map(|organ| (organ.plant.as_str(), organ.id.as_str()))
            .collect();
        assert_eq!(
            organs,
            [
                ("default", "default"),
                ("oak", "oak"),
                ("oak", "leaf one"),
                ("elm", "elm"),
                ("elm", "leaf one")
            ]
        );
        assert_eq!(mesh.mesh.organ, [0, 1, 2, 2, 3, 4]);
        let names = ["default", "bark", "leaf"];
        assert_eq!(
            mesh.materials,
            names.map(|name| Material::Named(name.into()))
        );
        assert_eq!(mesh.mesh.material, [0, 1, 2, 2, 2, 2]);
    }

    #[test]
    fn faces_without_their_vertices_are_refused() {
        for face in [
            "f 1 2 5",
            "f 0 1 2",
            "f -5 1 2",
            "f 1 2 x",
            "f 1 2 99999999999999999999",
        ] {
            let error = parsed(face).unwrap_err();
            let expected = "a.obj, line 5: expected a vertex from 1 to 4, or from -4 to -1, found ";
            assert!(error.starts_with(expected), "{error}");
        }
        assert_eq!(
            parsed("f 1 2\n").unwrap_err(),
            "a.obj, line 5: expected at least 3 vertices, found the end of the line"
        );
    }

    #[test]
    fn garbled_files_are_refused() {
        for (text, expected) in [
            (
                "v 0 0\n",
                "line 5: expected z of vertex 5, a finite number, found the end of the line",
            ),
            (
                "v 0 nan 0\n",
                "line 5: expected y of vertex 5, a finite number, found 'nan'",
            ),
            (
                "<html>\n",
                "line 5: expected an OBJ statement (v, f, g, o, usemtl, ...), found '<html>'",
            ),
        ] {
            assert_eq!(parsed(text).unwrap_err(), format!("a.obj, {expected}"));
        }
        assert!(parse("a.obj", b"o \xff\xfe\n").is_err());
    }

    #[test]
    fn long_names_cannot_fill_the_memory() {
        let name = "x".repeat(256);
        assert!(
            parsed(&format!("o {name}\n"))
                .unwrap_err()
                .contains("at most 255 bytes")
        );
        assert!(parsed(&format!("o {}\nf 1 2 3", &name[1..])).is_ok());
    }
}

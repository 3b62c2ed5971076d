//! The triangles as one ParaView file (VTK XML PolyData), coloured by their light.
//!
//! All arrays are appended to the XML as raw little-endian blocks, each after its length in bytes
//! (UInt64). Points are f64, in the user's coordinates, three per triangle: light belongs to
//! triangles, so nothing is gained by sharing points. The light itself is f32: it is to be looked
//! at; the tables hold the figures.

use std::collections::HashMap;
use std::hash::Hash;
use std::io::Write;

use nestrad_common::canopy::{Canopy, Organ};
use nestrad_engine::solution::{ItemLight, Solution};

use crate::error::Fault;
use crate::tables::triangle_light_per_m2;
use crate::vtk_xml::{Array, Values, Xml, escaped};

/// Writes all triangles.
pub(crate) fn write(
    canopy: &Canopy,
    band_names: &[&str],
    solution: &Solution,
    out: &mut impl Write,
) -> Result<(), Fault> {
    let triangles = canopy.len();
    let points = point_array(canopy);
    let polygons = [
        Array::new(
            "connectivity",
            3 * triangles,
            Values::I64(Box::new(|i| i as i64)),
        ),
        Array::new(
            "offsets",
            triangles,
            Values::I64(Box::new(|i| 3 * (i as i64 + 1))),
        ),
    ];
    let cells = cell_arrays(canopy, band_names, solution);

    let mut xml = Xml::default();
    xml.line("<?xml version=\"1.0\"?>");
    xml.line("<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">");
    xml.line("<PolyData>");
    xml.line(&format!(
        "<Piece NumberOfPoints=\"{}\" NumberOfPolys=\"{triangles}\">",
        3 * triangles
    ));
    xml.line("<Points>");
    xml.array(&points);
    xml.line("</Points>\n<Polys>");
    polygons.iter().for_each(|array| xml.array(array));
    // the array that ParaView shows first
    let shown = cells
        .first()
        .map_or_else(String::new, |array| escaped(&array.name));
    xml.line(&format!("</Polys>\n<CellData Scalars=\"{shown}\">"));
    cells.iter().for_each(|array| xml.array(array));
    xml.line("</CellData>\n</Piece>\n</PolyData>");
    xml.line("<AppendedData encoding=\"raw\">");
    out.write_all(xml.text.as_bytes())?;
    out.write_all(b"_")?;
    // in the order in which the XML has counted their offsets
    for array in std::iter::once(&points).chain(&polygons).chain(&cells) {
        array.append(out)?;
    }
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")?;
    Ok(())
}

fn point_array(canopy: &Canopy) -> Array<'_> {
    let coordinate = |i: usize| {
        let (point, axis) = (i / 3, i % 3);
        (canopy.triangle(point / 3).corners_m[point % 3] + canopy.origin_m)[axis]
    };
    let mut points = Array::new(
        "Points",
        9 * canopy.len(),
        Values::F64(Box::new(coordinate)),
    );
    points.components = 3;
    points
}

/// A name with its unit, and the figure.
type Quantity = (&'static str, fn(ItemLight) -> f64);

fn cell_arrays<'a>(
    canopy: &'a Canopy,
    band_names: &[&str],
    solution: &'a Solution,
) -> Vec<Array<'a>> {
    let triangles = canopy.len();
    let bands = band_names.len();
    let quantities: [Quantity; 3] = [
        ("absorbed_W_m2", |light| light.absorbed_W),
        ("irradiance_upper_W_m2", |light| light.irradiance_upper_W_m2),
        ("irradiance_lower_W_m2", |light| light.irradiance_lower_W_m2),
    ];
    let mut arrays = Vec::with_capacity(3 * bands + 4);
    for (band, band_name) in band_names.iter().enumerate() {
        for (quantity, value) in quantities {
            let cell = move |i| value(triangle_light_per_m2(solution, i, bands, band)) as f32;
            let name = format!("{quantity} {band_name}");
            arrays.push(Array::new(name, triangles, Values::F32(Box::new(cell))));
        }
    }
    let plants = numbers(canopy, |organ| (&organ.species, &organ.plant));
    let species = numbers(canopy, |organ| &organ.species);
    let kinds = canopy.kinds();
    let organ = |i: usize| canopy.triangle(i).organ;
    let plant = move |i: usize| plants[organ(i) as usize];
    let species = move |i: usize| species[organ(i) as usize];
    let kind = move |i: usize| kinds[canopy.triangle(i).material as usize] as u32;
    arrays.push(Array::new("organ", triangles, Values::U32(Box::new(organ))));
    arrays.push(Array::new("plant", triangles, Values::U32(Box::new(plant))));
    let cells = Values::U32(Box::new(species));
    arrays.push(Array::new("species", triangles, cells));
    // 0 leaf, 1 stem, 2 structure, 3 soil
    arrays.push(Array::new("kind", triangles, Values::U32(Box::new(kind))));
    arrays
}

/// What organs are of, numbered from 0 in the order of its first organ, as organs are in the canopy.
fn numbers<'a, T: Eq + Hash>(canopy: &'a Canopy, of: impl Fn(&'a Organ) -> T) -> Vec<u32> {
    let mut numbers: HashMap<T, u32> = HashMap::new();
    let number = |name| {
        let next = numbers.len() as u32;
        *numbers.entry(name).or_insert(next)
    };
    canopy.organs.iter().map(of).map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use nestrad_common::canopy::{Material, Mesh, Triangle};

    const BAND: &str = "<\"blue\" & red>";

    fn canopy_and_solution() -> (Canopy, Solution) {
        let organ = |id: &str, plant: &str| Organ {
            species: "1".into(),
            plant: plant.into(),
            id: id.into(),
        };
        let triangle = |(corners_m, organ)| Triangle {
            corners_m,
            organ,
            material: 0,
        };
        let triangles = [([DVec3::ZERO, DVec3::X, DVec3::Y], 2), ([DVec3::Z; 3], 0)];
        let mut canopy = Canopy::of_meshes(vec![Mesh::from_iter(triangles.map(triangle))]);
        canopy.organs = vec![organ("a", "p"), organ("b", "p"), organ("c", "q")];
        canopy.materials = vec![Material::Stem { species: 1 }];
        canopy.origin_m = DVec3::new(10.0, 20.0, 30.0);
        let light = ItemLight {
            irradiance_upper_W_m2: 4.0,
            irradiance_lower_W_m2: 2.0,
            absorbed_W: 1.5,
            ..ItemLight::default()
        };
        let solution = Solution {
            triangles: vec![light; 2],
            triangle_area_m2: vec![0.5, 0.0],
            ..Solution::default()
        };
        (canopy, solution)
    }

    fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
        let from = tag.find(&format!(" {name}=\"")).expect("the attribute") + name.len() + 3;
        &tag[from..from + tag[from..].find('"').expect("its end")]
    }

    /// Name, type and bytes of every array, found the way a reader finds them.
    fn arrays(file: &[u8]) -> Vec<(String, String, Vec<u8>)> {
        let mark = b"<AppendedData encoding=\"raw\">\n_";
        let head = file
            .windows(mark.len())
            .position(|window| window == mark)
            .expect("the mark");
        let xml = std::str::from_utf8(&file[..head]).expect("text");
        let data = &file[head + mark.len()..];
        let mut end = 0;
        let arrays = xml
            .lines()
            .filter(|line| line.starts_with("<DataArray"))
            .map(|tag| {
                let offset: usize = attribute(tag, "offset").parse().expect("a number");
                assert_eq!(offset, end, "no gap and no overlap");
                let (length, rest) = data[offset..].split_first_chunk::<8>().expect("a length");
                let length = u64::from_le_bytes(*length) as usize;
                end = offset + 8 + length;
                (
                    attribute(tag, "Name").to_owned(),
                    attribute(tag, "type").to_owned(),
                    rest[..length].to_vec(),
                )
            })
            .collect();
        assert_eq!(&data[end..], b"\n</AppendedData>\n</VTKFile>\n");
        arrays
    }

    #[test]
    fn a_reader_finds_all_arrays() {
        let (canopy, solution) = canopy_and_solution();
        let mut file = Vec::new();
        write(&canopy, &[BAND], &solution, &mut file).expect("written");
        let bytes_of = |values: &[f32]| {
            values
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .collect::<Vec<_>>()
        };
        let points = [
            10., 20., 30., 11., 20., 30., 10., 21., 30., 10., 20., 31., 10., 20., 31., 10., 20.,
            31.,
        ];
        let band = "&lt;&quot;blue&quot; &amp; red&gt;";
        let named = |quantity: &str| format!("{quantity} {band}");
        let expected: Vec<(String, &str, Vec<u8>)> = vec![
            (
                "Points".into(),
                "Float64",
                points.iter().flat_map(|v: &f64| v.to_le_bytes()).collect(),
            ),
            (
                "connectivity".into(),
                "Int64",
                (0..6_i64).flat_map(i64::to_le_bytes).collect(),
            ),
            (
                "offsets".into(),
                "Int64",
                [3_i64, 6].into_iter().flat_map(i64::to_le_bytes).collect(),
            ),
            (named("absorbed_W_m2"), "Float32", bytes_of(&[3.0, 0.0])),
            (
                named("irradiance_upper_W_m2"),
                "Float32",
                bytes_of(&[4.0, 0.0]),
            ),
            (
                named("irradiance_lower_W_m2"),
                "Float32",
                bytes_of(&[2.0, 0.0]),
            ),
            (
                "organ".into(),
                "UInt32",
                [2_u32, 0].into_iter().flat_map(u32::to_le_bytes).collect(),
            ),
            (
                "plant".into(),
                "UInt32",
                [1_u32, 0].into_iter().flat_map(u32::to_le_bytes).collect(),
            ),
            (
                "species".into(),
                "UInt32",
                [0_u32, 0].into_iter().flat_map(u32::to_le_bytes).collect(),
            ),
            (
                "kind".into(),
                "UInt32",
                [1_u32, 1].into_iter().flat_map(u32::to_le_bytes).collect(),
            ),
        ];
        let found = arrays(&file);
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(&expected) {
            assert_eq!(
                (&found.0, found.1.as_str(), &found.2),
                (&expected.0, expected.1, &expected.2)
            );
        }
    }

    #[test]
    fn infinities_are_refused() {
        let (canopy, mut solution) = canopy_and_solution();
        solution.triangles[0].absorbed_W = 1e300;
        let error =
            write(&canopy, &["PAR"], &solution, &mut Vec::new()).expect_err("too large for f32");
        assert_eq!(
            error.to_string(),
            "a value of absorbed_W_m2 PAR is inf, not a finite number"
        );
    }
}

//! The triangles as one ParaView file (VTK XML PolyData): all columns of the table of triangles, a cell array
//! each, light once per band.
//!
//! All arrays are appended to the XML as raw little-endian blocks, each after its length in bytes
//! (UInt64). Points are f64, in the user's coordinates, three per triangle: light belongs to
//! triangles, so nothing is gained by sharing points. The light itself is f32: it is to be looked
//! at; the tables hold the figures.

use std::io::Write;

use nestrad_common::canopy::Canopy;
use nestrad_engine::solution::Solution;

use crate::error::Fault;
use crate::table::Cells;
use crate::tables;
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
    let absorbed = |array: &&Array<'_>| array.name.starts_with("absorbed_W_m2 ");
    let shown = cells.iter().find(absorbed);
    let shown = shown.map_or_else(String::new, |array| escaped(&array.name));
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

/// A row of the table is a triangle in a band: what stands before the column `band` is the triangle's own.
fn cell_arrays<'a>(
    canopy: &'a Canopy,
    band_names: &'a [&str],
    solution: &'a Solution,
) -> Vec<Array<'a>> {
    let (triangles, bands) = (canopy.len(), band_names.len());
    let mut columns = tables::triangles(canopy, band_names, solution).columns;
    let split = columns.iter().position(|column| column.name == "band");
    let light = columns.split_off(split.unwrap_or(columns.len()));
    let light = &light[light.len().min(1)..];

    let mut arrays = Vec::with_capacity(light.len() * bands + columns.len());
    for (band, band_name) in band_names.iter().enumerate() {
        for column in light {
            let name = format!("{} {band_name}", column.name);
            let values = values(&column.cells, triangles, move |i| i * bands + band);
            arrays.push(Array::new(name, triangles, values));
        }
    }
    for column in columns {
        let values = values(&column.cells, triangles, move |i| i * bands);
        arrays.push(Array::new(column.name, triangles, values));
    }
    arrays
}

/// The cells that stand in some rows. Names that are whole numbers, as those of CAN are, become numbers:
/// ParaView can colour and select by them.
fn values<'a>(cells: &Cells<'a>, count: usize, row: impl Fn(usize) -> usize + 'a) -> Values<'a> {
    match cells.clone() {
        Cells::Text(cell) if (0..count).all(|i| whole_number(cell(row(i))).is_some()) => {
            Values::I64(Box::new(move |i| {
                whole_number(cell(row(i))).unwrap_or_default()
            }))
        }
        Cells::Text(cell) => Values::Text(Box::new(move |i| cell(row(i)))),
        Cells::Index(cell) => Values::I64(Box::new(move |i| cell(row(i)) as i64)),
        Cells::Real(cell) => Values::F32(Box::new(move |i| cell(row(i)) as f32)),
        Cells::Sparse(cell) => {
            Values::F32(Box::new(move |i| cell(row(i)).unwrap_or_default() as f32))
        }
    }
}

/// The number that a name is; 007 is none.
fn whole_number(name: &str) -> Option<i64> {
    let number: i64 = name.parse().ok()?;
    (number.to_string() == name).then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use nestrad_common::canopy::{Material, Mesh, Organ, Triangle};
    use nestrad_engine::solution::ItemLight;

    const BAND: &str = "<\"blue\" & red>";

    /// Organ c of plant 12, organ a of plant 7: one is named by a number, the other is not.
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
        canopy.organs = vec![organ("a", "7"), organ("b", "7"), organ("é\"c", "12")];
        canopy.materials = vec![Material::Stem { species: 1 }];
        canopy.origin_m = DVec3::new(10.0, 20.0, 30.0);
        let light = ItemLight {
            irradiance_upper_W_m2: 4.0,
            irradiance_lower_W_m2: 2.0,
            absorbed_W: 1.5,
            absorbed_direct_W: 0.5,
            absorbed_se_W: 0.25,
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
            .filter(|line| line.starts_with("<DataArray") || line.starts_with("<Array"))
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
    fn ids_were_not_those_of_the_tables_and_columns_were_missing() {
        let (canopy, solution) = canopy_and_solution();
        let mut file = Vec::new();
        write(&canopy, &[BAND], &solution, &mut file).expect("written");
        let bytes_of = |values: &[f32]| {
            values
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .collect::<Vec<_>>()
        };
        let whole = |values: &[i64]| values.iter().flat_map(|v| v.to_le_bytes()).collect();
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
            (named("absorbed_W_m2"), "Float32", bytes_of(&[3.0, 0.0])),
            (
                named("absorbed_direct_W_m2"),
                "Float32",
                bytes_of(&[1.0, 0.0]),
            ),
            (named("absorbed_se_W_m2"), "Float32", bytes_of(&[0.5, 0.0])),
            ("triangle".into(), "Int64", whole(&[0, 1])),
            ("species".into(), "Int64", whole(&[1, 1])),
            ("plant".into(), "Int64", whole(&[12, 7])),
            ("organ".into(), "String", b"\xc3\xa9\"c\0a\0".to_vec()),
            ("kind".into(), "String", b"stem\0stem\0".to_vec()),
            ("area_m2".into(), "Float32", bytes_of(&[0.5, 0.0])),
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

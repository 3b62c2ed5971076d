//! The triangles as one ParaView file (VTK XML PolyData), coloured by their light.
//!
//! All arrays are appended to the XML as raw little-endian blocks, each after its length in bytes
//! (UInt64). Points are f64, in the user's coordinates, three per triangle: light belongs to
//! triangles, so nothing is gained by sharing points. The light itself is f32: it is to be looked
//! at; the tables hold the figures.

use std::collections::HashMap;
use std::io::{self, Write};

use nestrad_common::scene::Scene;

use super::error::Fault;
use super::tables::triangle_light_per_m2;
use crate::solution::{ItemLight, Solution};

/// Writes all triangles.
pub(crate) fn write(
    scene: &Scene,
    band_names: &[&str],
    solution: &Solution,
    out: &mut impl Write,
) -> Result<(), Fault> {
    let triangles = scene.triangles.len();
    let points = point_array(scene);
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
    let cells = cell_arrays(scene, band_names, solution);

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

fn point_array(scene: &Scene) -> Array<'_> {
    let coordinate = |i: usize| {
        let (point, axis) = (i / 3, i % 3);
        (scene.triangles[point / 3][point % 3] + scene.origin_m)[axis]
    };
    let mut points = Array::new(
        "Points",
        9 * scene.triangles.len(),
        Values::F64(Box::new(coordinate)),
    );
    points.components = 3;
    points
}

fn cell_arrays<'a>(
    scene: &'a Scene,
    band_names: &[&str],
    solution: &'a Solution,
) -> Vec<Array<'a>> {
    let triangles = scene.triangles.len();
    let bands = band_names.len();
    let quantities: [(&str, fn(ItemLight) -> f64); 3] = [
        ("absorbed_W_m2", |light| light.absorbed_W),
        ("irradiance_upper_W_m2", |light| light.irradiance_upper_W_m2),
        ("irradiance_lower_W_m2", |light| light.irradiance_lower_W_m2),
    ];
    let mut arrays = Vec::with_capacity(3 * bands + 2);
    for (band, band_name) in band_names.iter().enumerate() {
        for (quantity, value) in quantities {
            let cell = move |i| value(triangle_light_per_m2(solution, i, bands, band)) as f32;
            let name = format!("{quantity} {band_name}");
            arrays.push(Array::new(name, triangles, Values::F32(Box::new(cell))));
        }
    }
    let plants = plant_of_organ(scene);
    let plant = move |i: usize| plants[scene.organ[i] as usize];
    arrays.push(Array::new(
        "organ",
        triangles,
        Values::U32(Box::new(|i| scene.organ[i])),
    ));
    arrays.push(Array::new("plant", triangles, Values::U32(Box::new(plant))));
    arrays
}

/// Plants are numbered from 0 in the order of their first organ, as organs are in the scene.
fn plant_of_organ(scene: &Scene) -> Vec<u32> {
    let mut numbers: HashMap<&str, u32> = HashMap::new();
    let number = |plant| {
        let next = numbers.len() as u32;
        *numbers.entry(plant).or_insert(next)
    };
    scene
        .organs
        .iter()
        .map(|organ| organ.plant.as_str())
        .map(number)
        .collect()
}

/// A named array: its values by index.
struct Array<'a> {
    name: String,
    components: usize,
    count: usize,
    values: Values<'a>,
}

type ByIndex<'a, T> = Box<dyn Fn(usize) -> T + 'a>;

enum Values<'a> {
    F64(ByIndex<'a, f64>),
    F32(ByIndex<'a, f32>),
    I64(ByIndex<'a, i64>),
    U32(ByIndex<'a, u32>),
}

impl<'a> Array<'a> {
    fn new(name: impl Into<String>, count: usize, values: Values<'a>) -> Self {
        let name = name.into();
        Self {
            name,
            components: 1,
            count,
            values,
        }
    }

    /// VTK's name of the type, and the size of a value in bytes.
    fn kind(&self) -> (&'static str, usize) {
        match self.values {
            Values::F64(_) => ("Float64", 8),
            Values::F32(_) => ("Float32", 4),
            Values::I64(_) => ("Int64", 8),
            Values::U32(_) => ("UInt32", 4),
        }
    }

    fn bytes(&self) -> usize {
        self.count * self.kind().1
    }

    fn append(&self, out: &mut impl Write) -> Result<(), Fault> {
        out.write_all(&(self.bytes() as u64).to_le_bytes())?;
        let indices = 0..self.count;
        match &self.values {
            Values::F64(value) => indices.map(value).try_for_each(|v| {
                self.finite(v)?;
                Ok(out.write_all(&v.to_le_bytes())?)
            }),
            Values::F32(value) => indices.map(value).try_for_each(|v| {
                self.finite(v.into())?;
                Ok(out.write_all(&v.to_le_bytes())?)
            }),
            Values::I64(value) => whole(
                indices
                    .map(value)
                    .try_for_each(|v| out.write_all(&v.to_le_bytes())),
            ),
            Values::U32(value) => whole(
                indices
                    .map(value)
                    .try_for_each(|v| out.write_all(&v.to_le_bytes())),
            ),
        }
    }

    fn finite(&self, value: f64) -> Result<(), Fault> {
        if value.is_finite() {
            return Ok(());
        }
        let place = format!("a value of {}", self.name);
        Err(Fault::NotFinite { place, value })
    }
}

fn whole(written: io::Result<()>) -> Result<(), Fault> {
    Ok(written?)
}

/// The head of the file, and where the next array will begin after it.
#[derive(Default)]
struct Xml {
    text: String,
    offset: usize,
}

impl Xml {
    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    fn array(&mut self, array: &Array<'_>) {
        self.line(&format!(
            "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>",
            array.kind().0,
            escaped(&array.name),
            array.components,
            self.offset,
        ));
        self.offset += size_of::<u64>() + array.bytes();
    }
}

/// Text for an XML attribute. XML has no control characters, not even escaped.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\u{fffe}' | '\u{ffff}' => out.push(char::REPLACEMENT_CHARACTER),
            c if c.is_control() => out.push(char::REPLACEMENT_CHARACTER),
            c => out.push(c),
        }
    }
    out
}

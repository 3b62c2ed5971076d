//! What clients send, checked as it arrives, exactly as files are checked: nothing of it is trusted,
//! and no memory is taken for what was only announced.

mod checks;
mod options;
mod sensors;
mod surface;
#[cfg(test)]
mod tests;

use std::collections::HashSet;

use glam::DVec3;
use nestrad_common::assemble::{Geometry, build_canopy};
use nestrad_common::canopy::{Organ, Triangle};
use nestrad_common::formats::pattern::Rectangle;
use nestrad_common::formats::{GeometryFile, MAX_COORDINATE, MAX_TRIANGLES, Origins};
use nestrad_common::inspection::inspect;
use nestrad_common::options::{Unit, Up};
use nestrad_proto::v1;

use super::error::{ErrorCode, ServiceError};
use super::held::HeldCanopy;
use super::identity::GeometryHasher;
pub(super) use checks::lighting;
pub(super) use options::settings;
pub(super) use sensors::sensors;
pub(super) use surface::{Surface, sent};

/// Bytes that a triangle takes while it is held, and an organ without its text.
const TRIANGLE_BYTES: u64 = 88;
const ORGAN_BYTES: u64 = 176;

/// Bytes that triangles take while they are held.
pub(super) fn triangle_bytes(slice: &v1::TriangleSlice) -> u64 {
    let count = slice.organ.len().max(slice.vertices_m.len() / 9);
    TRIANGLE_BYTES * count as u64
}

/// Bytes that organs take while they are held.
pub(super) fn organ_bytes(slice: &v1::OrganSlice) -> u64 {
    let names = slice.id.iter().chain(&slice.plant).chain(&slice.species);
    let text: usize = names.map(String::len).sum();
    // names are held twice, to know those that come again
    ORGAN_BYTES * slice.id.len() as u64 + 2 * text as u64
}

/// A geometry that is arriving.
#[derive(Debug)]
pub(super) struct Upload {
    triangles: usize,
    organs: usize,
    surfaces: Vec<Surface>,
    arrived: GeometryFile,
    known: HashSet<Organ>,
    pattern: Option<Rectangle>,
    soil_z_m: Option<f64>,
    hasher: GeometryHasher,
}

impl Upload {
    /// Begins with a header.
    pub(super) fn begin(header: &v1::GeometryHeader) -> Result<Self, ServiceError> {
        let count = |name: &str, found: u64| match usize::try_from(found) {
            Ok(count) if (1..=MAX_TRIANGLES).contains(&count) => Ok(count),
            _ => Err(ServiceError::invalid(
                format_args!("new_geometry.{name}"),
                format_args!("1 to {MAX_TRIANGLES}"),
                found,
            )),
        };
        let pattern = header.pattern.as_ref().map(checks::pattern).transpose()?;
        let surfaces = checks::surfaces(&header.materials)?;
        let mut arrived = GeometryFile::new("");
        let materials = surfaces.iter().map(|surface| surface.material.clone());
        arrived.materials = materials.collect();
        Ok(Self {
            triangles: count("triangles", header.triangles)?,
            organs: count("organs", header.organs)?,
            surfaces,
            arrived,
            known: HashSet::new(),
            pattern,
            soil_z_m: header.soil_z_m,
            hasher: GeometryHasher::new(header),
        })
    }

    /// What triangles will be made of.
    pub(super) fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// Bytes that the whole will take, but for the names of organs.
    pub(super) fn announced_bytes(&self) -> u64 {
        TRIANGLE_BYTES * self.triangles as u64 + ORGAN_BYTES * self.organs as u64
    }

    /// Takes in organs.
    pub(super) fn organs(&mut self, slice: v1::OrganSlice) -> Result<(), ServiceError> {
        let got = self.arrived.organs.len();
        let expected = Span {
            list: "organs",
            first: slice.first,
            got,
            announced: self.organs,
        };
        let (count, mut species) = (slice.id.len(), slice.species);
        if species.is_empty() {
            species.resize(count, String::new());
        }
        let columns = [("plant", slice.plant.len()), ("species", species.len())];
        expected.check(count, &columns)?;
        let names = slice.id.into_iter().zip(slice.plant).zip(species);
        for (index, ((id, plant), species)) in (got..).zip(names) {
            for (name, text) in [("id", &id), ("plant", &plant), ("species", &species)] {
                if name != "species" || !text.is_empty() {
                    checks::name(format_args!("organs[{index}].{name}"), text)?;
                }
            }
            let organ = Organ { species, plant, id };
            self.hasher.organ(&organ);
            if !self.known.insert(organ.clone()) {
                let found = format!("'{}' of plant '{}' again", organ.id, organ.plant);
                let place = format_args!("organs[{index}]");
                return Err(ServiceError::invalid(place, "an organ of its own", found));
            }
            self.arrived.organs.push(organ);
        }
        Ok(())
    }

    /// Takes in triangles.
    pub(super) fn triangles(&mut self, slice: &v1::TriangleSlice) -> Result<(), ServiceError> {
        let got = self.arrived.mesh.len();
        let count = slice.organ.len();
        let expected = Span {
            list: "triangles",
            first: slice.first,
            got,
            announced: self.triangles,
        };
        let of_slice = [("material", slice.material.len())];
        expected.check(count, &of_slice)?;
        if slice.vertices_m.len() != 9 * count {
            let place = format_args!("triangles from {got} on: vertices_m");
            let wanted = format_args!("{} numbers for {count} triangles", 9 * count);
            return Err(ServiceError::invalid(place, wanted, slice.vertices_m.len()));
        }
        let indices = slice.organ.iter().zip(&slice.material);
        for (index, (vertices, (&organ, &material))) in
            (got..).zip(slice.vertices_m.chunks_exact(9).zip(indices))
        {
            let vertices = triangle(index, vertices)?;
            for (name, number, of) in [
                ("organ", organ, self.organs),
                ("material", material, self.surfaces.len()),
            ] {
                if number as usize >= of {
                    let place = format_args!("triangles[{index}].{name}");
                    let wanted = format_args!("a number below {of}");
                    return Err(ServiceError::invalid(place, wanted, number));
                }
            }
            self.hasher.triangle(&vertices, organ, material);
            self.arrived.push(&Triangle {
                corners_m: vertices,
                organ,
                material,
            });
        }
        Ok(())
    }

    /// All that was announced is there.
    pub(super) fn is_complete(&self) -> bool {
        self.arrived.mesh.len() == self.triangles && self.arrived.organs.len() == self.organs
    }

    /// The geometry, when all of it has come. This takes time: it is not for tokio's threads.
    pub(super) fn finish(self) -> Result<HeldCanopy, ServiceError> {
        for (list, announced, got) in [
            ("triangles", self.triangles, self.arrived.mesh.len()),
            ("organs", self.organs, self.arrived.organs.len()),
        ] {
            if announced != got {
                let wanted = format_args!("{announced} {list}, as announced");
                return Err(ServiceError::invalid("scene", wanted, got));
            }
        }
        let geometry = Geometry {
            files: vec![self.arrived],
            pattern: self.pattern,
            soil: self.soil_z_m,
            unit: Unit::Metre,
            up: Up::Z,
        };
        let (mut canopy, _) =
            build_canopy(geometry).map_err(|e| ServiceError::new(ErrorCode::Invalid, e))?;
        let kinds = self.surfaces.into_iter();
        canopy.declared = kinds.map(|of| (of.material, of.kind)).collect();
        let inspection = inspect(&canopy, &Origins::default());
        Ok(HeldCanopy {
            id: self.hasher.id(),
            canopy: canopy.into(),
            inspection,
        })
    }
}

/// Where a slice should stand in its list.
struct Span {
    list: &'static str,
    first: u64,
    got: usize,
    announced: usize,
}

impl Span {
    /// Whether a slice of `count` items is the next one, and its columns are of the same length.
    fn check(&self, count: usize, columns: &[(&str, usize)]) -> Result<(), ServiceError> {
        let Self {
            list,
            first,
            got,
            announced,
        } = *self;
        if first != got as u64 {
            let place = format_args!("{list}: first");
            return Err(ServiceError::invalid(place, got, first));
        }
        if count > announced - got {
            let wanted = format_args!("{announced}, as announced");
            return Err(ServiceError::invalid(list, wanted, got + count));
        }
        for &(column, found) in columns {
            if found != count {
                let place = format_args!("{list} from {first} on: {column}");
                return Err(ServiceError::invalid(place, count, found));
            }
        }
        Ok(())
    }
}

fn triangle(index: usize, flat: &[f64]) -> Result<[DVec3; 3], ServiceError> {
    for (k, &value) in flat.iter().enumerate() {
        if !(value.is_finite() && value.abs() <= MAX_COORDINATE) {
            let (axis, vertex) = (["x", "y", "z"][k % 3], k / 3 + 1);
            return Err(ServiceError::invalid(
                format_args!("triangles[{index}].vertices_m: {axis} of vertex {vertex}"),
                format_args!("a finite number within {MAX_COORDINATE:e} of zero"),
                value,
            ));
        }
    }
    Ok([0, 3, 6].map(|k| DVec3::from_slice(&flat[k..k + 3])))
}

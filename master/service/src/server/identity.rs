//! Names of scenes by what is in them: the same content has the same name.

use std::fmt;

use glam::DVec3;
use nestrad_common::canopy::Organ;
use nestrad_common::light::Light;
use nestrad_common::light::Radiance;
use nestrad_common::optics::Optics;
use nestrad_proto::v1;

/// The name of a geometry, a scene or a solve: 32 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Id([u8; 16]);

impl Id {
    /// As it is written.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let mut id = [0; 16];
        let digits = text.as_bytes();
        if digits.len() != 2 * id.len() {
            return None;
        }
        for (byte, pair) in id.iter_mut().zip(digits.chunks_exact(2)) {
            let digit = |c: u8| {
                char::from(c)
                    .to_digit(16)
                    .filter(|_| !c.is_ascii_uppercase())
            };
            *byte = (digit(pair[0])? << 4 | digit(pair[1])?) as u8;
        }
        Some(Self(id))
    }

    fn of(hasher: &blake3::Hasher) -> Self {
        let mut id = [0; 16];
        id.copy_from_slice(&hasher.finalize().as_bytes()[..16]);
        Self(id)
    }
}

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// Takes in a geometry as it arrives. Organs and triangles may arrive in any order, and in slices of
/// any size.
#[derive(Debug)]
pub(super) struct GeometryHasher {
    organs: Words,
    triangles: Words,
}

impl GeometryHasher {
    pub(super) fn new(header: &v1::GeometryHeader) -> Self {
        let mut triangles = Words::new("nestrad geometry 2");
        triangles.count(header.materials.len());
        for material in &header.materials {
            triangles.text(&material.name);
            triangles.count(material.kind as usize);
            triangles.count(material.solid.map_or(0, |solid| 1 + usize::from(solid)));
        }
        let pattern = header.pattern.as_ref();
        let pattern = pattern.map(|p| [p.min_x_m, p.min_y_m, p.max_x_m, p.max_y_m]);
        triangles.count(usize::from(pattern.is_some()));
        triangles.numbers(&pattern.unwrap_or_default());
        triangles.count(usize::from(header.soil_z_m.is_some()));
        triangles.numbers(&[header.soil_z_m.unwrap_or_default()]);
        Self {
            organs: Words::new("nestrad organs 2"),
            triangles,
        }
    }

    pub(super) fn organ(&mut self, organ: &Organ) {
        self.organs.text(&organ.id);
        self.organs.text(&organ.plant);
        self.organs.text(&organ.species);
    }

    pub(super) fn triangle(&mut self, vertices: &[DVec3; 3], organ: u32, material: u32) {
        let [a, b, c] = vertices;
        let flat = [a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z];
        self.triangles.numbers(&flat);
        self.triangles.count(organ as usize);
        self.triangles.count(material as usize);
    }

    pub(super) fn id(mut self) -> Id {
        self.triangles.0.update(self.organs.0.finalize().as_bytes());
        Id::of(&self.triangles.0)
    }
}

/// Names a scene: a geometry under a light, with its optics.
pub(super) fn scene_id(geometry: Id, optics: &Optics, light: &Light) -> Id {
    let mut words = Words::new("nestrad scene 1");
    words.0.update(&geometry.0);
    words.count(optics.len());
    for band in &optics.bands {
        words.text(&band.name);
        words.numbers(&[band.soil_albedo]);
        for optics in &band.materials {
            let (upper, lower) = (optics.upper, optics.lower);
            words.numbers(&[upper.rho, upper.tau, lower.rho, lower.tau]);
        }
    }
    words.count(light.suns.len());
    for sun in &light.suns {
        words.numbers(&sun.direction.to_array());
        words.numbers(&sun.irradiance_W_m2);
    }
    words.count(usize::from(light.sky.is_some()));
    if let Some(sky) = &light.sky {
        let (kind, shape) = match sky.radiance {
            Radiance::Uniform => (0, [0.0; 2]),
            Radiance::MoonSpencer => (1, [0.0; 2]),
            Radiance::Cie { kind, .. } => (2, [kind.number().into(), 0.0]),
            Radiance::Perez(perez) => (3, [perez.clearness, perez.brightness]),
        };
        words.count(kind);
        words.numbers(&shape);
        let towards_sun = sky.radiance.towards_sun().unwrap_or_default();
        words.numbers(&towards_sun.to_array());
        words.numbers(&[sky.diffuse_fraction]);
        words.numbers(&sky.irradiance_W_m2);
    }
    Id::of(&words.0)
}

/// Names a solve: unlike any other of this master, and of those before and after it.
pub(super) fn solve_id(started_ns: u128, number: u64) -> Id {
    let mut words = Words::new("nestrad solve 1");
    words.0.update(&started_ns.to_le_bytes());
    words.0.update(&std::process::id().to_le_bytes());
    words.0.update(&number.to_le_bytes());
    Id::of(&words.0)
}

/// A hasher of numbers and texts, each of which takes a number of bytes that follows from what came
/// before it.
#[derive(Debug)]
struct Words(blake3::Hasher);

impl Words {
    fn new(purpose: &str) -> Self {
        Self(blake3::Hasher::new_derive_key(purpose))
    }

    fn count(&mut self, count: usize) {
        self.0.update(&(count as u64).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.count(text.len());
        self.0.update(text.as_bytes());
    }

    fn numbers(&mut self, numbers: &[f64]) {
        for chunk in numbers.chunks(9) {
            let mut bytes = [0; 72];
            for (bytes, number) in bytes.chunks_exact_mut(8).zip(chunk) {
                bytes.copy_from_slice(&number.to_bits().to_le_bytes());
            }
            self.0.update(&bytes[..8 * chunk.len()]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        let id = solve_id(1, 2);
        assert_eq!(Id::parse(&id.to_string()), Some(id));
        assert_ne!(id, solve_id(1, 3));
        assert_ne!(id, solve_id(2, 2));
        let text = id.to_string();
        for other in [
            "",
            "x",
            &text[1..],
            &format!("{text}0"),
            &"G".repeat(32),
            &"A".repeat(32),
        ] {
            assert_eq!(Id::parse(other), None, "{other}");
        }
        assert_eq!(Id::parse(&"é".repeat(16)), None);
    }
}

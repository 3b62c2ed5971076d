//! Scenes made by hand, one surface after the other.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use nestrad_common::canopy::{Canopy, Material, Mesh, Organ, Pattern, Triangle};
use nestrad_common::light::{Light, SkyLight, Source};
use nestrad_common::optics::{Band, LeafOptics, Optics};
use nestrad_common::scene::Scene;
use nestrad_common::sensors::Sensor;
use nestrad_kernel::elements::Elements;

/// A scene in the making: surfaces first, then bands, then sources. All of it may be changed until a [`Scene`] is
/// made of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scenery {
    /// In order.
    pub triangles: Vec<Triangle>,
    /// What triangles are of.
    pub organs: Vec<Organ>,
    /// What triangles are made of.
    pub materials: Vec<Material>,
    /// Where it repeats.
    pub pattern: Option<Pattern>,
    /// Height of the soil plane.
    pub soil_z_m: Option<f64>,
    /// Optics of the materials.
    pub bands: Vec<Band>,
    /// Parallel sources.
    pub sources: Vec<Source>,
    /// A sky besides.
    pub sky: Option<SkyLight>,
    /// In metres.
    pub sensors: Vec<Sensor>,
}

impl Scenery {
    /// An isolated scene above a black void.
    pub fn open() -> Self {
        Self::default()
    }

    /// A scene that repeats on a rectangle with a corner at the origin, above a black void.
    pub fn periodic(size_m: DVec2) -> Self {
        Self {
            pattern: Some(Pattern {
                min_m: DVec2::ZERO,
                size_m,
            }),
            ..Self::default()
        }
    }

    /// Puts a soil plane under it.
    #[must_use]
    pub fn soil(mut self, z_m: f64) -> Self {
        self.soil_z_m = Some(z_m);
        self
    }

    /// Adds a triangle of an organ that is also its material's name up to the first space: organs
    /// `leaf 1` and `leaf 2` are both of material `leaf`.
    pub fn triangle(&mut self, organ: &str, corners_m: [DVec3; 3]) {
        let name = organ.split(' ').next().unwrap_or_default();
        let material = Material::Named(name.to_owned());
        let number = |found: Option<usize>, end: usize| found.unwrap_or(end) as u32;
        let m = number(
            self.materials.iter().position(|known| *known == material),
            self.materials.len(),
        );
        if m as usize == self.materials.len() {
            self.materials.push(material);
        }
        // organs are built one after the other: the last one is the one to look at
        let o = number(
            self.organs.iter().rposition(|known| known.id == organ),
            self.organs.len(),
        );
        if o as usize == self.organs.len() {
            self.organs.push(Organ {
                id: organ.to_owned(),
                plant: "1".to_owned(),
                ..Organ::default()
            });
        }
        self.triangles.push(Triangle {
            corners_m,
            organ: o,
            material: m,
        });
    }

    /// Adds a planar quadrilateral; its upper face is the one that sees its corners turn to the left.
    pub fn quad(&mut self, organ: &str, [a, b, c, d]: [DVec3; 4]) {
        self.triangle(organ, [a, b, c]);
        self.triangle(organ, [a, c, d]);
    }

    /// Adds a horizontal rectangle with its upper face upwards.
    pub fn level(&mut self, organ: &str, min: DVec3, size: DVec2) {
        let at = |x: f64, y: f64| min + DVec3::new(x * size.x, y * size.y, 0.0);
        self.quad(organ, [at(0., 0.), at(1., 0.), at(1., 1.), at(0., 1.)]);
    }

    /// Adds a band; optics by name of material, black where there is none.
    pub fn band(&mut self, name: &str, soil_albedo: f64, optics: &[(&str, LeafOptics)]) {
        let of = |material: &Material| match material {
            Material::Named(name) => optics
                .iter()
                .find(|(of, _)| of == name)
                .map_or(LeafOptics::default(), |(_, optics)| *optics),
            _ => LeafOptics::default(),
        };
        let materials = self.materials.iter().map(of).collect();
        self.bands.push(Band {
            name: name.to_owned(),
            soil_albedo,
            materials,
        });
    }

    /// Adds a source with the same irradiance (W m⁻² on the horizontal) in all bands built so far.
    pub fn source(&mut self, direction: DVec3, irradiance_W_m2: f64) {
        self.sources.push(Source {
            direction: direction.normalize(),
            irradiance_W_m2: vec![irradiance_W_m2; self.bands.len()],
        });
    }

    /// The vertices of each triangle, to be looked at.
    pub fn corners_m(&self) -> impl ExactSizeIterator<Item = &[DVec3; 3]> {
        self.triangles.iter().map(|triangle| &triangle.corners_m)
    }

    /// The vertices of all triangles, to be moved.
    pub fn vertices_m(&mut self) -> impl Iterator<Item = &mut DVec3> {
        self.triangles
            .iter_mut()
            .flat_map(|triangle| &mut triangle.corners_m)
    }

    /// Number of elements when edges are at most `max_edge_m`.
    pub fn elements(&self, max_edge_m: f64) -> usize {
        Elements::divide(self.corners_m().copied(), max_edge_m).len()
    }

    /// Number of an organ.
    pub fn organ(&self, id: &str) -> usize {
        self.organs.iter().position(|organ| organ.id == id).unwrap()
    }

    /// The geometry alone.
    pub fn canopy(&self) -> Canopy {
        let mesh: Mesh = self.triangles.iter().copied().collect();
        let mut canopy = Canopy::of_meshes(vec![mesh]);
        canopy.organs = self.organs.clone();
        canopy.materials = self.materials.clone();
        canopy.pattern = self.pattern;
        canopy.soil_z_m = self.soil_z_m;
        canopy
    }

    /// The scene as it is now.
    pub fn scene(&self) -> Scene {
        Scene {
            canopy: Arc::new(self.canopy()),
            optics: Arc::new(Optics {
                bands: self.bands.clone(),
            }),
            light: Arc::new(Light {
                suns: self.sources.clone(),
                sky: self.sky.clone(),
            }),
            sensors: self.sensors.clone().into(),
        }
    }
}

/// The direction of travel of light that comes from a zenith angle and an azimuth, in degrees.
pub fn from_zenith(zenith_deg: f64, azimuth_deg: f64) -> DVec3 {
    let (z, a) = (zenith_deg.to_radians(), azimuth_deg.to_radians());
    -DVec3::new(z.sin() * a.cos(), z.sin() * a.sin(), z.cos())
}

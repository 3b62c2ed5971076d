//! Scenes made by hand, one surface after the other.

use glam::{DVec2, DVec3};
use nestrad_common::elements::Elements;
use nestrad_common::light::Source;
use nestrad_common::optics::{Band, LeafOptics};
use nestrad_common::problem::Problem;
use nestrad_common::scene::{Material, Organ, Pattern};

/// A problem in the making: surfaces first, then bands, then sources.
#[derive(Clone, Debug, Default)]
pub struct Scenery {
    /// What has been built so far.
    pub problem: Problem,
}

impl Scenery {
    /// An isolated scene above a black void.
    pub fn open() -> Self {
        Self::default()
    }

    /// A scene that repeats on a rectangle with a corner at the origin, above a black void.
    pub fn periodic(size_m: DVec2) -> Self {
        let mut scenery = Self::default();
        scenery.problem.scene.pattern = Some(Pattern {
            min_m: DVec2::ZERO,
            size_m,
        });
        scenery
    }

    /// Puts a soil plane under it.
    #[must_use]
    pub fn soil(mut self, z_m: f64) -> Self {
        self.problem.scene.soil_z_m = Some(z_m);
        self
    }

    /// Adds a triangle of an organ that is also its material's name up to the first space: organs
    /// `leaf 1` and `leaf 2` are both of material `leaf`.
    pub fn triangle(&mut self, organ: &str, corners: [DVec3; 3]) {
        let scene = &mut self.problem.scene;
        let name = organ.split(' ').next().unwrap_or_default();
        let material = Material::Named(name.to_owned());
        let number = |found: Option<usize>, end: usize| found.unwrap_or(end) as u32;
        let m = number(
            scene.materials.iter().position(|known| *known == material),
            scene.materials.len(),
        );
        if m as usize == scene.materials.len() {
            scene.materials.push(material);
        }
        // organs are built one after the other: the last one is the one to look at
        let o = number(
            scene.organs.iter().rposition(|known| known.id == organ),
            scene.organs.len(),
        );
        if o as usize == scene.organs.len() {
            scene.organs.push(Organ {
                id: organ.to_owned(),
                plant: "1".to_owned(),
            });
        }
        scene.triangles.push(corners);
        scene.organ.push(o);
        scene.material.push(m);
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
        let materials = self.problem.scene.materials.iter().map(of).collect();
        self.problem.bands.push(Band {
            name: name.to_owned(),
            soil_albedo,
            materials,
        });
    }

    /// Adds a source with the same irradiance (W m⁻² on the horizontal) in all bands built so far.
    pub fn source(&mut self, direction: DVec3, irradiance_W_m2: f64) {
        self.problem.sources.push(Source {
            direction: direction.normalize(),
            irradiance_W_m2: vec![irradiance_W_m2; self.problem.bands.len()],
        });
    }

    /// Number of elements when edges are at most `max_edge_m`.
    pub fn elements(&self, max_edge_m: f64) -> usize {
        Elements::divide(&self.problem.scene, max_edge_m).len()
    }

    /// Number of an organ.
    pub fn organ(&self, id: &str) -> usize {
        let organs = &self.problem.scene.organs;
        organs.iter().position(|organ| organ.id == id).unwrap()
    }
}

/// The direction of travel of light that comes from a zenith angle and an azimuth, in degrees.
pub fn from_zenith(zenith_deg: f64, azimuth_deg: f64) -> DVec3 {
    let (z, a) = (zenith_deg.to_radians(), azimuth_deg.to_radians());
    -DVec3::new(z.sin() * a.cos(), z.sin() * a.sin(), z.cos())
}

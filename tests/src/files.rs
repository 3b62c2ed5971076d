//! Scenes that go the whole way: written as files, read back through the one door for input.

use std::fs;
use std::path::Path;

use glam::DVec3;
use nestrad_common::assemble::load;
use nestrad_common::inputs::{BandInput, Inputs, LightInput, PatternInput};
use nestrad_common::options::Unit;
use nestrad_common::scene::Scene;

/// What is written as a CAN scene: leaves of species 1, each an organ of its own.
#[derive(Clone, Debug)]
pub struct Written<'a> {
    /// In metres.
    pub leaves: &'a [[DVec3; 3]],
    /// Two corners, in metres.
    pub pattern_m: Option<[f64; 4]>,
    /// Height of the soil, in metres.
    pub soil_m: Option<f64>,
    /// Text of one `.opt` file a band.
    pub optics: &'a [&'a str],
    /// Text of the `.light` file.
    pub light: &'a str,
    /// Unit of the files.
    pub unit: Unit,
    /// What all coordinates are moved by before they are written, in metres.
    pub moved_m: DVec3,
}

impl Written<'_> {
    /// Writes the files to a folder and loads them.
    pub fn load(&self, folder: &Path) -> Scene {
        load(&self.inputs(folder)).unwrap().scene
    }

    /// Writes the files to a folder.
    pub fn inputs(&self, folder: &Path) -> Inputs {
        let scale = match self.unit {
            Unit::Metre => 1.0,
            Unit::Centimetre => 100.0,
            Unit::Millimetre => 1000.0,
        };
        let file = |name: &str, text: &str| {
            let path = folder.join(name);
            fs::write(&path, text).unwrap();
            path
        };
        let mut can = String::new();
        for (k, triangle) in self.leaves.iter().enumerate() {
            can += &format!("p 1 100001{:03}001 3", k + 1);
            for vertex in triangle {
                let v = (*vertex + self.moved_m) * scale;
                can += &format!(" {} {} {}", v.x, v.y, v.z);
            }
            can += "\n";
        }
        let band = |(k, text): (usize, &&str)| BandInput {
            name: format!("band {k}"),
            optics: Some(file(&format!("{k}.opt"), text)),
            ..BandInput::default()
        };
        let m = self.moved_m;
        let corners = |[x0, y0, x1, y1]: [f64; 4]| {
            PatternInput::Corners([x0 + m.x, y0 + m.y, x1 + m.x, y1 + m.y].map(|c| c * scale))
        };
        Inputs {
            scenes: vec![file("scene.can", &can)],
            unit: Some(self.unit),
            pattern: self.pattern_m.map(corners),
            soil: self.soil_m.map(|z| (z + m.z) * scale),
            bands: self.optics.iter().enumerate().map(band).collect(),
            light: Some(LightInput::File(file("sun.light", self.light))),
            ..Inputs::default()
        }
    }
}

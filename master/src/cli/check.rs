//! `nestrad check`: what is in a scene and what is wrong with it. Nothing is computed.

use std::sync::Arc;

use anyhow::Result;
use clap::Args;
use glam::DVec3;
use nestrad_common::assemble::{Examined, examine};
use nestrad_common::canopy::Canopy;
use nestrad_common::figures::fixed;
use nestrad_common::inspection::{Inspection, MaterialFacts, SunFacts};
use nestrad_common::light::{Light, Source};
use nestrad_common::optics::{Band, FaceOptics, LeafOptics, Optics};
use nestrad_common::options::Options;
use nestrad_common::printable;
use nestrad_common::scene::Scene;
use nestrad_common::sensors::Sensor;
use nestrad_engine::plan::Estimator;
use nestrad_engine::rounds::first_plan;

use super::console::{self, Notes};
use super::flags::SceneFlags;
use super::settings::settings;

/// Show what is in a scene and what is wrong with it; compute nothing
///
/// Geometry is required; optics and light are checked if they are given. Facts and warnings go to stdout. The
/// exit code is 1 if `solve` would refuse what is given, with the options of the scene file.
#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    #[command(flatten)]
    scene: SceneFlags,
}

impl CheckArgs {
    pub(crate) fn run(self) -> Result<()> {
        let inputs = self.scene.inputs(Options::default())?;
        let Examined {
            canopy,
            optics,
            light,
            light_bands,
            sensors,
            faults,
        } = examine(&inputs);
        let mut facts = Facts::default();
        if let Some((_, inspection)) = &canopy {
            facts.geometry(inspection);
        }
        match (&canopy, &optics) {
            (Some((canopy, _)), Some(optics)) => facts.optics(canopy, optics),
            _ if inputs.bands.is_empty() => facts.line("band", "none is given; solve needs one"),
            _ => {}
        }
        match &light {
            Some(light) => facts.light(light, &light_bands),
            None if inputs.light.is_none() => facts.line("light", "none is given; solve needs it"),
            None => {}
        }
        if let Some((canopy, inspection)) = &canopy {
            facts.sensors(&sensors, canopy.origin_m);
            facts.warnings(inspection);
            console::print(facts.0.as_bytes())?;
        }
        let mut errors: Vec<anyhow::Error> = faults.into_iter().map(Into::into).collect();
        if errors.is_empty()
            && let Some((canopy, _)) = canopy
        {
            let settings = settings(&inputs.options, None, Estimator::default());
            let scene = complete(canopy, optics, light);
            errors.extend(first_plan(&scene, &settings).err().map(Into::into));
        }
        let Some(last) = errors.pop() else {
            return Ok(());
        };
        for error in errors {
            Notes { quiet: false }.say("error", &error.to_string());
        }
        Err(last)
    }
}

/// A scene to plan a solve of. Where optics or light are not given yet, there are the simplest: a black band, and light
/// from the zenith.
fn complete(canopy: Canopy, optics: Option<Optics>, light: Option<Light>) -> Scene {
    let optics = optics.unwrap_or_else(|| {
        let count = light.as_ref().map_or(1, bands_of);
        let black = |number: usize| Band {
            name: number.to_string(),
            soil_albedo: 0.0,
            materials: vec![LeafOptics::default(); canopy.materials.len()],
        };
        Optics {
            bands: (0..count).map(black).collect(),
        }
    });
    let light = light.unwrap_or_else(|| Light {
        suns: vec![Source {
            direction: DVec3::NEG_Z,
            irradiance_W_m2: vec![1.0; optics.len()],
        }],
        sky: None,
    });
    Scene {
        canopy: canopy.into(),
        optics: optics.into(),
        light: light.into(),
        sensors: Arc::default(),
    }
}

/// How many bands a light is given for.
fn bands_of(light: &Light) -> usize {
    let suns = light.suns.first().map(|sun| sun.irradiance_W_m2.len());
    let sky = light.sky.as_ref().map(|sky| sky.irradiance_W_m2.len());
    suns.or(sky).unwrap_or(1)
}

/// Lines of text: a word, and what is to be said of it.
#[derive(Default)]
struct Facts(String);

impl Facts {
    fn line(&mut self, what: &str, text: &str) {
        let text = printable::line(text);
        self.0.push_str(&format!("{what:<10}{text}\n"));
    }

    fn geometry(&mut self, facts: &Inspection) {
        let Inspection {
            triangles,
            organs,
            plants,
            smallest_m2,
            largest_m2,
            ..
        } = facts;
        let counts = format!("{triangles} in {organs} organs of {plants} plants");
        self.line("triangles", &counts);
        let areas = format!("of {smallest_m2:.2e} to {largest_m2:.2e} m² each");
        self.line("", &areas);
        let [low, high] = [facts.lower_m, facts.upper_m];
        let ranges: Vec<String> = (0..3)
            .map(|k| [low[k], high[k]].map(|x| fixed(x, 3)))
            .zip(["x", "y", "z"])
            .map(|([low, high], axis)| format!("{axis} {low} to {high} m"))
            .collect();
        self.line("extent", &ranges.join(", "));
        let pattern = match facts.pattern_m {
            Some([x, y]) => {
                let overhang_m = facts.overhang_m;
                format!("{x:.3} m by {y:.3} m; the scene reaches {overhang_m:.3} m beyond it")
            }
            None => "none: the scene stands alone".to_owned(),
        };
        self.line("pattern", &pattern);
        let soil = match facts.soil_z_m {
            Some(z) => format!("a plane at z = {} m", fixed(z, 3)),
            None => "no plane: light escapes downwards".to_owned(),
        };
        self.line("soil", &soil);
        if let Some(index) = facts.area_index {
            let ground = match facts.pattern_m {
                Some(_) => "ground",
                None => "the box around the scene",
            };
            let index = fixed(index, 3);
            let index = format!("{index} m² of leaves and stems, one-sided, per m² of {ground}");
            self.line("area", &index);
        }
        for material in &facts.materials {
            let (triangles, area_m2) = (material.triangles, material.area_m2);
            let area_m2 = fixed(area_m2, 4);
            let MaterialFacts { name, kind, .. } = material;
            let text = format!("{name}: {triangles} triangles, {area_m2} m², {kind}");
            self.line("material", &text);
        }
    }

    fn optics(&mut self, canopy: &Canopy, optics: &Optics) {
        for band in &optics.bands {
            let face = |f: FaceOptics| format!("rho {} tau {}", f.rho, f.tau);
            let mut parts = Vec::new();
            if canopy.soil_z_m.is_some() {
                parts.push(format!("soil rho {}", band.soil_albedo));
            }
            for (material, optics) in canopy.materials.iter().zip(&band.materials) {
                let (upper, lower) = (face(optics.upper), face(optics.lower));
                parts.push(if upper == lower {
                    format!("{material} {upper}")
                } else {
                    format!("{material} upper {upper}, lower {lower}")
                });
            }
            self.line("band", &format!("{}: {}", band.name, parts.join("; ")));
        }
    }

    fn light(&mut self, light: &Light, bands: &[String]) {
        let Light { suns, sky } = light;
        let totals = bands.iter().enumerate().map(|(b, name)| {
            let name = if name.is_empty() { "every band" } else { name };
            format!("{name} {} W m⁻²", fixed(light.irradiance_W_m2(b), 2))
        });
        let totals = totals.collect::<Vec<_>>().join(", ");
        let s = if suns.len() == 1 { "" } else { "s" };
        let what = match (suns.len(), sky) {
            (0, Some(_)) => "a sky".to_owned(),
            (n, Some(_)) => format!("a sky and {n} source{s}"),
            (n, None) => format!("{n} source{s}"),
        };
        self.line("light", &format!("{what}: {totals}"));
        let heights = suns.iter().map(|sun| sun.elevation_deg());
        let lowest = heights.clone().fold(f64::INFINITY, f64::min);
        let highest = heights.fold(0.0, f64::max);
        match SunFacts::of(suns) {
            Some(sun) => self.line("sun", &sun.to_string()),
            None if suns.is_empty() => {}
            None => {
                let range = format!("{lowest:.2} to {highest:.2} degrees above the horizon");
                self.line("sources", &range);
            }
        }
    }

    /// Those of a name that follow one another, in one line.
    fn sensors(&mut self, sensors: &[Sensor], origin_m: DVec3) {
        for named in sensors.chunk_by(|a, b| a.name == b.name) {
            let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            let mut sides: Vec<&str> = Vec::new();
            for sensor in named {
                for corner in sensor.shape.corners_m() {
                    (low, high) = (low.min(corner), high.max(corner));
                }
                if !sides.contains(&sensor.side()) {
                    sides.push(sensor.side());
                }
            }
            let [low, high] = [low + origin_m, high + origin_m].map(|p| p.to_array());
            let ranges = ["x", "y", "z"].into_iter().zip(low.into_iter().zip(high));
            let ranges = ranges.map(|(axis, (low, high))| {
                let [low, high] = [low, high].map(|x| fixed(x, 3));
                if low == high {
                    format!("{axis} {low}")
                } else {
                    format!("{axis} {low} to {high}")
                }
            });
            let text = format!(
                "{}: {} readings ({}) at {} m, {} rays each",
                named[0].name,
                named.len(),
                sides.join(", "),
                ranges.collect::<Vec<_>>().join(", "),
                named[0].rays
            );
            self.line("sensor", &text);
        }
    }

    fn warnings(&mut self, facts: &Inspection) {
        for warning in &facts.warnings {
            self.line("warning", warning);
        }
    }
}

//! Flags that say what to compute: shared by `solve` and `check`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::Result;
use clap::error::ErrorKind;
use clap::Args;
use nestrad_common::assemble;
use nestrad_common::inputs::{BandInput, Inputs, KindsInput, LightInput, PatternInput};
use nestrad_common::light::{Sky, SkyModel, SunnySky};
use nestrad_common::options::{Options, Unit, Up};

use super::numbers::number;

/// The canopy, its optics and its light. What is said here wins over what a scene file says.
#[derive(Debug, Args)]
#[command(next_help_heading = "What to compute")]
pub(crate) struct SceneFlags {
    #[command(flatten)]
    canopy: CanopyFlags,

    #[command(flatten)]
    light: LightFlags,
}

/// The canopy and its optics. What is said here wins over what a scene file says.
#[derive(Debug, Args)]
#[command(next_help_heading = "What to compute")]
pub(crate) struct CanopyFlags {
    /// The canopy: CAN or OBJ files (.can, .obj, plain or .gz), or a scene file (.toml)
    ///
    /// A scene file can hold all that flags can say; a flag replaces what the file says. Geometry files given
    /// with a scene file replace those that it names.
    #[arg(required = true, value_name = "SCENE", help_heading = "Arguments")]
    scenes: Vec<PathBuf>,

    /// Optical properties of a wavelength band: one .opt file for each band; repeat for more bands
    ///
    /// You choose NAME, and the results use it: --optics PAR=par.opt --optics NIR=nir.opt
    #[arg(long, value_name = "NAME=FILE", value_parser = named_file)]
    optics: Vec<(String, PathBuf)>,

    /// The rectangle on which the canopy repeats without end, a .8 file [default: the canopy stands alone]
    #[arg(long, value_name = "FILE")]
    pattern: Option<PathBuf>,

    /// Height of a horizontal soil plane, in --unit [default: no soil plane, light escapes downwards]
    #[arg(long, value_name = "Z", value_parser = number, allow_negative_numbers = true)]
    soil: Option<f64>,

    /// Unit of length of geometry, pattern and --soil: m, cm or mm; results are in m [default: m]
    #[arg(long)]
    unit: Option<Unit>,

    /// The axis of the geometry files that points up: y or z. With y, the x of a file stays, its y becomes z
    /// and its z becomes -y; in pattern, --soil and light z always points up [default: z]
    #[arg(long, value_name = "AXIS")]
    up: Option<Up>,
}

/// The light, in files or as a built-in sky.
#[derive(Debug, Args)]
#[command(next_help_heading = "What to compute")]
struct LightFlags {
    /// Sources of light: one .light file for all bands, or one file for each band (NAME=FILE)
    ///
    /// Each line of the file is a parallel source: irradiance on a horizontal surface (W m-2) and direction of
    /// travel x y z.
    #[arg(long, value_name = "FILE|NAME=FILE", value_parser = light_file)]
    light: Vec<(Option<String>, PathBuf)>,

    /// A built-in sky instead of --light; needs --irradiance: standard-overcast (Moon and Spencer: the zenith three times
    /// as bright as the horizon) or uniform-overcast; or a sky with its sun, clear (the same as cie-12), cie-1 to cie-15 or
    /// perez, which needs --time, --latitude, --longitude and --diffuse-fraction
    #[arg(
        long,
        value_parser = sky_model,
        value_name = "SKY",
        conflicts_with = "light",
        requires = "irradiance"
    )]
    sky: Option<SkyModel>,

    /// Irradiance of the sky on a horizontal surface above the canopy in a band, W m-2; once for each band
    #[arg(long, value_name = "NAME=W_m2", value_parser = named_number, requires = "sky")]
    irradiance: Vec<(String, f64)>,

    /// Sky with a sun: date and time in UTC, such as 2024-06-21T10:00:00Z (or +00:00)
    #[arg(long, value_name = "UTC", requires = "sky")]
    time: Option<String>,

    /// Sky with a sun: degrees, north positive
    #[arg(
        long,
        value_name = "DEGREES",
        requires = "sky",
        value_parser = number,
        allow_negative_numbers = true
    )]
    latitude: Option<f64>,

    /// Sky with a sun: degrees, east positive
    #[arg(
        long,
        value_name = "DEGREES",
        requires = "sky",
        value_parser = number,
        allow_negative_numbers = true
    )]
    longitude: Option<f64>,

    /// Sky with a sun: the diffuse part of the irradiance, 0 to 1; the rest comes directly from the sun
    #[arg(
        long,
        value_name = "PART",
        requires = "sky",
        value_parser = number,
        allow_negative_numbers = true
    )]
    diffuse_fraction: Option<f64>,

    /// Sky of Perez: global irradiance of the horizontal, all wavelengths together, W m-2; with --diffuse-fraction it says
    /// how clear and how bright the sky is
    #[arg(
        long,
        value_name = "W_m2",
        requires = "sky",
        value_parser = number,
        allow_negative_numbers = true
    )]
    ghi: Option<f64>,
}

impl SceneFlags {
    /// Flags over the scene file, if there is one.
    pub(crate) fn inputs(self, options: Options) -> Result<Inputs> {
        let light = self.light.light()?;
        self.canopy.inputs(light, BTreeMap::new(), options)
    }
}

impl CanopyFlags {
    /// Flags over the scene file, if there is one, with a light and parts of weather that are given elsewhere.
    pub(crate) fn inputs(
        &self,
        light: Option<LightInput>,
        band_fraction: BTreeMap<String, f64>,
        options: Options,
    ) -> Result<Inputs> {
        let is_toml = |path: &PathBuf| assemble::is_scene_file(path);
        let (files, scenes): (Vec<_>, Vec<_>) = self.scenes.iter().cloned().partition(is_toml);
        let file = match &files[..] {
            [] => Inputs::default(),
            [file] => assemble::load_scene_file(file)?,
            _ => return Err(misuse("expected one scene file (.toml), found more")),
        };
        let bands = self.optics.iter().map(|(name, path)| BandInput {
            name: name.clone(),
            optics: Some(path.clone()),
            ..BandInput::default()
        });
        let flags = Inputs {
            scenes,
            unit: self.unit,
            up: self.up,
            pattern: self.pattern.clone().map(PatternInput::File),
            soil: self.soil,
            // said in a scene file alone
            kinds: KindsInput::default(),
            bands: bands.collect(),
            light,
            band_fraction,
            options,
        };
        Ok(flags.over(file))
    }
}

impl LightFlags {
    fn light(self) -> Result<Option<LightInput>> {
        if let Some(kind) = self.sky {
            let irradiance_W_m2 = once("--irradiance", self.irradiance.clone())?;
            return Ok(Some(LightInput::Sky {
                sky: self.sky(kind)?,
                irradiance_W_m2,
            }));
        }
        match &self.light[..] {
            [] => Ok(None),
            [(None, file)] => Ok(Some(LightInput::File(file.clone()))),
            several => {
                let named = several
                    .iter()
                    .map(|(name, file)| name.clone().map(|name| (name, file.clone())));
                let named: Option<Vec<_>> = named.collect();
                let expected = "--light: expected one FILE, or NAME=FILE for each band";
                let named = named.ok_or_else(|| misuse(expected))?;
                Ok(Some(LightInput::Files(once("--light", named)?)))
            }
        }
    }

    fn sky(self, model: SkyModel) -> Result<Sky> {
        let sun = (
            self.time,
            self.latitude,
            self.longitude,
            self.diffuse_fraction,
        );
        let sunny = match (model, self.ghi) {
            (SkyModel::Uniform | SkyModel::MoonSpencer, ghi) => {
                if ghi.is_some() || sun != (None, None, None, None) {
                    return Err(misuse(
                        "--time, --latitude, --longitude, --diffuse-fraction and --ghi are for skies with a sun \
                         (--sky clear, cie-1 to cie-15, perez)",
                    ));
                }
                return Ok(match model {
                    SkyModel::Uniform => Sky::UniformOvercast,
                    _ => Sky::StandardOvercast,
                });
            }
            (SkyModel::Cie(kind), None) => SunnySky::Cie(kind),
            (SkyModel::Cie(_), Some(_)) => return Err(misuse("--ghi is for --sky perez")),
            (SkyModel::Perez, Some(global_W_m2)) => SunnySky::Perez { global_W_m2 },
            (SkyModel::Perez, None) => return Err(misuse("--sky perez needs --ghi")),
        };
        match sun {
            (Some(time_utc), Some(latitude_deg), Some(longitude_deg), Some(diffuse_fraction)) => {
                Ok(Sky::Sunny {
                    model: sunny,
                    time_utc,
                    latitude_deg,
                    longitude_deg,
                    diffuse_fraction,
                })
            }
            _ => Err(misuse(&format!(
                "--sky {model} needs --time, --latitude, --longitude and --diffuse-fraction"
            ))),
        }
    }
}

pub(super) fn sky_model(text: &str) -> Result<SkyModel, String> {
    text.parse()
}

/// A call that makes no sense, found after parsing.
pub(super) fn misuse(message: &str) -> anyhow::Error {
    clap::Error::raw(ErrorKind::ArgumentConflict, format!("{message}\n")).into()
}

/// Values by name; a name that comes twice is an error.
pub(super) fn once<T>(flag: &str, named: Vec<(String, T)>) -> Result<BTreeMap<String, T>> {
    let mut values = BTreeMap::new();
    for (name, value) in named {
        if values.contains_key(&name) {
            return Err(misuse(&format!("{flag}: band {name} is given twice")));
        }
        values.insert(name, value);
    }
    Ok(values)
}

fn named(text: &str) -> Option<(String, &str)> {
    let (name, value) = text.split_once('=')?;
    (!name.is_empty() && !value.is_empty()).then(|| (name.to_owned(), value))
}

fn named_file(text: &str) -> Result<(String, PathBuf), String> {
    let (name, file) = named(text).ok_or("expected NAME=FILE")?;
    Ok((name, file.into()))
}

/// `./a=b.light` is a file: names of bands hold no slash here.
fn light_file(text: &str) -> Result<(Option<String>, PathBuf), String> {
    match named(text) {
        Some((name, file)) if !name.contains('/') => Ok((Some(name), file.into())),
        _ => Ok((None, text.into())),
    }
}

pub(super) fn named_number(text: &str) -> Result<(String, f64), String> {
    let (name, number) = named(text).ok_or("expected NAME=NUMBER")?;
    match number.parse() {
        Ok(number) => Ok((name, number)),
        Err(_) => Err(format!("expected a number, found {number}")),
    }
}

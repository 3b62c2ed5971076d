//! `nestrad generate`: made-up canopies, with all that it takes to solve them.

use std::path::PathBuf;
use std::str::FromStr;

use anyhow::Result;
use clap::{Args, Subcommand, ValueEnum};
use glam::DVec2;
use nestrad_common::generate::{
    Bean, Generated, LeafAngles, LeafShape, Maize, Overwrite, RandomCanopy, Stand,
};

use super::console::Notes;
use super::numbers::{number, whole};

/// Write a made-up canopy, with optics, light and a scene file, for `nestrad solve DIR/scene.toml`
///
/// The same options give the same files, byte for byte. Files of an earlier canopy are replaced if nobody has
/// changed them. If a file was changed, or something else wrote it, nothing is written unless --force is given.
/// Plants are plausible, but not calibrated on any cultivar. Lengths are in metres.
#[derive(Debug, Args)]
pub(crate) struct GenerateArgs {
    #[command(subcommand)]
    what: Canopy,
}

#[derive(Debug, Subcommand)]
enum Canopy {
    /// Maize at flowering, 2.2 m high: long bending leaves on straight stems
    Maize(PlantFlags),
    /// Bean at full canopy, 0.6 m high: leaves of three broad leaflets
    Bean(PlantFlags),
    /// Flat leaves anywhere in a layer, by leaf area index and leaf angles
    Random(RandomFlags),
}

#[derive(Debug, Args)]
struct Place {
    /// Folder for the files; created if it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Overwrite files of the same names even if something else wrote them, or if they were changed afterwards
    #[arg(long)]
    force: bool,

    /// Another seed, other plants
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>(0..=u64::MAX), allow_negative_numbers = true)]
    seed: u64,
}

impl Place {
    fn overwrite(&self) -> Overwrite {
        if self.force {
            Overwrite::All
        } else {
            Overwrite::Own
        }
    }
}

#[derive(Debug, Args)]
struct PlantFlags {
    /// Number of rows x plants in each row; rows run along x. The pattern is the ground that they take
    #[arg(long, value_name = "ROWSxPLANTS", default_value = "2x4")]
    rows: Pair<u32>,

    /// Distance between rows, metres [default: maize 0.75, bean 0.5]
    #[arg(long, value_name = "METRES", value_parser = number, allow_negative_numbers = true)]
    row_spacing: Option<f64>,

    /// Distance between plants in a row, metres [default: maize 0.2, bean 0.1]
    #[arg(long, value_name = "METRES", value_parser = number, allow_negative_numbers = true)]
    plant_spacing: Option<f64>,

    /// Mean area of the triangles that leaves consist of, m2, 1e-7 to 1e-2
    /// [default: maize 8e-5, bean 5e-5]
    #[arg(long, value_name = "M2", value_parser = number, allow_negative_numbers = true)]
    leaf_triangle: Option<f64>,

    #[command(flatten)]
    place: Place,
}

#[derive(Debug, Args)]
struct RandomFlags {
    /// Leaf area index: one-sided leaf area per area of ground
    #[arg(long, default_value_t = 3.0, value_parser = number, allow_negative_numbers = true)]
    lai: f64,

    /// Leaf angles: spherical, uniform, planophile, erectophile, plagiophile, extremophile,
    /// horizontal, or ellipsoidal:CHI with the ratio of the horizontal to the vertical half-axis
    #[arg(long, value_name = "NAME", default_value = "spherical")]
    angles: LeafAngles,

    /// Area of a leaf, m2; adjusted so that a whole number of leaves gives --lai
    #[arg(long, value_name = "M2", default_value_t = 4e-4, value_parser = number, allow_negative_numbers = true)]
    leaf_area: f64,

    /// Outline of the leaves
    #[arg(long, value_enum, default_value_t = Shape::Square)]
    shape: Shape,

    /// The rectangle on which the canopy repeats, metres along x and y
    #[arg(long, value_name = "XxY", default_value = "1x1")]
    size: Pair<f64>,

    /// Height of the layer, metres; at least the length of a leaf
    #[arg(long, value_name = "METRES", default_value_t = 1.0, value_parser = number, allow_negative_numbers = true)]
    height: f64,

    #[command(flatten)]
    place: Place,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Shape {
    /// Octagons, 6 triangles each
    Disc,
    /// 2 triangles each
    Square,
}

impl GenerateArgs {
    pub(crate) fn run(self) -> Result<()> {
        match self.what {
            Canopy::Maize(flags) => {
                let default = Maize::default();
                let canopy = Maize {
                    stand: flags.stand(default.stand),
                    leaf_triangle_m2: flags.leaf_triangle.unwrap_or(default.leaf_triangle_m2),
                    seed: flags.place.seed,
                };
                write(&canopy.generate()?, &flags.place, "maize")
            }
            Canopy::Bean(flags) => {
                let default = Bean::default();
                let canopy = Bean {
                    stand: flags.stand(default.stand),
                    leaf_triangle_m2: flags.leaf_triangle.unwrap_or(default.leaf_triangle_m2),
                    seed: flags.place.seed,
                };
                write(&canopy.generate()?, &flags.place, "bean")
            }
            Canopy::Random(flags) => {
                let canopy = RandomCanopy {
                    leaf_area_index: flags.lai,
                    angles: flags.angles,
                    shape: match flags.shape {
                        Shape::Disc => LeafShape::Disc,
                        Shape::Square => LeafShape::Square,
                    },
                    leaf_m2: flags.leaf_area,
                    size_m: DVec2::new(flags.size.0, flags.size.1),
                    height_m: flags.height,
                    seed: flags.place.seed,
                };
                write(&canopy.generate()?, &flags.place, "leaves")
            }
        }
    }
}

impl PlantFlags {
    fn stand(&self, default: Stand) -> Stand {
        Stand {
            rows: self.rows.0,
            plants_per_row: self.rows.1,
            row_spacing_m: self.row_spacing.unwrap_or(default.row_spacing_m),
            plant_spacing_m: self.plant_spacing.unwrap_or(default.plant_spacing_m),
        }
    }
}

/// Writes the files, and says so.
fn write(canopy: &Generated, place: &Place, name: &str) -> Result<()> {
    let folder = &place.out;
    canopy.write(folder, name, place.overwrite())?;
    let size_m = canopy.pattern.size_m;
    let text = format!(
        "{place}: {triangles} triangles, leaf area index {lai:.2}, on {x:.3} m x {y:.3} m\n\
         beside it: {name}.8 (pattern), par.opt, nir.opt, clear.light, scene.toml (names them all)\n\
         solve it: nestrad solve {scene} --out {out}\n",
        place = folder.join(format!("{name}.can")).display(),
        triangles = canopy.triangles.len(),
        lai = canopy.leaf_area_index(),
        x = size_m.x,
        y = size_m.y,
        scene = folder.join("scene.toml").display(),
        out = folder.join("out").display(),
    );
    Notes { quiet: false }.show(text.as_bytes());
    Ok(())
}

/// Two numbers as one word: `4x2`.
#[derive(Clone, Copy, Debug)]
struct Pair<T>(T, T);

impl<T: FromStr> FromStr for Pair<T> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let pair = text.split_once('x');
        let pair = pair.and_then(|(a, b)| Some(Self(a.parse().ok()?, b.parse().ok()?)));
        pair.ok_or_else(|| "expected two numbers with an x between them".to_owned())
    }
}

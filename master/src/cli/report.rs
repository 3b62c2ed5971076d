//! `nestrad report`: a page to look at.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use nestrad_common::assemble;
use nestrad_common::inputs::Inputs;
use nestrad_results::report::{self, PictureRequest, Request};

use super::console::Notes;
use super::numbers::whole;

/// Turn the results of `solve` into one HTML page: the canopy in 3D, profiles, balance, errors
///
/// Writes OUT/report.html, one file that loads nothing else and can be sent by e-mail. It is made from the
/// tables in OUT, CSV or Parquet, and from the files of the canopy, whose paths are in summary.json.
#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// Folder of results, as `nestrad solve --out` wrote it
    #[arg(value_name = "OUT")]
    out: PathBuf,

    /// The files of the canopy, if they were moved after the solve: geometry files in the same order, or the
    /// scene file (.toml)
    #[arg(long, value_name = "FILE")]
    scene: Vec<PathBuf>,

    /// Largest number of triangles that is drawn; a page takes about 60 bytes for each. The page of a larger
    /// canopy has no drawing
    #[arg(long, value_name = "N", default_value_t = 2_000_000, value_parser = whole::<usize>(0..=u64::MAX), allow_negative_numbers = true)]
    most_triangles: usize,

    /// Write a picture of the canopy too, as PNG, for print
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,

    /// Band whose light colours the picture [default: the first]
    #[arg(long, value_name = "NAME", requires = "png")]
    png_band: Option<String>,

    /// Print errors only
    #[arg(long, short)]
    quiet: bool,
}

impl ReportArgs {
    pub(crate) fn run(self) -> Result<()> {
        let notes = Notes { quiet: self.quiet };
        let scene = match &self.scene[..] {
            [] => None,
            [file] if file.extension().is_some_and(|e| e == "toml") => {
                Some(assemble::load_scene_file(file)?)
            }
            files => Some(Inputs {
                scenes: files.to_vec(),
                ..Inputs::default()
            }),
        };
        let written = report::write(&Request {
            out: &self.out,
            scene,
            most_triangles: self.most_triangles,
            picture: self.png.as_deref().map(|path| PictureRequest {
                path,
                band: self.png_band.as_deref(),
            }),
        })?;
        if let Some(missing) = &written.not_drawn {
            notes.say("warning", missing);
        }
        let (place, size) = (written.path.display(), written.bytes as f64 / 1e6);
        notes.say(
            "done",
            &format!("{place}, {size:.1} MB, opens in any browser"),
        );
        Ok(())
    }
}

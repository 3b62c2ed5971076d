//! `nestrad trade`: what speed costs in accuracy, on the user's own scene.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Result;
use clap::Args;
use nestrad_common::assemble;
use nestrad_common::inputs::Inputs;
use nestrad_common::options::Options;
use nestrad_engine::plan::Settings;
use nestrad_engine::progress::Progress;
use nestrad_engine::run::Run;
use nestrad_engine::stop::Stop;
use nestrad_results::trade::request::Request;
use nestrad_results::trade::setting::grid;
use nestrad_results::trade::study::carry_out;
use nestrad_results::trade::table::Comparison;
use nestrad_results::trade::{About, check_place, write};

use super::bar::Bar;
use super::console::Notes;
use super::flags::SceneFlags;
use super::numbers::{positive, whole};
use super::pool::pool;

/// Try settings of `solve` on a scene, and say which is the fastest for each target error
///
/// A reference is computed first, then every setting with several seeds; this takes many times as long as a
/// solve. Writes trade.html (the page to look at), trade.csv and trade.jsonl into DIR; trade.jsonl keeps every
/// run, so that a study that was stopped continues where it ended. Accuracy and diameter in a scene file are
/// ignored. The choice for each target error goes to stdout.
#[derive(Debug, Args)]
pub(crate) struct TradeArgs {
    #[command(flatten)]
    scene: SceneFlags,

    #[command(flatten)]
    how: HowFlags,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "How to study it")]
struct HowFlags {
    /// Folder for the study; created if it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Runs of each setting, at least 2, each with its own seed: their scatter is part of the error bars
    #[arg(long, value_name = "N", default_value_t = 3)]
    #[arg(value_parser = whole::<u32>(2..=1000), allow_negative_numbers = true)]
    seeds: u32,

    /// Smallest target error, percent: rms over organs, relative to the mean
    ///
    /// The reference is planned for half of it, and a built-in sky has other directions in each run.
    #[arg(long, value_name = "PERCENT", default_value_t = 0.2)]
    #[arg(value_parser = positive, allow_negative_numbers = true)]
    finest: f64,

    /// Memory that a solve may take, GiB; a setting that needs more is listed as failed [default: 8]
    #[arg(long, value_name = "GIB", value_parser = positive, allow_negative_numbers = true)]
    memory: Option<f64>,

    /// Number of threads, 0 for one per processor, at most 4 for each [default: 0]
    #[arg(long, value_name = "N", value_parser = whole::<usize>(0..=4096), allow_negative_numbers = true)]
    threads: Option<usize>,

    /// Seed of the first run of each setting; the others follow it [default: 1]
    #[arg(long, value_name = "N", value_parser = whole::<u64>(0..=u64::MAX), allow_negative_numbers = true)]
    seed: Option<u64>,

    /// Print errors only: no progress, no table
    #[arg(long, short)]
    quiet: bool,
}

impl TradeArgs {
    pub(crate) fn run(self) -> Result<()> {
        let Self { scene, how } = self;
        let inputs = scene.inputs(Options {
            memory_GiB: how.memory,
            threads: how.threads,
            seed: how.seed,
            ..Options::default()
        })?;
        let notes = Notes { quiet: how.quiet };
        pool(inputs.options.threads, notes)?.install(|| how.study(&inputs))
    }
}

impl HowFlags {
    fn study(&self, inputs: &Inputs) -> Result<()> {
        let notes = Notes { quiet: self.quiet };
        let default = Settings::default();
        let seed = inputs.options.seed.unwrap_or(default.seed);
        // before the work, not after it
        check_place(&self.out)?;
        let mut loaded = assemble::load(inputs)?;
        // a study is of organs
        loaded.scene.sensors = Arc::default();
        for warning in &loaded.inspection.warnings {
            notes.say("warning", warning);
        }
        let settings = grid(&loaded.scene.canopy, self.finest);
        let request = Request {
            scene: &loaded.scene,
            out: &self.out,
            settings: &settings,
            finest_percent: self.finest,
            memory_GiB: inputs.options.memory_GiB.unwrap_or(default.memory_GiB),
            runs: self.seeds,
            seed,
        };
        let progress = Arc::new(Progress::default());
        let _bar = Bar::of(&progress, self.quiet);
        let run = Run {
            stop: &Stop::default(),
            progress: &progress,
        };
        let study = carry_out(&request, &run, |line| notes.say("trade", line))?;
        let comparison = Comparison::of(&request, &study);
        let scenes: Vec<String> = inputs
            .scenes
            .iter()
            .map(|path| path.display().to_string())
            .collect();
        let about = About {
            title: &scenes.join(", "),
            runs: self.seeds,
            threads: rayon::current_num_threads(),
        };
        write(&self.out, &about, &comparison)?;
        if self.quiet {
            return Ok(());
        }
        let mut table = Vec::new();
        comparison.write_choices(&mut table)?;
        notes.show(&table);
        for (row, why) in comparison.failed() {
            notes.say("failed", &format!("{}: {why}", row.setting));
        }
        let (computed, place) = (study.computed, self.out.display());
        let line = format!("{computed} runs were computed, results are in {place}");
        notes.say("done", &line);
        Ok(())
    }
}

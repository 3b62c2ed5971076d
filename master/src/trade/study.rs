//! The study: a reference, then every setting with every seed; what the ledger has is not computed again.

use std::borrow::Cow;
use std::fmt::{self, Write as _};
use std::path::Path;

use nestrad_common::light::SkyLight;
use nestrad_common::light::sky::SkyError;
use nestrad_common::options::Diameter;
use nestrad_common::problem::Problem;
use serde::{Deserialize, Serialize};

use super::error::TradeError;
use super::ledger::Ledger;
use super::measure::Reference;
use super::pace::Pace;
use super::setting::{Factors, Setting};
use crate::errors::ErrorParts;
use crate::heap::Freed;
use crate::output::progress::Progress;
use crate::output::resources::{Stage, Stopwatch, forget_peak_memory};
use crate::plan::{Aims, Plan, PlanError};
use crate::run::{Finished, RunError, solve};
use crate::world::is_soil;

/// What to study.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// The scene under its light.
    pub problem: &'a Problem,
    /// The sky that it is lit by, if it is: every run has its own directions of it, as many as its accuracy asks
    /// for, so that their error is in its own.
    pub sky: Option<&'a SkyLight>,
    /// Folder of the ledger.
    pub out: &'a Path,
    /// Settings to try.
    pub settings: &'a [Setting],
    /// Finest error that a setting is wanted for, percent; the reference is about half of it.
    pub finest_percent: f64,
    /// Memory that a solve may take, GiB.
    pub memory_GiB: f64,
    /// Runs of each setting, at least two: their scatter is in the error bars.
    pub runs: u32,
    /// Seed of the first run; the others follow it.
    pub seed: u64,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Study {
    /// Accuracy that the reference was planned for, percent.
    pub reference_percent: f64,
    /// Bands in which plants absorb, with what others are measured against.
    pub bands: Vec<(String, Reference)>,
    /// One for each setting, in their order: its runs, or why there are none.
    pub measured: Vec<Result<Vec<Done>, String>>,
    /// Solves that were computed, and not found in the ledger.
    pub computed: usize,
}

/// A line of the ledger.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
enum Record {
    /// A run of the reference.
    Reference(Organs),
    /// A run of a setting.
    Run(Done),
    /// A run that failed, and why.
    Failed(String),
}

/// What each organ absorbs.
#[derive(Clone, Debug, Deserialize, Serialize)]
struct Organs {
    area_m2: Vec<f64>,
    /// Indexed organ * bands + band.
    absorbed_W: Vec<f64>,
}

/// A run of a setting.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Done {
    /// Per band of the study: squared error against the reference, whose own is in it, percent².
    pub square_percent2: Vec<f64>,
    /// Per band of the study: error by the run's own account, percent.
    pub stated_percent: Vec<Option<f64>>,
    /// Seconds that passed.
    pub wall_s: f64,
    /// Processor seconds of all threads.
    pub cpu_s: f64,
    /// Peak memory of the process during the run; absent where the system does not tell.
    pub peak_memory_bytes: Option<u64>,
    /// Bytes of the rows of the exchange.
    pub row_bytes: u64,
    /// The cost of each stage.
    pub stages: Vec<Stage>,
}

/// Runs of the reference.
const REFERENCE_RUNS: u64 = 3;
/// Seeds of the reference are so far from those of the runs.
const REFERENCE_SEEDS: u64 = 1 << 32;
/// A reference is planned for this part of the finest target.
const FINER: f64 = 0.5;
/// Direct light of a reference is finer than its accuracy asks for, as it costs little.
const REFERENCE_TIMES: Factors = Factors {
    sets: 1.0,
    line_pitch: 1.0,
    direct_pitch: 0.7,
    max_edge: 1.0,
    tolerance: 0.1,
};
/// A reference is not coarser than this.
const COARSEST_PERCENT: f64 = 5.0;

/// Carries out a study. `say` is told of every run before it begins.
pub fn run(
    request: &Request<'_>,
    progress: &Progress,
    mut say: impl FnMut(&str),
) -> Result<Study, TradeError> {
    let mut ledger = Ledger::open(&request.out.join("trade.jsonl"))?;
    for line in ledger.unreadable() {
        say(&format!(
            "trade.jsonl: line {line} is no record, passed over"
        ));
    }
    let problem = request.problem;
    let world = digest(problem);
    let mut computed = 0;
    let (reference_percent, plans) = reference_plans(request)?;
    let (mut keys, mut organs) = (Vec::new(), Vec::new());
    for (number, (problem, plan)) in plans.iter().enumerate() {
        let key = key(&[&world, &sources(problem), "reference", &json(plan)?]);
        if !matches!(ledger.get(&key), Some(Record::Reference(_))) {
            say(&format!(
                "reference, run {} of {REFERENCE_RUNS}",
                number + 1
            ));
            let (finished, _) = solved(problem, plan, progress).map_err(TradeError::Reference)?;
            let solution = finished.solution;
            let record = Organs {
                area_m2: solution.organ_area_m2,
                absorbed_W: solution.organs.iter().map(|o| o.absorbed_W).collect(),
            };
            ledger.add(&key, Record::Reference(record))?;
            computed += 1;
        }
        if let Some(Record::Reference(own)) = ledger.get(&key) {
            organs.push(own.clone());
        }
        keys.push(key);
    }
    let plants = plants(problem, &organs);
    let (numbers, bands) = references(problem, &plants, &organs);
    if bands.is_empty() {
        return Err(TradeError::Dark);
    }
    let against = key(&keys.iter().map(String::as_str).collect::<Vec<_>>());
    let mut measured: Vec<Result<Vec<Done>, String>> = vec![Ok(Vec::new()); request.settings.len()];
    let total = request.settings.len() * request.runs as usize;
    let (mut number, mut pace) = (0, Pace::new(request.settings.len()));
    // seeds outermost: a machine that slows down does so for all settings
    for run in 0..u64::from(request.runs) {
        for (place, setting) in request.settings.iter().enumerate() {
            number += 1;
            if measured[place].is_err() {
                continue;
            }
            let seed = request.seed.wrapping_add(run);
            let problem = &*request.lit(setting.accuracy_percent, seed)?;
            let plan = match setting.plan(problem, request.memory_GiB, seed) {
                Ok(plan) => plan,
                Err(error) => {
                    measured[place] = Err(error.to_string());
                    pace.failed(place);
                    continue;
                }
            };
            let threads = rayon::current_num_threads().to_string();
            let key = key(&[&world, &sources(problem), &against, &json(&plan)?, &threads]);
            if ledger.get(&key).is_none() {
                let left = pace.left(place, u64::from(request.runs) - 1 - run);
                say(&format!(
                    "run {number} of {total}, {setting}, seed {seed}; {left}"
                ));
                let record = match solved(problem, &plan, progress) {
                    Ok((finished, cost)) => {
                        measure(problem, &plants, (&numbers, &bands), &finished, cost)
                    }
                    Err(RunError::Cancelled(_)) => return Err(TradeError::Cancelled),
                    Err(error) => Record::Failed(error.to_string()),
                };
                ledger.add(&key, record)?;
                computed += 1;
            }
            match ledger.get(&key) {
                Some(Record::Run(done)) => {
                    pace.took(place, done.wall_s);
                    if let Ok(runs) = &mut measured[place] {
                        runs.push(done.clone());
                    }
                }
                Some(Record::Failed(why)) => {
                    measured[place] = Err(format!("seed {seed}: {why}"));
                    pace.failed(place);
                }
                Some(Record::Reference(_)) | None => {}
            }
        }
    }
    Ok(Study {
        reference_percent,
        bands,
        measured,
        computed,
    })
}

impl<'a> Request<'a> {
    /// The scene as a solve for that accuracy would light it.
    fn lit(&self, accuracy_percent: f64, seed: u64) -> Result<Cow<'a, Problem>, SkyError> {
        let mut problem = Cow::Borrowed(self.problem);
        if let Some(sky) = self.sky {
            let directions = Aims::of(accuracy_percent).sky_directions();
            problem.to_mut().light_by(sky, directions, seed)?;
        }
        Ok(problem)
    }
}

/// A scene under its light, and the plan for it.
type Lit<'a> = (Cow<'a, Problem>, Plan);

/// Plans of the reference, as fine as the memory allows.
fn reference_plans<'a>(request: &Request<'a>) -> Result<(f64, Vec<Lit<'a>>), TradeError> {
    let mut percent = FINER * request.finest_percent;
    loop {
        let setting = Setting {
            times: REFERENCE_TIMES,
            ..Setting::planned(percent, Diameter::Infinite)
        };
        let seeds = (0..REFERENCE_RUNS).map(|k| request.seed.wrapping_add(REFERENCE_SEEDS + k));
        let plan = |seed| -> Result<_, TradeError> {
            let lit = request.lit(percent, seed)?;
            let plan = setting.plan(&lit, request.memory_GiB, seed);
            Ok((lit, plan.map_err(TradeError::ReferencePlan)?))
        };
        let plans: Result<Vec<_>, _> = seeds.map(plan).collect();
        match plans {
            Err(TradeError::ReferencePlan(PlanError::Memory { .. }))
                if percent < COARSEST_PERCENT =>
            {
                percent *= std::f64::consts::SQRT_2;
            }
            plans => return plans.map(|plans| (percent, plans)),
        }
    }
}

/// Numbers of the organs that are plants and have an area.
fn plants(problem: &Problem, runs: &[Organs]) -> Vec<usize> {
    let scene = &problem.scene;
    let mut plant = vec![true; scene.organs.len()];
    for (&organ, soil) in scene.organ.iter().zip(is_soil(scene)) {
        plant[organ as usize] &= !soil;
    }
    let area = |o: usize| runs.first().map_or(0.0, |run| run.area_m2[o]);
    (0..plant.len())
        .filter(|&o| plant[o] && area(o) > 0.0)
        .collect()
}

/// Numbers of the bands in which plants absorb, and what others are measured against in them.
fn references(
    problem: &Problem,
    plants: &[usize],
    runs: &[Organs],
) -> (Vec<usize>, Vec<(String, Reference)>) {
    let bands = problem.bands.len();
    let areas = |run: &Organs| plants.iter().map(|&o| run.area_m2[o]).collect::<Vec<f64>>();
    let of = |b: usize| {
        let per_area = |run: &Organs| {
            let own = plants
                .iter()
                .map(|&o| run.absorbed_W[o * bands + b] / run.area_m2[o]);
            own.collect::<Vec<f64>>()
        };
        let values: Vec<_> = runs.iter().map(per_area).collect();
        let reference = Reference::of(areas(runs.first()?), &values)?;
        Some((b, (problem.bands[b].name.clone(), reference)))
    };
    (0..bands).filter_map(of).unzip()
}

struct Cost {
    wall_s: f64,
    cpu_s: f64,
    peak_memory_bytes: Option<u64>,
    stages: Vec<Stage>,
}

/// A solve, with its own peak of memory.
fn solved(
    problem: &Problem,
    plan: &Plan,
    progress: &Progress,
) -> Result<(Finished, Cost), RunError> {
    Freed::default().give_back();
    let anew = forget_peak_memory();
    let mut watch = Stopwatch::start();
    let finished = solve(problem, plan, progress, &mut watch)?;
    let usage = watch.usage();
    let cost = Cost {
        wall_s: usage.wall_s,
        cpu_s: usage.cpu_s,
        peak_memory_bytes: usage.peak_memory_bytes.filter(|_| anew),
        stages: watch.stages().to_vec(),
    };
    Ok((finished, cost))
}

fn measure(
    problem: &Problem,
    plants: &[usize],
    (numbers, bands): (&[usize], &[(String, Reference)]),
    finished: &Finished,
    cost: Cost,
) -> Record {
    let solution = &finished.solution;
    let all = problem.bands.len();
    let squares = numbers.iter().zip(bands).map(|(&b, (_, reference))| {
        let per_area = plants
            .iter()
            .map(|&o| solution.organs[o * all + b].absorbed_W / solution.organ_area_m2[o]);
        reference.square_percent2(&per_area.collect::<Vec<_>>())
    });
    let square_percent2: Vec<f64> = squares.collect();
    if !square_percent2.iter().all(|s| s.is_finite()) {
        return Record::Failed("an organ's absorbed power is not a finite number".to_owned());
    }
    let stated = |b: usize| {
        let name = &problem.bands[b].name;
        let parts = finished.errors.iter().find(|parts| parts.band == *name);
        parts.map(ErrorParts::total_percent)
    };
    Record::Run(Done {
        square_percent2,
        stated_percent: numbers.iter().map(|&b| stated(b)).collect(),
        wall_s: cost.wall_s,
        cpu_s: cost.cpu_s,
        peak_memory_bytes: cost.peak_memory_bytes,
        row_bytes: 4 * finished.counters.exchange.row_entries,
        stages: cost.stages,
    })
}

fn json(plan: &Plan) -> Result<String, TradeError> {
    serde_json::to_string(plan).map_err(TradeError::Plan)
}

struct Hashing(blake3::Hasher);

impl fmt::Write for Hashing {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}

/// Names the sources of a problem.
fn sources(problem: &Problem) -> String {
    format!("{:?}", problem.sources)
}

/// Names a problem, and the program that solves it: numbers are written so that they read back.
fn digest(problem: &Problem) -> String {
    let mut hasher = Hashing(blake3::Hasher::new());
    let (version, kernel) = (env!("CARGO_PKG_VERSION"), nestrad_worker::kernel());
    // a hasher takes all that it gets
    let _ = write!(hasher, "{version}\n{kernel}\n{problem:?}");
    hasher.0.finalize().to_hex().to_string()
}

fn key(parts: &[&str]) -> String {
    let mut hasher = blake3::Hasher::new();
    for part in parts {
        hasher.update(&(part.len() as u64).to_le_bytes());
        hasher.update(part.as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

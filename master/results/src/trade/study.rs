//! The study: a reference, then every setting with every seed; what the ledger has is not computed again.

use nestrad_common::scene::Scene;
use nestrad_engine::causes::causes;
use nestrad_engine::plan::Aims;
use nestrad_engine::rounds::RoundsError;
use nestrad_engine::run::Run;
use nestrad_engine::solution::BandAccount;
use nestrad_engine::stopwatch::Stage;
use nestrad_engine::traced::SolveError;
use serde::{Deserialize, Serialize};

use super::error::TradeError;
use super::folder::RECORDS;
use super::keys::{digest, key};
use super::ledger::Ledger;
use super::measure::Reference;
use super::pace::Pace;
use super::request::{Cost, How, Request, RunResult};
use super::setting::Setting;

/// What came of it.
#[derive(Clone, Debug)]
pub struct Study {
    /// Error of a run of the reference by its own account, percent, at most.
    pub reference_percent: f64,
    /// Bands in which plants absorb, with what others are measured against.
    pub bands: Vec<(String, Reference)>,
    /// One for each setting, in their order: its runs, or why there are none.
    pub measured: Vec<Result<Vec<SettingRun>, String>>,
    /// Solves that were computed, and not found in the ledger.
    pub computed: usize,
}

/// What a line of the ledger holds.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
enum LedgerLine {
    /// A run of the reference.
    Reference(ReferenceRun),
    /// A run of a setting.
    Run(SettingRun),
    /// A run that failed, and why.
    Failed(String),
}

/// A run of the reference.
#[derive(Clone, Debug, Deserialize, Serialize)]
struct ReferenceRun {
    /// What its last round was planned for.
    aims: Aims,
    /// Error of its worst band by its own account, percent.
    stated_percent: f64,
    area_m2: Vec<f64>,
    /// Indexed organ * bands + band.
    absorbed_W: Vec<f64>,
}

/// A run of a setting.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct SettingRun {
    /// What its last round was planned for.
    pub aims: Aims,
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
/// A reference is asked for this part of the finest target.
const FINER: f64 = 0.5;

/// Carries out a study. `say` is told of every run before it begins.
pub fn carry_out(
    request: &Request<'_>,
    run: &Run,
    mut say: impl FnMut(&str),
) -> Result<Study, TradeError> {
    let mut ledger = Ledger::open(&request.out.join(RECORDS))?;
    for line in ledger.unreadable() {
        say(&format!(
            "trade.jsonl: line {line} is not a record and is ignored"
        ));
    }
    let scene = request.scene;
    let mut computed = 0;
    let (mut references, mut against) = (Vec::<ReferenceRun>::new(), digest(scene));
    for number in 0..REFERENCE_RUNS {
        let setting = Setting::asked(FINER * request.finest_percent);
        let seed = request.seed.wrapping_add(REFERENCE_SEEDS + number);
        let how = match references.first() {
            None => How::Asked(setting, seed),
            // the others need no rounds to come to the same plan
            Some(first) => How::Turned(setting, seed, first.aims),
        };
        let key = key(&[&against, "reference", &request.name(&how)?]);
        if !matches!(ledger.get(&key), Some(LedgerLine::Reference(_))) {
            say(&format!(
                "reference, run {} of {REFERENCE_RUNS}",
                number + 1
            ));
            let solved = request.solved(&how, run);
            let (solved, _) = solved.map_err(TradeError::of_reference)?;
            ledger.add(&key, LedgerLine::Reference(ReferenceRun::of(&solved)))?;
            computed += 1;
        }
        if let Some(LedgerLine::Reference(own)) = ledger.get(&key) {
            references.push(own.clone());
        }
        against = key;
    }
    let plants = plants(scene, &references);
    let (numbers, bands) = judges(scene, &plants, &references);
    if bands.is_empty() {
        return Err(TradeError::Dark);
    }
    let mut measured: Vec<Result<Vec<SettingRun>, String>> =
        vec![Ok(Vec::new()); request.settings.len()];
    let total = request.settings.len() * request.runs as usize;
    let (mut number, mut pace) = (0, Pace::new(request.settings.len()));
    // seeds outermost: a machine that slows down does so for all settings
    for nth in 0..u64::from(request.runs) {
        for (place, setting) in request.settings.iter().enumerate() {
            number += 1;
            if measured[place].is_err() {
                continue;
            }
            let seed = request.seed.wrapping_add(nth);
            let how = how(request, setting, seed, nth as usize, &measured);
            let threads = rayon::current_num_threads().to_string();
            let key = key(&[&against, &request.name(&how)?, &threads]);
            if ledger.get(&key).is_none() {
                let left = pace.left(place, u64::from(request.runs) - 1 - nth);
                say(&format!(
                    "run {number} of {total}, {setting}, seed {seed}; {left}"
                ));
                let line = match request.solved(&how, run) {
                    Ok((solved, cost)) => {
                        measure(scene, &plants, (&numbers, &bands), &solved, cost)
                    }
                    Err(RoundsError::Solve(SolveError::Stopped(stopped))) => {
                        return Err(TradeError::Stopped(stopped));
                    }
                    Err(error) => LedgerLine::Failed(causes(&error)),
                };
                ledger.add(&key, line)?;
                computed += 1;
            }
            match ledger.get(&key) {
                Some(LedgerLine::Run(done)) => {
                    pace.took(place, done.wall_s);
                    if let Ok(runs) = &mut measured[place] {
                        runs.push(done.clone());
                    }
                }
                Some(LedgerLine::Failed(why)) => {
                    measured[place] = Err(format!("seed {seed}: {why}"));
                    pace.failed(place);
                }
                Some(LedgerLine::Reference(_)) | None => {}
            }
        }
    }
    let largest = |error: f64, own: &ReferenceRun| error.max(own.stated_percent);
    Ok(Study {
        reference_percent: references.iter().fold(0.0, largest),
        bands,
        measured,
        computed,
    })
}

/// Knobs are turned off what the same seed came to where nothing was turned.
fn how(
    request: &Request<'_>,
    setting: &Setting,
    seed: u64,
    nth: usize,
    measured: &[Result<Vec<SettingRun>, String>],
) -> How {
    if setting.is_asked() {
        return How::Asked(*setting, seed);
    }
    let accuracy = setting.accuracy_percent;
    let unturned = Setting::asked(accuracy);
    let place = request.settings.iter().position(|s| *s == unturned);
    let done = place.and_then(|place| measured[place].as_ref().ok()?.get(nth));
    let aims = done.map_or_else(|| Aims::of(accuracy), |done| done.aims);
    How::Turned(*setting, seed, aims)
}

impl ReferenceRun {
    fn of(solved: &RunResult) -> Self {
        let solution = &solved.solution;
        let errors = solution.account.iter().map(BandAccount::total_percent);
        Self {
            aims: solved.aims,
            stated_percent: errors.fold(0.0, f64::max),
            area_m2: solution.organ_area_m2.clone(),
            absorbed_W: solution.organs.iter().map(|o| o.absorbed_W).collect(),
        }
    }
}

/// Numbers of the organs that are plants and have an area.
fn plants(scene: &Scene, runs: &[ReferenceRun]) -> Vec<usize> {
    let plant = scene.canopy.plants();
    let area = |o: usize| runs.first().map_or(0.0, |run| run.area_m2[o]);
    (0..plant.len())
        .filter(|&o| plant[o] && area(o) > 0.0)
        .collect()
}

/// Numbers of the bands in which plants absorb, and what others are measured against in them.
fn judges(
    scene: &Scene,
    plants: &[usize],
    runs: &[ReferenceRun],
) -> (Vec<usize>, Vec<(String, Reference)>) {
    let bands = scene.optics.len();
    let areas = |run: &ReferenceRun| plants.iter().map(|&o| run.area_m2[o]).collect::<Vec<f64>>();
    let of = |b: usize| {
        let per_area = |run: &ReferenceRun| {
            let own = plants
                .iter()
                .map(|&o| run.absorbed_W[o * bands + b] / run.area_m2[o]);
            own.collect::<Vec<f64>>()
        };
        let values: Vec<_> = runs.iter().map(per_area).collect();
        let reference = Reference::of(areas(runs.first()?), &values)?;
        Some((b, (scene.optics.bands[b].name.clone(), reference)))
    };
    (0..bands).filter_map(of).unzip()
}

fn measure(
    scene: &Scene,
    plants: &[usize],
    (numbers, bands): (&[usize], &[(String, Reference)]),
    solved: &RunResult,
    cost: Cost,
) -> LedgerLine {
    let solution = &solved.solution;
    let all = scene.optics.len();
    let squares = numbers.iter().zip(bands).map(|(&b, (_, reference))| {
        let per_area = plants
            .iter()
            .map(|&o| solution.organs[o * all + b].absorbed_W / solution.organ_area_m2[o]);
        reference.square_percent2(&per_area.collect::<Vec<_>>())
    });
    let square_percent2: Vec<f64> = squares.collect();
    if !square_percent2.iter().all(|s| s.is_finite()) {
        return LedgerLine::Failed("an organ's absorbed power is not a finite number".to_owned());
    }
    let stated = |b: usize| {
        let name = &scene.optics.bands[b].name;
        let account = solution.account.iter().find(|own| own.band == *name);
        account.map(BandAccount::total_percent)
    };
    LedgerLine::Run(SettingRun {
        aims: solved.aims,
        square_percent2,
        stated_percent: numbers.iter().map(|&b| stated(b)).collect(),
        wall_s: cost.wall_s,
        cpu_s: cost.cpu_s,
        peak_memory_bytes: cost.peak_memory_bytes,
        row_bytes: 4 * solved.work.exchange.row_entries,
        stages: cost.stages,
    })
}

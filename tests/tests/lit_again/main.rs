//! A traced canopy is lit again and again; and what fails in a solve ends the rest of it and says why.

#![allow(clippy::unwrap_used)]

mod resident;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

use nestrad_common::light::Sky;
use nestrad_common::options::Diameter;
use nestrad_common::scene::Scene;
use nestrad_engine::direct::{KeptDirections, direct_light, direct_light_keeping};
use nestrad_engine::exchange::{
    ExchangeError, JobCounts, RowSource, Sampling, Take, ThisProcess, Work,
};
use nestrad_engine::frame::Frame;
use nestrad_engine::plan::{Plan, Settings};
use nestrad_engine::progress::Progress;
use nestrad_engine::rounds::{Ended, RoundsError, Solved, solve_in_rounds};
use nestrad_engine::run::Run;
use nestrad_engine::stop::{Stop, Stopped};
use nestrad_engine::stopwatch::Stopwatch;
use nestrad_engine::traced::{SolveError, TracedCanopy};
use nestrad_tests::canopies::{par_and_nir, scenery, sky, small_maize, uniform_sky};
use nestrad_tests::processes::PATIENCE;
use nestrad_tests::scenery::{Scenery, from_zenith};
use nestrad_tests::solving::{coarse, finish, finish_by, frame, plan, sources, unwatched};

/// A small canopy in two bands, under the sun and the directions of a sky.
fn maize() -> Scene {
    let mut scenery = scenery(&small_maize(), &par_and_nir(), uniform_sky(4, 2));
    scenery.source(from_zenith(40.0, 160.0), 400.0);
    scenery.scene()
}

/// The same canopy in one band with other optics, under a sky and another sun.
fn overcast_maize() -> Scene {
    let [_, (leaf, _)] = par_and_nir();
    let mut scenery = Scenery {
        sky: Some(sky(&Sky::StandardOvercast, 1)),
        ..scenery(&small_maize(), &[(leaf, 0.6)], Vec::new())
    };
    scenery.source(from_zenith(65.0, 20.0), 50.0);
    scenery.scene()
}

/// Lit by one light, by another, and by the first again: always what a solve from nothing gives.
fn every_light_gives_the_bits_of_a_solve_of_its_own(settings: &Settings) -> Plan {
    let (day, overcast) = (maize(), overcast_maize());
    assert!(day.canopy == overcast.canopy);
    let first = plan(&day, settings);
    let second = Plan {
        trace: first.trace.clone(),
        ..plan(&overcast, settings)
    };
    let trace =
        |run: &Run| TracedCanopy::trace(&day.canopy, &first.trace, &ThisProcess::default(), run);
    let traced = unwatched(trace).unwrap();
    for (scene, plan) in [(&day, &first), (&overcast, &second), (&day, &first)] {
        let sources = sources(scene, &plan.aims, plan.light.seed);
        let lit = |run: &Run| traced.lit(&scene.optics, &sources, &plan.light, run);
        let (solution, work) = unwatched(lit).unwrap();
        let alone = finish(scene, plan).unwrap();
        assert!(solution == alone.solution);
        assert_eq!(format!("{work:?}"), format!("{:?}", alone.work));
        assert!(solution.balance[0].absorbed_plants_W.value > 0.0);
    }
    first
}

#[test]
fn a_canopy_that_is_lit_again_gives_the_bits_of_a_solve_from_nothing() {
    every_light_gives_the_bits_of_a_solve_of_its_own(&coarse());
}

#[test]
fn a_canopy_with_a_far_field_that_is_lit_again_gives_the_bits_of_a_solve_from_nothing() {
    let settings = Settings {
        diameter: Diameter::Metres(0.4),
        ..coarse()
    };
    let plan = every_light_gives_the_bits_of_a_solve_of_its_own(&settings);
    assert!(plan.trace.radius_m.is_some() && plan.trace.far_field.is_some());
}

/// Rows that are traced elsewhere, as a test will have it.
struct Elsewhere<F>(F);

impl<F: Fn(&Run) -> Result<JobCounts, ExchangeError> + Sync> RowSource for Elsewhere<F> {
    fn is_elsewhere(&self) -> bool {
        true
    }

    fn cut(&self, frame: &Frame, sampling: &Sampling, _: &Run) -> Result<Work, ExchangeError> {
        Ok(Work::by_batch(frame, sampling))
    }

    fn trace(
        &self,
        _: &Frame,
        _: &Work,
        _: &[usize],
        _: &mut Take<'_>,
        run: &Run,
    ) -> Result<JobCounts, ExchangeError> {
        (self.0)(run)
    }
}

fn out_of_paper() -> ExchangeError {
    ExchangeError::Failed("out of paper".to_owned())
}

/// Goes on until it is told to stop.
fn until_stopped(run: &Run) -> Stopped {
    let begun = Instant::now();
    loop {
        if let Err(stopped) = run.stop.check() {
            return stopped;
        }
        assert!(begun.elapsed() < PATIENCE, "nobody stops it");
        sleep(Duration::from_millis(1));
    }
}

/// Traces with these rows, and does something meanwhile; why it fails. The whole is not stopped.
fn failure(
    rows: &dyn RowSource,
    meanwhile: impl FnOnce(&Run) -> Result<(), SolveError>,
) -> SolveError {
    let scene = maize();
    let plan = plan(&scene, &coarse()).trace;
    let frame = frame(&scene.canopy, &plan);
    unwatched(|run| {
        let watch = &mut Stopwatch::start();
        let meanwhile = |_: &Frame, run: &Run, _: &mut Stopwatch| meanwhile(run);
        let traced = TracedCanopy::of_frame(frame, &plan, (rows, run, watch), meanwhile);
        assert_eq!(run.stop.check(), Ok(()));
        traced.err().unwrap()
    })
}

#[test]
fn rows_that_fail_elsewhere_end_what_is_computed_here_and_say_why() {
    let rows = Elsewhere(|_: &Run| Err(out_of_paper()));
    let error = failure(&rows, |run| Err(until_stopped(run).into()));
    assert!(matches!(error, SolveError::Exchange(_)), "{error:?}");
    assert_eq!(error.to_string(), "out of paper");
}

#[test]
fn what_fails_here_ends_the_rows_elsewhere_and_says_why() {
    let rows = Elsewhere(|run: &Run| Err(until_stopped(run).into()));
    let error = failure(&rows, |_| Err(SolveError::Exchange(out_of_paper())));
    assert!(matches!(error, SolveError::Exchange(_)), "{error:?}");
    assert_eq!(error.to_string(), "out of paper");
}

/// A fault of the rows was heard of only once all sources of a sky were through.
#[test]
fn rows_that_fail_end_direct_light_before_its_last_source() {
    // so many that other tests beside this one do not matter
    let scene = scenery(&small_maize(), &par_and_nir(), uniform_sky(1600, 2)).scene();
    let plan = plan(&scene, &coarse());
    let frame = frame(&scene.canopy, &plan.trace);
    let sources = sources(&scene, &plan.aims, plan.light.seed);
    let areas_m2 = plan.light.line_areas_m2(&frame.world.extent, &sources);
    let begun = Instant::now();
    let projections = (&sources, &areas_m2[..]);
    direct_light(
        &frame,
        &frame.ordered(&scene.optics),
        projections,
        1,
        || Ok(()),
    )
    .unwrap();
    let all = begun.elapsed();
    let begun = Instant::now();
    let rows = Elsewhere(|_: &Run| Err(out_of_paper()));
    let error = finish_by(&scene, &plan, &rows).unwrap_err();
    assert_eq!(error.to_string(), "out of paper");
    assert!(
        begun.elapsed() < all / 2,
        "{:?} of {all:?}",
        begun.elapsed()
    );
}

#[test]
fn a_stop_of_the_whole_ends_both_halves() {
    let scene = scenery(&small_maize(), &par_and_nir(), uniform_sky(400, 2)).scene();
    let whole = Stop::default();
    let rows = Elsewhere(|run: &Run| {
        whole.stop();
        Err(until_stopped(run).into())
    });
    let run = Run {
        stop: &whole,
        progress: &Progress::default(),
    };
    let watch = &mut Stopwatch::start();
    let error = solve_in_rounds(&scene, &coarse(), &rows, &run, watch, |_, _| ()).unwrap_err();
    let stopped = RoundsError::Solve(SolveError::Stopped(Stopped));
    assert_eq!(format!("{error:?}"), format!("{stopped:?}"));
}

/// This process, until an exchange is cut for the second time.
struct OneRound<F> {
    cuts: AtomicUsize,
    then: F,
}

impl<F: Fn(&Run) -> ExchangeError + Sync> RowSource for OneRound<F> {
    fn cut(&self, frame: &Frame, sampling: &Sampling, run: &Run) -> Result<Work, ExchangeError> {
        match self.cuts.fetch_add(1, Ordering::Relaxed) {
            0 => ThisProcess::default().cut(frame, sampling, run),
            _ => Err((self.then)(run)),
        }
    }

    fn trace(
        &self,
        frame: &Frame,
        work: &Work,
        wanted: &[usize],
        take: &mut Take<'_>,
        run: &Run,
    ) -> Result<JobCounts, ExchangeError> {
        ThisProcess::default().trace(frame, work, wanted, take, run)
    }
}

/// Solves in rounds, of which only the first succeeds: in the second, `then` is done with the stop of the whole. Gives
/// the plans, too.
fn in_one_round(
    scene: &Scene,
    then: impl Fn(&Stop) -> ExchangeError + Sync,
) -> (Result<Solved, RoundsError>, Vec<Plan>) {
    // so fine that a coarse look comes first
    let settings = Settings {
        accuracy_percent: 0.1,
        in_rounds: true,
        ..Settings::default()
    };
    let (cuts, stop) = (AtomicUsize::new(0), Stop::default());
    let then = |_: &Run| then(&stop);
    let rows = OneRound { cuts, then };
    let mut plans = Vec::new();
    let watch = &mut Stopwatch::start();
    let run = &Run {
        stop: &stop,
        progress: &Progress::default(),
    };
    let begins = |plan: &Plan, _: &[_]| plans.push(plan.clone());
    let solved = solve_in_rounds(scene, &settings, &rows, run, watch, begins);
    (solved, plans)
}

#[test]
fn a_later_round_that_fails_leaves_the_one_before_and_says_why() {
    let scene = overcast_maize();
    let (solved, plans) = in_one_round(&scene, |_| out_of_paper());
    let solved = solved.unwrap();
    assert_eq!(plans.len(), 2);
    assert_eq!(solved.plan.aims, plans[0].aims);
    assert!(solved.solution == finish(&scene, &plans[0]).unwrap().solution);
    let accuracy = &solved.accuracy;
    assert_eq!(accuracy.ended, Ended::Failed);
    assert_eq!(accuracy.rounds.len(), 1);
    assert_eq!(accuracy.errors, solved.solution.account);
    assert_eq!(accuracy.failure.as_deref(), Some("out of paper"));
    let said = accuracy.to_string();
    assert!(
        said.contains("a finer round failed: out of paper"),
        "{said}"
    );
}

#[test]
fn a_later_round_that_is_stopped_leaves_nothing() {
    let stopped = |stop: &Stop| {
        stop.stop();
        Stopped.into()
    };
    let (solved, plans) = in_one_round(&overcast_maize(), stopped);
    assert_eq!(plans.len(), 2);
    let error = solved.unwrap_err();
    let stopped = matches!(error, RoundsError::Solve(SolveError::Stopped(_)));
    assert!(stopped, "{error:?}");
}

#[test]
fn a_first_round_that_fails_says_why() {
    let rows = Elsewhere(|_: &Run| Err(out_of_paper()));
    let settings = Settings {
        in_rounds: true,
        ..coarse()
    };
    let watch = &mut Stopwatch::start();
    let error = unwatched(|run| {
        solve_in_rounds(&overcast_maize(), &settings, &rows, run, watch, |_, _| ())
    });
    let error = error.unwrap_err();
    let failed = matches!(error, RoundsError::Solve(SolveError::Exchange(_)));
    assert!(failed, "{error:?}");
    assert_eq!(error.to_string(), "out of paper");
}

/// More directions than there is room for: some are projected again, and nothing else changes.
#[test]
fn directions_that_there_is_no_room_for_are_projected_again() {
    let scene = scenery(&small_maize(), &par_and_nir(), uniform_sky(50, 2)).scene();
    let plan = plan(&scene, &coarse());
    let frame = frame(&scene.canopy, &plan.trace);
    let sources = sources(&scene, &plan.aims, plan.light.seed);
    let areas_m2 = plan.light.line_areas_m2(&frame.world.extent, &sources);
    let optics = frame.ordered(&scene.optics);
    let lit = |kept: &KeptDirections| {
        let projections = (&sources, &areas_m2[..]);
        direct_light_keeping(&frame, &optics, projections, 1, kept, || Ok(())).unwrap()
    };
    let all = KeptDirections::within(1 << 30);
    let first = lit(&all);
    let some = KeptDirections::within(all.bytes() / 2);
    for kept in [&all, &some, &some, &KeptDirections::default()] {
        let again = lit(kept);
        assert_eq!(again.irradiance_W_m2, first.irradiance_W_m2);
        assert_eq!(again.organ_variance_W2, first.organ_variance_W2);
    }
    assert!(some.bytes() > 0 && some.bytes() <= all.bytes() / 2);
}

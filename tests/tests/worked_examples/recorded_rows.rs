//! A new source of rows: what another source traces is recorded, and handed out again without tracing.

use std::sync::Mutex;

use nestrad_engine::exchange::{
    ExchangeError, JobCounts, JobRows, RowSource, Sampling, Take, ThisProcess, Work,
};
use nestrad_engine::frame::Frame;
use nestrad_engine::plan::Settings;
use nestrad_engine::run::Run;
use nestrad_tests::solving::{coarse, finish, finish_by, plan};

use super::{maize, within_a_sphere};

/// Rows by the number of their job.
type Tape = Vec<(usize, JobRows)>;

/// Another source, whose rows are recorded.
struct Recorded<'a> {
    source: &'a dyn RowSource,
    tape: Mutex<Tape>,
}

impl RowSource for Recorded<'_> {
    fn is_elsewhere(&self) -> bool {
        self.source.is_elsewhere()
    }

    fn cut(&self, frame: &Frame, sampling: &Sampling, run: &Run) -> Result<Work, ExchangeError> {
        self.source.cut(frame, sampling, run)
    }

    fn trace(
        &self,
        frame: &Frame,
        work: &Work,
        wanted: &[usize],
        take: &mut Take<'_>,
        run: &Run,
    ) -> Result<JobCounts, ExchangeError> {
        // all results pass through here on their way
        let mut record = |job: usize, rows: JobRows| {
            self.tape.lock().unwrap().push((job, rows.clone()));
            take(job, rows)
        };
        self.source.trace(frame, work, wanted, &mut record, run)
    }
}

/// Recorded rows. Nothing is computed here, so that this process may compute something else meanwhile.
struct Replayed {
    tape: Tape,
}

impl RowSource for Replayed {
    fn is_elsewhere(&self) -> bool {
        true
    }

    /// As it was cut for the record.
    fn cut(&self, frame: &Frame, sampling: &Sampling, run: &Run) -> Result<Work, ExchangeError> {
        ThisProcess::default().cut(frame, sampling, run)
    }

    fn trace(
        &self,
        _: &Frame,
        _: &Work,
        wanted: &[usize],
        take: &mut Take<'_>,
        run: &Run,
    ) -> Result<JobCounts, ExchangeError> {
        for &job in wanted {
            run.stop.check()?;
            let recorded = self.tape.iter().find(|(number, _)| *number == job);
            let (_, rows) = recorded
                .ok_or_else(|| ExchangeError::Failed(format!("job {job} was not recorded")))?;
            take(job, rows.clone())?;
        }
        Ok(JobCounts {
            traced: 0,
            kept: wanted.len() as u64,
        })
    }
}

fn recorded_and_replayed_rows_give_the_bits_of_this_process(settings: &Settings) {
    let scene = maize();
    let plan = plan(&scene, settings);
    let here = finish(&scene, &plan).unwrap();
    let recorder = Recorded {
        source: &ThisProcess::default(),
        tape: Mutex::default(),
    };
    let recorded = finish_by(&scene, &plan, &recorder).unwrap();
    assert!(here.solution == recorded.solution);
    let tape = recorder.tape.into_inner().unwrap();
    assert_eq!(tape.len() as u64, here.work.jobs.traced);
    let replayed = finish_by(&scene, &plan, &Replayed { tape }).unwrap();
    assert!(here.solution == replayed.solution);
    assert_eq!(replayed.work.jobs.traced, 0);
    assert_eq!(replayed.work.jobs.kept, here.work.jobs.traced);
}

#[test]
fn recorded_rows_are_handed_out_again_to_the_same_bits() {
    recorded_and_replayed_rows_give_the_bits_of_this_process(&coarse());
}

#[test]
fn recorded_rows_within_a_sphere_are_handed_out_again_to_the_same_bits() {
    recorded_and_replayed_rows_give_the_bits_of_this_process(&within_a_sphere());
}

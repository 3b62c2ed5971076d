//! What a study comes to: the cost and the errors of each setting, and which one to take.

use std::io::Write;

use super::choice::{Missed, Point, choose, pareto};
use super::measure::ErrorRange;
use super::request::Request;
use super::setting::{Setting, targets_percent};
use super::study::{SettingRun, Study};
use crate::csv;
use crate::error::Fault;
use crate::number::round_to_nine_digits;
use crate::table::{Column, Table};

/// Settings side by side.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Error of a run of the reference by its own account, percent, at most.
    pub reference_percent: f64,
    /// Names of the bands in which plants absorb.
    pub bands: Vec<String>,
    /// Per band: standard error of the reference by the scatter of its runs, percent.
    pub reference_error_percent: Vec<f64>,
    /// One for each setting, in their order.
    pub rows: Vec<Row>,
    /// One for each target, from the largest error to the smallest.
    pub choices: Vec<Choice>,
}

/// A setting and what came of it.
#[derive(Clone, Debug)]
pub struct Row {
    /// What was tried.
    pub setting: Setting,
    /// The flags of `nestrad solve` that ask for it, if there are any.
    pub flags: Option<String>,
    /// What was measured, or why nothing was.
    pub outcome: Result<Measured, String>,
}

/// Costs and errors of a setting over its runs.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Runs, one for each seed.
    pub runs: usize,
    /// Median processor time, seconds.
    pub cpu_s: f64,
    /// Median time that passed, seconds.
    pub wall_s: f64,
    /// Most memory of any run, bytes; absent where the system does not tell.
    pub peak_memory_bytes: Option<u64>,
    /// Bytes of the rows of the exchange, of the run that has most.
    pub row_bytes: u64,
    /// Error per band against the reference, percent.
    pub errors: Vec<ErrorRange>,
    /// Error per band by the runs' own account, rms over runs, percent.
    pub stated_percent: Vec<Option<f64>>,
    /// Number of the band whose error may be largest.
    pub worst: usize,
    /// No other setting is as cheap and as good in the worst band.
    pub on_front: bool,
    /// Stages in their order, with their mean processor time, seconds.
    pub stages: Vec<(String, f64)>,
}

/// The setting to take for an error.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Error that is wanted, percent.
    pub target_percent: f64,
    /// Number of the cheapest row that `nestrad solve` has flags for, or why there is none.
    pub chosen: Result<usize, Missed>,
    /// Number of a row that reaches the target for less, or alone, but that no flags ask for.
    pub without_flags: Option<usize>,
}

impl Comparison {
    /// Of a study that was carried out.
    pub fn of(request: &Request<'_>, study: &Study) -> Self {
        let row = |(setting, runs): (&Setting, &Result<Vec<SettingRun>, String>)| Row {
            setting: *setting,
            flags: setting.flags(request.memory_GiB),
            outcome: match runs {
                Err(why) => Err(why.clone()),
                Ok(runs) => measured(study, runs).ok_or_else(|| "it was not run".to_owned()),
            },
        };
        let rows = request.settings.iter().zip(&study.measured).map(row);
        let variances = study.bands.iter().map(|(_, r)| r.variance_percent2);
        let mut comparison = Self {
            reference_percent: study.reference_percent,
            bands: study.bands.iter().map(|(name, _)| name.clone()).collect(),
            reference_error_percent: variances.map(f64::sqrt).collect(),
            rows: rows.collect(),
            choices: Vec::new(),
        };
        let (numbers, points) = comparison.points(|_| true);
        for (number, on_front) in numbers.into_iter().zip(pareto(&points)) {
            if let Ok(measured) = &mut comparison.rows[number].outcome {
                measured.on_front = on_front;
            }
        }
        let targets = targets_percent(request.finest_percent).into_iter();
        comparison.choices = targets.map(|t| comparison.choice(t)).collect();
        comparison
    }

    /// The rows that were measured, with their numbers.
    pub fn measured(&self) -> impl Iterator<Item = (usize, &Row, &Measured)> {
        let rows = self.rows.iter().enumerate();
        rows.filter_map(|(number, row)| Some((number, row, row.outcome.as_ref().ok()?)))
    }

    /// The rows that were not, with the reason.
    pub fn failed(&self) -> impl Iterator<Item = (&Row, &str)> {
        let rows = self.rows.iter();
        rows.filter_map(|row| Some((row, row.outcome.as_ref().err()?.as_str())))
    }

    fn points(&self, wanted: impl Fn(&Row) -> bool) -> (Vec<usize>, Vec<Point>) {
        let point = |m: &Measured| Point {
            cpu_s: m.cpu_s,
            worst: m.errors[m.worst],
        };
        let rows = self.measured().filter(|(_, row, _)| wanted(row));
        rows.map(|(number, _, m)| (number, point(m))).unzip()
    }

    fn choice(&self, target_percent: f64) -> Choice {
        let pick = |wanted: fn(&Row) -> bool| {
            let (numbers, points) = self.points(wanted);
            choose(&points, target_percent).map(|place| numbers[place])
        };
        let best = pick(|_| true).ok();
        Choice {
            target_percent,
            chosen: pick(|row| row.flags.is_some()),
            without_flags: best.filter(|&number| self.rows[number].flags.is_none()),
        }
    }

    /// Targets that a row is chosen for, percent.
    fn chosen_for(&self, number: usize) -> String {
        let choices = self.choices.iter();
        let own = choices.filter(|choice| choice.chosen == Ok(number));
        let targets: Vec<String> = own.map(|c| c.target_percent.to_string()).collect();
        targets.join(" ")
    }

    /// Writes a row for each setting and band, as comma-separated text.
    pub(crate) fn write_csv(&self, out: &mut impl Write) -> Result<(), Fault> {
        let numbers = 0..self.rows.len();
        let cells: Vec<Cells> = numbers
            .flat_map(|number| (0..self.bands.len()).map(move |band| self.cells(number, band)))
            .collect();
        let column = |(place, name): (usize, &&'static str)| {
            let cells = &cells;
            Column::text(name, move |row| cells[row][place].as_str())
        };
        let table = Table {
            name: "trade",
            rows: cells.len(),
            columns: COLUMNS.iter().enumerate().map(column).collect(),
        };
        csv::write(&table, out)
    }

    fn cells(&self, number: usize, band: usize) -> Cells {
        let row = &self.rows[number];
        let measured = row.outcome.as_ref().ok();
        let real = |value: fn(&Measured, usize) -> Option<f64>| {
            let value = measured.and_then(|m| value(m, band));
            value.map_or_else(String::new, |v| format!("{:?}", round_to_nine_digits(v)))
        };
        let whole = |value: fn(&Measured) -> Option<u64>| {
            let value = measured.and_then(value);
            value.map_or_else(String::new, |v| v.to_string())
        };
        let yes = |is: fn(&Measured, usize) -> bool| {
            let is = measured.is_some_and(|m| is(m, band));
            if is { "yes" } else { "no" }.to_owned()
        };
        [
            row.setting.to_string(),
            row.flags.clone().unwrap_or_default(),
            self.bands[band].clone(),
            whole(|m| Some(m.runs as u64)),
            real(|m, _| Some(m.cpu_s)),
            real(|m, _| Some(m.wall_s)),
            whole(|m| m.peak_memory_bytes),
            whole(|m| Some(m.row_bytes)),
            real(|m, band| Some(m.errors[band].percent)),
            real(|m, band| Some(m.errors[band].low_percent)),
            real(|m, band| Some(m.errors[band].high_percent)),
            real(|m, band| m.stated_percent[band]),
            yes(|m, band| m.worst == band),
            yes(|m, _| m.on_front),
            self.chosen_for(number),
            row.outcome.as_ref().err().cloned().unwrap_or_default(),
        ]
    }
}

const COLUMNS: [&str; 16] = [
    "setting",
    "solve_flags",
    "band",
    "runs",
    "cpu_s",
    "wall_s",
    "peak_memory_bytes",
    "row_bytes",
    "error_percent",
    "error_low_percent",
    "error_high_percent",
    "stated_error_percent",
    "worst_band",
    "pareto_front",
    "chosen_for_percent",
    "failed",
];

type Cells = [String; COLUMNS.len()];

fn measured(study: &Study, runs: &[SettingRun]) -> Option<Measured> {
    let errors = study.bands.iter().enumerate().map(|(band, (_, own))| {
        let squares: Vec<f64> = runs.iter().map(|run| run.square_percent2[band]).collect();
        own.range(&squares)
    });
    let errors: Vec<ErrorRange> = errors.collect();
    let high = |&band: &usize| errors[band].high_percent;
    let worst = (0..errors.len()).max_by(|a, b| high(a).total_cmp(&high(b)))?;
    Some(Measured {
        runs: runs.len(),
        cpu_s: median(runs.iter().map(|run| run.cpu_s))?,
        wall_s: median(runs.iter().map(|run| run.wall_s))?,
        peak_memory_bytes: runs.iter().filter_map(|run| run.peak_memory_bytes).max(),
        row_bytes: runs.iter().map(|run| run.row_bytes).max()?,
        stated_percent: (0..errors.len()).map(|band| stated(runs, band)).collect(),
        errors,
        worst,
        on_front: false,
        stages: stages(runs),
    })
}

/// None of no values; of an even number of them, the mean of the middle two.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    let lower = values[(values.len() - 1) / 2];
    Some(0.5 * (lower + upper))
}

fn stated(runs: &[SettingRun], band: usize) -> Option<f64> {
    let own: Option<Vec<f64>> = runs.iter().map(|run| run.stated_percent[band]).collect();
    let squares = own?.iter().map(|percent| percent * percent).sum::<f64>();
    Some((squares / runs.len() as f64).sqrt())
}

/// Stages of all runs by name; what comes twice in a run is added.
fn stages(runs: &[SettingRun]) -> Vec<(String, f64)> {
    let mut means: Vec<(String, f64)> = Vec::new();
    for stage in runs.iter().flat_map(|run| &run.stages) {
        let own_s = stage.cpu_s / runs.len() as f64;
        match means.iter_mut().find(|(name, _)| *name == stage.name) {
            Some((_, cpu_s)) => *cpu_s += own_s,
            None => means.push((stage.name.clone(), own_s)),
        }
    }
    means
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use nestrad_common::options::Diameter;

    fn range(percent: f64) -> ErrorRange {
        ErrorRange {
            percent,
            low_percent: 0.8 * percent,
            high_percent: 1.2 * percent,
        }
    }

    fn row(setting: Setting, cpu_s: f64, percent: f64) -> Row {
        Row {
            setting,
            flags: setting.flags(8.0),
            outcome: Ok(Measured {
                runs: 2,
                cpu_s,
                wall_s: 0.5 * cpu_s,
                peak_memory_bytes: Some(1_000_000),
                row_bytes: 4000,
                errors: vec![range(0.5 * percent), range(percent)],
                stated_percent: vec![None, Some(percent)],
                worst: 1,
                on_front: true,
                stages: vec![("exchange".to_owned(), cpu_s)],
            }),
        }
    }

    /// Two bands whose names are tags; a setting of each kind, and one that failed.
    pub(in crate::trade) fn example() -> Comparison {
        let inf = Setting::asked;
        let mut off = inf(0.5);
        off.times.sets = 0.5;
        let failed = Setting::within(0.5, Diameter::Metres(0.8));
        let mut example = Comparison {
            reference_percent: 0.1,
            bands: vec!["<b>PAR</b>".to_owned(), "N,IR".to_owned()],
            reference_error_percent: vec![0.05, 0.06],
            rows: vec![
                row(inf(2.0), 1.0, 1.5),
                row(inf(0.5), 10.0, 0.4),
                row(off, 7.0, 0.41),
                row(Setting::within(0.5, Diameter::Metres(0.4)), 3.0, 3.0),
                Row {
                    setting: failed,
                    flags: failed.flags(8.0),
                    outcome: Err("seed 1: <out of luck>".to_owned()),
                },
            ],
            choices: Vec::new(),
        };
        example.choices = [2.0, 0.5, 0.2].map(|t| example.choice(t)).to_vec();
        example
    }

    #[test]
    fn what_flags_ask_for_is_chosen_and_what_is_cheaper_is_told() {
        let [coarse, fine, finest] = &example().choices[..] else {
            panic!("three targets");
        };
        assert_eq!((coarse.chosen, coarse.without_flags), (Ok(0), None));
        assert_eq!((fine.chosen, fine.without_flags), (Ok(1), Some(2)));
        assert!(finest.chosen.is_err() && finest.without_flags.is_none());
    }

    #[test]
    fn the_table_has_a_row_for_each_setting_and_band() {
        let mut out = Vec::new();
        example().write_csv(&mut out).expect("written");
        let text = String::from_utf8(out).expect("text");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 1 + 5 * 2);
        assert!(lines[0].starts_with("setting,solve_flags,band,runs,cpu_s,"));
        assert_eq!(
            lines[4],
            "0.5 %,--accuracy 0.5 --diameter inf,\"N,IR\",2,10.0,5.0,1000000,4000,\
             0.4,0.32,0.48,0.4,yes,yes,0.5,"
        );
        assert!(
            lines[10].ends_with(",,,,,,,,,,no,no,,seed 1: <out of luck>"),
            "{}",
            lines[10]
        );
    }

    #[test]
    fn medians_of_odd_and_even_numbers() {
        assert_eq!(median([3.0, 1.0, 2.0].into_iter()), Some(2.0));
        assert_eq!(median([4.0, 1.0, 2.0, 3.0].into_iter()), Some(2.5));
        assert_eq!(median([].into_iter()), None);
    }
}

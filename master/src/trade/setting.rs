//! What a study tries: accuracies as they are planned, and one knob at a time turned off its plan.

use std::fmt;

use nestrad_common::options::Diameter;
use nestrad_common::problem::Problem;
use serde::{Deserialize, Serialize};

use crate::plan::{DEFAULT_ACCURACY_PERCENT, Plan, PlanError, Scale, Settings};

/// A plan for an accuracy and a diameter, and what of it is changed.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Setting {
    /// Accuracy that is planned for, percent.
    pub accuracy_percent: f64,
    /// Diameter of the sphere of near exchange.
    pub diameter: Diameter,
    /// What of the plan is multiplied.
    pub times: Factors,
    /// Bins per hemisphere of the far field, if not as planned.
    pub bins: Option<u32>,
}

/// Factors on what is planned; 1 leaves it as it is.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Factors {
    /// Sets of directions in a batch.
    pub sets: f64,
    /// Distance between lines of the exchange.
    pub line_pitch: f64,
    /// Distance between lines of the direct light.
    pub direct_pitch: f64,
    /// Longest edge of an element.
    pub max_edge: f64,
    /// Tolerance of the solver.
    pub tolerance: f64,
}

impl Default for Factors {
    fn default() -> Self {
        Self {
            sets: 1.0,
            line_pitch: 1.0,
            direct_pitch: 1.0,
            max_edge: 1.0,
            tolerance: 1.0,
        }
    }
}

impl Factors {
    fn named(&self) -> [(&'static str, f64); 5] {
        [
            ("sets", self.sets),
            ("line pitch", self.line_pitch),
            ("direct pitch", self.direct_pitch),
            ("max edge", self.max_edge),
            ("tolerance", self.tolerance),
        ]
    }
}

impl Setting {
    /// As it is planned.
    pub fn planned(accuracy_percent: f64, diameter: Diameter) -> Self {
        Self {
            accuracy_percent,
            diameter,
            times: Factors::default(),
            bins: None,
        }
    }

    /// Whether a user can ask for it: no knob is turned off its plan.
    pub fn is_planned(&self) -> bool {
        self.bins.is_none() && self.times == Factors::default()
    }

    /// The flags of `nestrad solve` that ask for it, if there are any.
    pub fn flags(&self, memory_GiB: f64) -> Option<String> {
        let (accuracy, diameter) = (self.accuracy_percent, self.diameter);
        let mut flags = format!("--accuracy {accuracy} --diameter {diameter}");
        if memory_GiB != Settings::default().memory_GiB {
            flags += &format!(" --memory {memory_GiB}");
        }
        self.is_planned().then_some(flags)
    }

    /// Its plan, if that takes no more than so much memory.
    pub fn plan(&self, problem: &Problem, memory_GiB: f64, seed: u64) -> Result<Plan, PlanError> {
        let settings = Settings {
            diameter: self.diameter,
            accuracy_percent: self.accuracy_percent,
            memory_GiB: f64::INFINITY,
            seed,
            ..Settings::default()
        };
        let mut plan = Plan::new(problem, &settings)?;
        let times = &self.times;
        plan.max_edge_m *= times.max_edge;
        plan.direct_line_area_m2 *= times.direct_pitch.powi(2);
        plan.tolerance.absorbed *= times.tolerance;
        if let Some(sampling) = &mut plan.sampling {
            let sets = f64::from(sampling.sets_per_batch) * times.sets;
            sampling.sets_per_batch = sets.round().max(1.0) as u32;
            sampling.line_area_m2 *= times.line_pitch.powi(2);
        }
        if let (Some(far), Some(bins)) = (&mut plan.far_field, self.bins) {
            far.bins = bins;
        }
        plan.within(problem, memory_GiB)
    }
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} %", self.accuracy_percent)?;
        if let Diameter::Metres(metres) = self.diameter {
            write!(f, ", D {metres} m")?;
        }
        if let Some(bins) = self.bins {
            write!(f, ", {bins} bins")?;
        }
        self.times
            .named()
            .iter()
            .filter(|(_, factor)| *factor != 1.0)
            .try_for_each(|(name, factor)| write!(f, ", {name} x {factor}"))
    }
}

/// Accuracies that are tried, percent.
const LADDER_PERCENT: [f64; 14] = [
    5.0, 2.0, 1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.125, 0.09, 0.0625, 0.045, 0.03, 0.02,
];

/// Errors that a setting is chosen for, percent.
const TARGETS_PERCENT: [f64; 5] = [5.0, 2.0, 1.0, 0.5, 0.2];

/// Accuracies finer than this part of the finest target are not tried: a plan may miss by as much.
const FINER_THAN_FINEST: f64 = 0.8;

/// Most diameters that are tried, besides infinity.
const MOST_DIAMETERS: usize = 6;

/// Errors to choose a setting for, down to the finest.
pub fn targets_percent(finest_percent: f64) -> Vec<f64> {
    let mut targets: Vec<f64> = TARGETS_PERCENT
        .into_iter()
        .filter(|&t| t > finest_percent)
        .collect();
    targets.push(finest_percent);
    targets
}

/// What to try on a problem. Settings that come to the same plan are tried once.
pub fn grid(problem: &Problem, finest_percent: f64) -> Vec<Setting> {
    let base = DEFAULT_ACCURACY_PERCENT.max(finest_percent);
    let mut settings: Vec<Setting> = LADDER_PERCENT
        .into_iter()
        .filter(|&a| a >= FINER_THAN_FINEST * finest_percent)
        .map(|a| Setting::planned(a, Diameter::Infinite))
        .collect();
    let planned = Setting::planned(base, Diameter::Infinite);
    let turned = |turn: fn(&mut Factors, f64), by: [f64; 2]| {
        by.map(|factor| {
            let mut setting = planned;
            turn(&mut setting.times, factor);
            setting
        })
    };
    settings.push(planned);
    settings.extend(turned(|t, by| t.direct_pitch = by, [0.5, 2.0]));
    settings.extend(turned(|t, by| t.line_pitch = by, [0.5, 2.0]));
    settings.extend(turned(|t, by| t.max_edge = by, [0.5, 2.0]));
    settings.extend(turned(|t, by| t.sets = by, [0.5, 2.0]));
    settings.extend(turned(|t, by| t.tolerance = by, [0.01, 100.0]));
    let diameters = diameters_m(problem);
    let within = |d: f64| Setting::planned(base, Diameter::Metres(d));
    settings.extend(diameters.iter().map(|&d| within(d)));
    if let Some(&middle) = diameters.get(diameters.len() / 2) {
        settings.extend([1, 3, 6, 12].map(|bins| Setting {
            bins: Some(bins),
            ..within(middle)
        }));
    }
    distinct(problem, settings)
}

/// Diameters from half an organ's side to twice the height of the scene, metres, each twice the last one.
fn diameters_m(problem: &Problem) -> Vec<f64> {
    if problem.scene.pattern.is_none() {
        return Vec::new();
    }
    let scale = Scale::of(problem);
    let least = (0.5 * scale.organ_area_m2.sqrt()).max(scale.height_m / 32.0);
    (-8..=12)
        .map(|k| 0.1 * 2f64.powi(k))
        .filter(|&d| d >= least && d <= 2.0 * scale.height_m)
        .take(MOST_DIAMETERS)
        .collect()
}

/// The settings without those whose plan an earlier one has. What cannot be planned is kept, to be shown.
fn distinct(problem: &Problem, settings: Vec<Setting>) -> Vec<Setting> {
    let mut plans = Vec::new();
    settings
        .into_iter()
        .filter(|setting| {
            let plan = setting.plan(problem, f64::INFINITY, 1);
            let text = plan.ok().and_then(|p| serde_json::to_string(&p).ok());
            let new = text.is_none() || !plans.contains(&text);
            plans.push(text);
            new
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_end_with_the_finest() {
        assert_eq!(targets_percent(0.2), [5.0, 2.0, 1.0, 0.5, 0.2]);
        assert_eq!(targets_percent(0.7), [5.0, 2.0, 1.0, 0.7]);
        assert_eq!(targets_percent(9.0), [9.0]);
    }

    #[test]
    fn a_name_says_what_is_changed() {
        let mut setting = Setting::planned(0.5, Diameter::Metres(0.4));
        assert_eq!(setting.to_string(), "0.5 %, D 0.4 m");
        let flags = setting.flags(8.0);
        assert_eq!(flags.as_deref(), Some("--accuracy 0.5 --diameter 0.4"));
        let flags = setting.flags(20.5).expect("as planned");
        assert!(flags.ends_with(" --memory 20.5"), "{flags}");
        setting.bins = Some(3);
        setting.times.direct_pitch = 2.0;
        assert_eq!(setting.flags(8.0), None);
        assert_eq!(
            setting.to_string(),
            "0.5 %, D 0.4 m, 3 bins, direct pitch x 2"
        );
    }
}

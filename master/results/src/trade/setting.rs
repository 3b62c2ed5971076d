//! What a study tries: accuracies as they are solved for, and one knob at a time turned off the plan that one of
//! them comes to.

use std::fmt;

use nestrad_common::canopy::Canopy;
use nestrad_common::options::Diameter;
use nestrad_engine::lit_canopy::LitCanopy;
use nestrad_engine::plan::{Aims, DEFAULT_ACCURACY_PERCENT, Plan, PlanError, Scale, Settings};
use serde::{Deserialize, Serialize};

/// An accuracy, and what is changed of the plan that it comes to.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Setting {
    /// Accuracy that is asked for, percent.
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
    /// As it is solved for.
    pub fn asked(accuracy_percent: f64) -> Self {
        Self::within(accuracy_percent, Diameter::Infinite)
    }

    /// The same plan within a sphere.
    pub fn within(accuracy_percent: f64, diameter: Diameter) -> Self {
        Self {
            accuracy_percent,
            diameter,
            times: Factors::default(),
            bins: None,
        }
    }

    /// Whether a user can ask for it: no knob is turned off its plan.
    pub fn is_asked(&self) -> bool {
        *self == Self::asked(self.accuracy_percent)
    }

    /// Whether nothing but the diameter differs from what a user asks for.
    pub fn is_within(&self) -> bool {
        *self == Self::within(self.accuracy_percent, self.diameter)
    }

    /// The flags of `nestrad solve` that ask for it, if there are any.
    pub fn flags(&self, memory_GiB: f64) -> Option<String> {
        let (accuracy, diameter) = (self.accuracy_percent, self.diameter);
        let mut flags = format!("--accuracy {accuracy} --diameter {diameter}");
        if memory_GiB != Settings::default().memory_GiB {
            flags += &format!(" --memory {memory_GiB}");
        }
        self.is_asked().then_some(flags)
    }

    /// What a user asks for.
    pub fn settings(&self, memory_GiB: f64, seed: u64) -> Settings {
        Settings {
            diameter: self.diameter,
            accuracy_percent: self.accuracy_percent,
            in_rounds: true,
            memory_GiB,
            seed,
            ..Settings::default()
        }
    }

    /// A plan for these aims with its knobs turned, if it takes no more than so much memory.
    pub fn turned(
        &self,
        lit: &LitCanopy,
        aims: &Aims,
        memory_GiB: f64,
        seed: u64,
    ) -> Result<Plan, PlanError> {
        let mut plan = Plan::aimed(lit, &self.settings(f64::INFINITY, seed), aims)?;
        let (times, trace, light) = (&self.times, &mut plan.trace, &mut plan.light);
        trace.max_edge_m *= times.max_edge;
        light.direct_line_area_m2 *= times.direct_pitch.powi(2);
        light.tolerance.absorbed *= times.tolerance;
        if let Some(sampling) = &mut trace.sampling {
            let sets = f64::from(sampling.sets_per_batch) * times.sets;
            sampling.sets_per_batch = sets.round().max(1.0) as u32;
            sampling.line_area_m2 *= times.line_pitch.powi(2);
        }
        if let (Some(far), Some(bins)) = (&mut trace.far_field, self.bins) {
            far.bins = bins;
        }
        plan.within(lit, memory_GiB)
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

/// What to try on a canopy. What knobs are turned from comes before them.
pub fn grid(canopy: &Canopy, finest_percent: f64) -> Vec<Setting> {
    let base = DEFAULT_ACCURACY_PERCENT.max(finest_percent);
    let mut settings: Vec<Setting> = LADDER_PERCENT
        .into_iter()
        .filter(|&a| a >= FINER_THAN_FINEST * finest_percent)
        .map(Setting::asked)
        .collect();
    let planned = Setting::asked(base);
    let turned = |turn: fn(&mut Factors, f64), by: [f64; 2]| {
        by.map(|factor| {
            let mut setting = planned;
            turn(&mut setting.times, factor);
            setting
        })
    };
    if !settings.contains(&planned) {
        settings.push(planned);
    }
    settings.extend(turned(|t, by| t.direct_pitch = by, [0.5, 2.0]));
    settings.extend(turned(|t, by| t.line_pitch = by, [0.5, 2.0]));
    settings.extend(turned(|t, by| t.max_edge = by, [0.5, 2.0]));
    settings.extend(turned(|t, by| t.sets = by, [0.5, 2.0]));
    settings.extend(turned(|t, by| t.tolerance = by, [0.01, 100.0]));
    let diameters = diameters_m(canopy);
    let within = |d: f64| Setting::within(base, Diameter::Metres(d));
    settings.extend(diameters.iter().map(|&d| within(d)));
    if let Some(&middle) = diameters.get(diameters.len() / 2) {
        settings.extend([1, 3, 6, 12].map(|bins| Setting {
            bins: Some(bins),
            ..within(middle)
        }));
    }
    settings
}

/// Diameters from half an organ's side to twice the height of the scene, metres, each twice the last one.
fn diameters_m(canopy: &Canopy) -> Vec<f64> {
    if canopy.pattern.is_none() {
        return Vec::new();
    }
    let scale = Scale::of(canopy);
    let least = (0.5 * scale.organ_area_m2.sqrt()).max(scale.height_m / 32.0);
    (-8..=12)
        .map(|k| 0.1 * 2f64.powi(k))
        .filter(|&d| d >= least && d <= 2.0 * scale.height_m)
        .take(MOST_DIAMETERS)
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
        let flags = Setting::asked(0.5).flags(8.0);
        assert_eq!(flags.as_deref(), Some("--accuracy 0.5 --diameter inf"));
        let flags = Setting::asked(0.5).flags(20.5).expect("as asked");
        assert!(flags.ends_with(" --memory 20.5"), "{flags}");
        let mut setting = Setting::within(0.5, Diameter::Metres(0.4));
        assert_eq!(setting.to_string(), "0.5 %, D 0.4 m");
        setting.bins = Some(3);
        setting.times.direct_pitch = 2.0;
        assert_eq!(setting.flags(8.0), None);
        assert_eq!(
            setting.to_string(),
            "0.5 %, D 0.4 m, 3 bins, direct pitch x 2"
        );
    }
}

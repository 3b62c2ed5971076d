//! How to solve, as options say it: the same for a solve and for its check.

use nestrad_common::options::Options;
use nestrad_engine::plan::{Estimator, Settings};

/// The settings of a solve.
pub(super) fn settings(options: &Options, budget_s: Option<f64>, estimator: Estimator) -> Settings {
    let default = Settings::default();
    Settings {
        diameter: options.diameter.unwrap_or(default.diameter),
        accuracy_percent: options.accuracy_percent.unwrap_or(default.accuracy_percent),
        in_rounds: options.accuracy_percent.or(budget_s).is_some(),
        budget_s,
        memory_GiB: options.memory_GiB.unwrap_or(default.memory_GiB),
        seed: options.seed.unwrap_or(default.seed),
        estimator,
        scatter: options.scatter.unwrap_or(default.scatter),
    }
}

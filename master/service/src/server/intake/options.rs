//! How a client wants its solve.

use nestrad_common::options::{self, DIAMETERS, Diameter, Scatter};
use nestrad_proto::v1;

use super::ServiceError;
use nestrad_engine::plan::{Estimator, Settings};

/// The settings of a solve, which may take so much memory at most.
pub(in crate::server) fn settings(
    given: &v1::SolveOptions,
    most_GiB: f64,
) -> Result<Settings, ServiceError> {
    let default = Settings::default();
    let above_zero = |name: &'static str, value: f64| {
        options::above_zero(name, value).map_err(|fault| {
            let place = format_args!("options.{name}");
            ServiceError::invalid(place, fault.expected, fault.found)
        })
    };
    let diameter = match given.diameter_m {
        None => Diameter::Auto,
        Some(metres) => Diameter::metres(metres)
            .ok_or_else(|| ServiceError::invalid("options.diameter_m", DIAMETERS, metres))?,
    };
    let memory_GiB = given.memory_gi_b;
    let memory_GiB = memory_GiB.unwrap_or(default.memory_GiB.min(most_GiB));
    let memory_GiB = above_zero("memory_GiB", memory_GiB)?;
    if memory_GiB > most_GiB {
        let wanted = format_args!("at most {most_GiB}, the limit of this master");
        return Err(ServiceError::invalid(
            "options.memory_GiB",
            wanted,
            memory_GiB,
        ));
    }
    let estimator = match v1::Estimator::try_from(given.estimator) {
        Ok(v1::Estimator::Lines) => Estimator::Lines,
        Ok(v1::Estimator::Rays) => Estimator::Rays,
        Err(_) => {
            return Err(ServiceError::invalid(
                "options.estimator",
                "lines or rays",
                given.estimator,
            ));
        }
    };
    let scatter = match v1::Scatter::try_from(given.scatter) {
        Ok(v1::Scatter::All) => Scatter::All,
        Ok(v1::Scatter::None) => Scatter::None,
        Err(_) => {
            return Err(ServiceError::invalid(
                "options.scatter",
                "all or none",
                given.scatter,
            ));
        }
    };
    let accuracy = given.accuracy_percent;
    Ok(Settings {
        diameter,
        accuracy_percent: above_zero(
            "accuracy_percent",
            accuracy.unwrap_or(default.accuracy_percent),
        )?,
        in_rounds: accuracy.or(given.budget_s).is_some(),
        budget_s: given
            .budget_s
            .map(|budget_s| above_zero("budget_s", budget_s))
            .transpose()?,
        memory_GiB,
        seed: given.seed.unwrap_or(default.seed),
        estimator,
        scatter,
    })
}

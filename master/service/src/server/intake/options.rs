//! How a client wants its solve.

use nestrad_common::options::Diameter;
use nestrad_proto::v1;

use super::ServiceError;
use nestrad_engine::plan::{Estimator, Settings};

/// The settings of a solve, which may take so much memory at most.
pub(in crate::server) fn settings(
    given: &v1::SolveOptions,
    most_GiB: f64,
) -> Result<Settings, ServiceError> {
    let default = Settings::default();
    let above_zero = |name: &str, value: Option<f64>, default: f64| match value {
        None => Ok(default),
        Some(value) if value.is_finite() && value > 0.0 => Ok(value),
        Some(value) => Err(ServiceError::invalid(
            format_args!("options.{name}"),
            "a number above 0",
            value,
        )),
    };
    let diameter = match given.diameter_m {
        None => Diameter::Auto,
        Some(f64::INFINITY) => Diameter::Infinite,
        Some(metres) => Diameter::Metres(above_zero("diameter_m", Some(metres), metres)?),
    };
    let memory_GiB = above_zero(
        "memory_GiB",
        given.memory_gi_b,
        default.memory_GiB.min(most_GiB),
    )?;
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
    let accuracy = given.accuracy_percent;
    Ok(Settings {
        diameter,
        accuracy_percent: above_zero("accuracy_percent", accuracy, default.accuracy_percent)?,
        in_rounds: accuracy.or(given.budget_s).is_some(),
        budget_s: match given.budget_s {
            Some(_) => Some(above_zero("budget_s", given.budget_s, 0.0)?),
            None => None,
        },
        memory_GiB,
        seed: given.seed.unwrap_or(default.seed),
        estimator,
    })
}

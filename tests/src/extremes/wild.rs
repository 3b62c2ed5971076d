//! Wild scenes: solved soundly or refused, whatever they are.

use nestrad_master::plan::{Plan, Settings};
use nestrad_master::run::RunError;

use super::judge::{refusal, solving, sound};
use super::{Case, Seen};
use crate::random::wild;
use crate::solving::finish;

/// What happens where the program itself finds that light is missing: a refusal, but one that a seed must not
/// hide behind.
pub const UNBALANCED: &str = "refused as out of balance";

/// A scene by its seed. It need not balance better than so few lines can tell.
pub fn case(seed: u64) -> Case {
    case_within(seed, 0.25)
}

/// The same with another limit of memory.
pub fn case_within(seed: u64, memory_GiB: f64) -> Case {
    Case::new(
        "Wild",
        seed.to_string(),
        "solved soundly, or refused",
        move || {
            let message = |figure| {
                Ok(Seen {
                    happens: "refused",
                    figure,
                })
            };
            let problem = match wild(seed) {
                Ok(problem) => problem,
                Err(fault) => return message(fault),
            };
            let settings = Settings {
                accuracy_percent: 10.0,
                memory_GiB,
                ..Settings::default()
            };
            let plan = match Plan::new(&problem, &settings) {
                Ok(plan) => plan,
                Err(fault) => return message(refusal(fault)),
            };
            match finish(&problem, &plan) {
                Ok(finished) => {
                    sound(&finished.solution, 0.05)?;
                    Ok(solving(format!(
                        "{} organs",
                        finished.solution.organs.len()
                    )))
                }
                Err(fault @ RunError::Unbalanced { .. }) => Ok(Seen {
                    happens: UNBALANCED,
                    figure: fault.to_string(),
                }),
                Err(fault) => message(refusal(fault)),
            }
        },
    )
}

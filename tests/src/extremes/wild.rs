//! Wild scenes: solved soundly or refused, whatever they are.

use nestrad_master::plan::{Plan, Settings};

use super::judge::{refusal, solving, sound};
use super::{Case, Seen};
use crate::random::wild;
use crate::solving::finish;

/// A scene by its seed. It need not balance better than so few lines can tell.
pub fn case(seed: u64) -> Case {
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
                memory_GiB: 0.25,
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
                Err(fault) => message(refusal(fault)),
            }
        },
    )
}

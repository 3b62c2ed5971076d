//! Wild scenes: solved soundly or refused, whatever they are.

use nestrad_engine::plan::Settings;
use nestrad_engine::traced::SolveError;

use super::judge::{refusal, solving, sound};
use super::{Case, Seen};
use crate::random::wild;
use crate::solving::{finish, try_plan};

/// What happens where the program itself finds that light is missing: a refusal, but one that a seed must not
/// hide behind.
pub const UNBALANCED: &str = "refused as out of balance";

/// A scene by its seed. It need not balance better than so few lines can tell.
pub fn case(seed: u64) -> Case {
    case_of((seed, false), 0.25, 1)
}

/// The same with faces that stand twice, or lie in the plane of another one.
pub fn doubled(seed: u64) -> Case {
    case_of((seed, true), 0.25, 1)
}

/// The same with another limit of memory.
pub fn case_within(seed: u64, memory_GiB: f64) -> Case {
    case_of((seed, false), memory_GiB, 1)
}

/// The same with another seed of the sampling.
pub fn case_sampled(seed: u64, sampling: u64) -> Case {
    case_of((seed, false), 0.25, sampling)
}

fn case_of((seed, doubled): (u64, bool), memory_GiB: f64, sampling: u64) -> Case {
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
            let scene = match wild(seed, doubled) {
                Ok(scene) => scene,
                Err(fault) => return message(fault),
            };
            let settings = Settings {
                accuracy_percent: 10.0,
                memory_GiB,
                seed: sampling,
                ..Settings::default()
            };
            let plan = match try_plan(&scene, &settings) {
                Ok(plan) => plan,
                Err(fault) => return message(refusal(fault)),
            };
            match finish(&scene, &plan) {
                Ok(solved) => {
                    sound(&solved.solution, 0.05)?;
                    let organs = solved.solution.organs.len();
                    Ok(solving(format!("{organs} organs")))
                }
                Err(fault @ SolveError::Unbalanced { .. }) => Ok(Seen {
                    happens: UNBALANCED,
                    figure: fault.to_string(),
                }),
                Err(fault) => message(refusal(fault)),
            }
        },
    )
}

//! `summary.json`: what was computed, how, at what cost, and how far it can be trusted.

use std::io::Write;

use nestrad_engine::solution::Balance;
use nestrad_engine::stopwatch::{Stage, Usage};
use serde::Serialize;

use crate::error::Fault;
use crate::{finite, json};

/// All sections of the summary. What is behind `dyn` is written as whoever computed it describes it.
///
/// ```
/// # use nestrad_results::summary::Summary;
/// #[derive(serde::Serialize)]
/// struct Counters {
///     lines: u64,
/// }
///
/// let summary = Summary {
///     version: "0.1.0",
///     options: &(),
///     scene: &(),
///     plan: &["near field: full, because the diameter is infinite"],
///     energy_balance: &[],
///     error_estimates: &(),
///     counters: &Counters { lines: 1_000 },
///     stages: &[],
///     resources: Default::default(),
/// };
/// let mut json = Vec::new();
/// summary.write(&mut json).expect("all numbers are finite");
/// ```
#[derive(Serialize)]
pub struct Summary<'a> {
    /// Version of nestrad.
    pub version: &'a str,
    /// The options in force, defaults included.
    pub options: &'a dyn erased_serde::Serialize,
    /// Facts of the scene: counts, areas, extent.
    pub scene: &'a dyn erased_serde::Serialize,
    /// What was decided, and why.
    pub plan: &'a dyn erased_serde::Serialize,
    /// Where the energy of each band went, W.
    pub energy_balance: &'a [Balance],
    /// How large the errors are thought to be.
    pub error_estimates: &'a dyn erased_serde::Serialize,
    /// How much was done: lines, rows, sweeps.
    pub counters: &'a dyn erased_serde::Serialize,
    /// The cost of each stage.
    pub stages: &'a [Stage],
    /// The cost of the whole.
    pub resources: Usage,
}

impl Summary<'_> {
    /// Writes the summary as indented JSON. A number that is not finite is an error that says where
    /// it stands.
    pub fn write(&self, out: &mut impl Write) -> Result<(), Fault> {
        finite::check(self)?;
        json::write_indented(self, out)?;
        out.write_all(b"\n")?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nestrad_engine::solution::Estimate;

    #[derive(Serialize)]
    struct Facts {
        triangles: u64,
        area_m2: f64,
        origin_m: [f64; 3],
    }

    fn balance(closure_W: f64) -> Balance {
        let estimate = |value| Estimate { value, se: 0.25 };
        Balance {
            band: "PAR".into(),
            incoming_W: 400.0,
            absorbed_plants_W: estimate(350.0),
            closure_W: estimate(closure_W),
            ..Balance::default()
        }
    }

    fn written(balance: &[Balance]) -> Result<String, Fault> {
        let stage = Stage {
            name: "solve".into(),
            wall_s: 0.5,
            cpu_s: 1.0,
        };
        let summary = Summary {
            version: "0.1.0",
            options: &serde_json::json!({ "seed": 1 }),
            scene: &Facts {
                triangles: 2,
                area_m2: 0.1,
                origin_m: [0.0, 1.5, -2.0],
            },
            plan: &["far field: none"],
            energy_balance: balance,
            error_estimates: &(),
            counters: &(),
            stages: &[stage],
            resources: Usage {
                wall_s: 0.5,
                cpu_s: 1.0,
                peak_memory_bytes: Some(4096),
            },
        };
        let mut out = Vec::new();
        summary.write(&mut out)?;
        Ok(String::from_utf8_lossy(&out).into_owned())
    }

    #[test]
    fn sections_stand_in_the_order_in_which_they_are_declared() {
        let expected = r#"{
  "version": "0.1.0",
  "options": {
    "seed": 1
  },
  "scene": {
    "triangles": 2,
    "area_m2": 0.1,
    "origin_m": [
      0.0,
      1.5,
      -2.0
    ]
  },
  "plan": [
    "far field: none"
  ],
  "energy_balance": [],
  "error_estimates": null,
  "counters": null,
  "stages": [
    {
      "name": "solve",
      "wall_s": 0.5,
      "cpu_s": 1.0
    }
  ],
  "resources": {
    "wall_s": 0.5,
    "cpu_s": 1.0,
    "peak_memory_bytes": 4096
  }
}
"#;
        assert_eq!(written(&[]).expect("finite"), expected);
    }

    #[test]
    fn a_number_that_is_not_finite_is_refused_with_its_place() {
        assert!(written(&[balance(0.0)]).is_ok());
        let error = written(&[balance(0.0), balance(f64::NAN)]).expect_err("refused");
        assert_eq!(
            error.to_string(),
            "energy_balance[1].closure_W.value is NaN, not a finite number"
        );
    }
}

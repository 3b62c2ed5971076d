//! Slices of results to a solution. A master is not trusted more than a file: what does not fit the
//! scene is an error.

use glam::DVec2;
use nestrad_common::canopy::Canopy;
use nestrad_common::scene::Scene;
use nestrad_engine::exchange::JobCounts;
use nestrad_engine::rounds::Accuracy;
use nestrad_engine::solution::{
    Balance, Estimate, ItemLight, MaterialLight, Reading, SensorLight, SoilMap, Solution,
};
use nestrad_engine::stopwatch::{Stage, Usage};
use nestrad_engine::traced::WorkDone;
use nestrad_kernel::rows::Counts;
use nestrad_proto::v1;
use v1::result_slice::Part;

use serde::Deserialize;

use super::error::RemoteError;
use super::solved::SolvedThere;

/// Cells of a soil map, at most: a plan never has more than about a million.
const MAX_SOIL_CELLS: u64 = 1 << 24;

/// A solution that is arriving.
#[derive(Debug)]
pub(super) struct Arriving<'a> {
    scene: &'a Scene,
    solution: Solution,
    summary: Option<v1::SolveSummary>,
}

impl<'a> Arriving<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        Self {
            scene,
            solution: Solution::default(),
            summary: None,
        }
    }

    /// Takes in the next slice.
    pub(super) fn take(&mut self, slice: v1::ResultSlice) -> Result<(), RemoteError> {
        match slice.part {
            Some(Part::Organs(slice)) => {
                let solution = &mut self.solution;
                if slice.absorbed_bias_w.len() != slice.area_m2.len() * self.scene.optics.len() {
                    return Err(RemoteError::Answer("organs that do not fit the scene"));
                }
                solution.organ_bias_W.extend(slice.absorbed_bias_w);
                let sunlit = &mut solution.organ_sunlit_m2;
                let (values, errors) = (slice.sunlit_area_m2, slice.sunlit_area_se_m2);
                // empty without a sun
                let none = values.is_empty() && sunlit.is_empty();
                let known = sunlit.len() == solution.organ_area_m2.len();
                let fits = known && values.len() == slice.area_m2.len();
                if values.len() != errors.len() || !(none || fits) {
                    return Err(RemoteError::Answer("organs that do not fit the scene"));
                }
                let both = values.into_iter().zip(errors);
                sunlit.extend(both.map(|(value, se)| Estimate { value, se }));
                append(
                    "organs",
                    (slice.first, self.scene.canopy.organs.len()),
                    self.scene.optics.len(),
                    (&mut solution.organ_area_m2, slice.area_m2),
                    (&mut solution.organs, slice.light),
                )
            }
            Some(Part::Triangles(slice)) => {
                let solution = &mut self.solution;
                append(
                    "triangles",
                    (slice.first, self.scene.canopy.len()),
                    self.scene.optics.len(),
                    (&mut solution.triangle_area_m2, slice.area_m2),
                    (&mut solution.triangles, slice.light),
                )
            }
            Some(Part::Soil(slice)) => self.soil(slice),
            Some(Part::Sensors(slice)) => self.readings(slice),
            Some(Part::Summary(summary)) => {
                let canopy = &self.scene.canopy;
                let bands = summary.bands.iter().map(|band| balance(band, canopy));
                self.solution.balance = bands.collect::<Result<_, _>>()?;
                self.summary = Some(summary);
                Ok(())
            }
            None => Err(RemoteError::Answer("a slice without content")),
        }
    }

    fn soil(&mut self, slice: v1::SoilLight) -> Result<(), RemoteError> {
        let cells = u64::from(slice.cells_x) * u64::from(slice.cells_y);
        if cells > MAX_SOIL_CELLS {
            return Err(RemoteError::Answer("a soil map without bounds"));
        }
        let bands = self.scene.optics.len();
        let map = self.solution.soil.get_or_insert_with(|| SoilMap {
            min_m: DVec2::new(slice.min_x_m, slice.min_y_m),
            cell_m: DVec2::new(slice.cell_x_m, slice.cell_y_m),
            nx: slice.cells_x as usize,
            ny: slice.cells_y as usize,
            irradiance_W_m2: Vec::new(),
        });
        let known = map.irradiance_W_m2.len();
        let count = slice.irradiance_w_m2.len();
        let fits = (map.nx, map.ny) == (slice.cells_x as usize, slice.cells_y as usize)
            && slice.first.checked_mul(bands as u64) == Some(known as u64)
            && slice.irradiance_se_w_m2.len() == count
            && known + count <= map.nx * map.ny * bands;
        if !fits {
            return Err(RemoteError::Answer("soil cells that do not fit the map"));
        }
        let both = slice.irradiance_w_m2.into_iter();
        let both = both.zip(slice.irradiance_se_w_m2);
        map.irradiance_W_m2
            .extend(both.map(|(value, se)| Estimate { value, se }));
        Ok(())
    }

    fn readings(&mut self, slice: v1::SensorReadings) -> Result<(), RemoteError> {
        let bands = self.scene.optics.len();
        let readings = &mut self.solution.readings;
        let columns = [
            &slice.direct_w_m2,
            &slice.direct_se_w_m2,
            &slice.scattered_w_m2,
            &slice.scattered_se_w_m2,
            &slice.bias_w_m2,
        ];
        let count = columns[0].len();
        let rest = &self.scene.sensors[readings.len().min(self.scene.sensors.len())..];
        let fits = slice.first == readings.len() as u64
            && count.is_multiple_of(bands.max(1))
            && count / bands.max(1) <= rest.len()
            && columns.iter().all(|column| column.len() == count);
        if !fits {
            return Err(RemoteError::Answer("sensors that do not fit the scene"));
        }
        let light = |k: usize| {
            let [direct, direct_se, scattered, scattered_se, bias] =
                columns.map(|column| column[k]);
            SensorLight {
                direct: Estimate {
                    value: direct,
                    se: direct_se,
                },
                scattered: Estimate {
                    value: scattered,
                    se: scattered_se,
                },
                bias,
            }
        };
        let read = (0..count / bands.max(1)).zip(rest);
        readings.extend(read.map(|(number, sensor)| Reading {
            sensor: sensor.clone(),
            light: (number * bands..(number + 1) * bands).map(light).collect(),
        }));
        Ok(())
    }

    /// All of it.
    pub(super) fn finish(mut self) -> Result<SolvedThere, RemoteError> {
        let (canopy, solution) = (&self.scene.canopy, &mut self.solution);
        let bands = self.scene.optics.len();
        let soil = solution.soil.as_ref();
        let complete = solution.organs.len() == canopy.organs.len() * bands
            && solution.triangles.len() == canopy.len() * bands
            && solution.balance.len() == bands
            && solution.readings.len() == self.scene.sensors.len()
            && soil.is_none_or(|map| map.irradiance_W_m2.len() == map.nx * map.ny * bands);
        let Some(summary) = self.summary.filter(|_| complete) else {
            return Err(RemoteError::Answer("results that are not complete"));
        };
        let plan: serde_json::Value = serde_json::from_str(&summary.plan_json)
            .map_err(|_| RemoteError::Answer("a plan that cannot be read"))?;
        // a master of an earlier version says nothing of it
        if let Ok(accuracy) = Accuracy::deserialize(&plan["accuracy"]) {
            solution.account = accuracy.errors;
        }
        Ok(SolvedThere {
            solution: self.solution,
            plan,
            work: work(&summary),
            stages: summary.stages.into_iter().map(stage).collect(),
            usage: Usage {
                wall_s: summary.wall_s,
                cpu_s: summary.cpu_s,
                peak_memory_bytes: Some(summary.peak_memory_bytes).filter(|&bytes| bytes > 0),
            },
        })
    }
}

fn work(summary: &v1::SolveSummary) -> WorkDone {
    WorkDone {
        sources: summary.sources as usize,
        elements: summary.elements as usize,
        direct_lines: summary.direct_lines,
        exchange: Counts {
            lines: summary.lines,
            segments: summary.segments,
            rays: summary.rays,
            row_entries: summary.row_entries,
        },
        jobs: JobCounts {
            traced: summary.jobs_traced,
            kept: summary.jobs_kept,
        },
        passes: summary.passes,
    }
}

fn stage(stage: v1::StageCost) -> Stage {
    Stage {
        name: stage.name,
        wall_s: stage.wall_s,
        cpu_s: stage.cpu_s,
    }
}

/// Appends a slice of items to those that are there.
fn append(
    what: &'static str,
    (first, all): (u64, usize),
    bands: usize,
    (areas, new_areas): (&mut Vec<f64>, Vec<f64>),
    (items, light): (&mut Vec<ItemLight>, Option<v1::ItemLight>),
) -> Result<(), RemoteError> {
    let light = light.unwrap_or_default();
    let count = new_areas.len();
    let columns = [
        &light.irradiance_upper_w_m2,
        &light.irradiance_lower_w_m2,
        &light.absorbed_w,
        &light.absorbed_direct_w,
        &light.absorbed_se_w,
    ];
    let fits = first == areas.len() as u64
        && count <= all - areas.len()
        && columns.iter().all(|column| column.len() == count * bands);
    if !fits {
        return Err(RemoteError::Answer(match what {
            "organs" => "organs that do not fit the scene",
            _ => "triangles that do not fit the scene",
        }));
    }
    areas.extend(new_areas);
    items.extend((0..count * bands).map(|k| {
        let [upper, lower, absorbed, direct, se] = columns.map(|column| column[k]);
        ItemLight {
            irradiance_upper_W_m2: upper,
            irradiance_lower_W_m2: lower,
            absorbed_W: absorbed,
            absorbed_direct_W: direct,
            absorbed_se_W: se,
        }
    }));
    Ok(())
}

fn balance(band: &v1::BandSummary, canopy: &Canopy) -> Result<Balance, RemoteError> {
    let estimate = |quantity: Option<v1::Quantity>| {
        let v1::Quantity { value, se } = quantity.unwrap_or_default();
        Estimate { value, se }
    };
    if band.materials.len() != canopy.materials.len() {
        return Err(RemoteError::Answer("materials that do not fit the scene"));
    }
    let materials = canopy.materials.iter().zip(canopy.kinds());
    let materials = materials.zip(&band.materials);
    let materials = materials.map(|((material, kind), of)| MaterialLight {
        name: material.to_string(),
        kind,
        absorbed_W: estimate(of.absorbed_w),
    });
    Ok(Balance {
        band: band.band.clone(),
        incoming_W: band.incoming_w,
        absorbed_plants_W: estimate(band.absorbed_plants_w),
        absorbed_leaves_W: estimate(band.absorbed_leaves_w),
        absorbed_stems_W: estimate(band.absorbed_stems_w),
        absorbed_structures_W: estimate(band.absorbed_structures_w),
        absorbed_soil_W: estimate(band.absorbed_soil_w),
        escaped_up_W: estimate(band.escaped_up_w),
        escaped_down_W: estimate(band.escaped_down_w),
        scattered_W: estimate(band.scattered_w),
        closure_W: estimate(band.closure_w),
        materials: materials.collect(),
    })
}

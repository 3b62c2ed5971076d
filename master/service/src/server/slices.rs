//! Results in slices, each made when the one before it is on its way.

use std::sync::Arc;

use nestrad_proto::{SLICE_BYTES, v1};
use v1::result_slice::Part;

use super::error::{ErrorCode, ServiceError};
use super::solution::HeldSolution;
use nestrad_engine::solution::{ItemLight, SensorLight, SoilMap};

/// Bytes of an item's numbers in each band, as they travel.
const LIGHT_BYTES: usize = 5 * 8;

/// The slices of a table, in order.
pub(super) fn of(
    outcome: Arc<HeldSolution>,
    table: v1::ResultTable,
) -> Result<Box<dyn Iterator<Item = v1::ResultSlice> + Send>, ServiceError> {
    let slice = |part| v1::ResultSlice { part: Some(part) };
    Ok(match table {
        v1::ResultTable::Organs => {
            let mut next = 0;
            Box::new(std::iter::from_fn(move || {
                let from = next;
                next = end_of_organs(&outcome, from);
                (next > from).then(|| slice(Part::Organs(organs(&outcome, from, next))))
            }))
        }
        v1::ResultTable::Triangles => {
            let bytes = LIGHT_BYTES * outcome.bands.len() + 12;
            let parts = parts(outcome.organ.len(), bytes);
            Box::new(parts.map(move |(a, b)| slice(Part::Triangles(triangles(&outcome, a, b)))))
        }
        v1::ResultTable::Soil => {
            let soil = outcome.solution.soil.as_ref();
            let cells = soil.map_or(0, |map| map.nx * map.ny);
            let parts = parts(cells, 16 * outcome.bands.len());
            Box::new(parts.filter_map(move |(a, b)| {
                let map = outcome.solution.soil.as_ref()?;
                Some(slice(Part::Soil(soil_cells(&outcome, map, a, b))))
            }))
        }
        v1::ResultTable::Sensors => {
            let readings = outcome.solution.readings.len();
            let parts = parts(readings, LIGHT_BYTES * outcome.bands.len());
            Box::new(parts.map(move |(a, b)| slice(Part::Sensors(readings_of(&outcome, a, b)))))
        }
        v1::ResultTable::Summary => Box::new(std::iter::once(slice(Part::Summary(
            outcome.summary.clone(),
        )))),
        v1::ResultTable::Unspecified => {
            let message = "table: expected organs, triangles, soil, sensors or summary";
            return Err(ServiceError::new(ErrorCode::Invalid, message));
        }
    })
}

/// Where slices of `items` of that size each begin and end.
fn parts(items: usize, item_bytes: usize) -> impl Iterator<Item = (usize, usize)> + Send {
    let step = (SLICE_BYTES / item_bytes.max(1)).max(1);
    (0..items)
        .step_by(step)
        .map(move |a| (a, (a + step).min(items)))
}

/// The end of the slice that begins with that organ: names differ in length.
fn end_of_organs(outcome: &HeldSolution, from: usize) -> usize {
    let mut bytes = 0;
    let fits = |organ: &&nestrad_common::canopy::Organ| {
        bytes += (LIGHT_BYTES + 8) * outcome.bands.len() + 16 + 16 + 4;
        bytes += organ.id.len() + organ.plant.len() + organ.species.len();
        bytes <= SLICE_BYTES
    };
    let rest = &outcome.organs[from..];
    from + rest.iter().take_while(fits).count().max(rest.len().min(1))
}

fn organs(outcome: &HeldSolution, from: usize, to: usize) -> v1::OrganLight {
    let bands = outcome.bands.len();
    let organs = &outcome.organs[from..to];
    let sunlit = outcome.solution.organ_sunlit_m2.get(from..to);
    let sunlit = sunlit.unwrap_or_default();
    v1::OrganLight {
        first: from as u64,
        bands: outcome.bands.clone(),
        id: organs.iter().map(|organ| organ.id.clone()).collect(),
        plant: organs.iter().map(|organ| organ.plant.clone()).collect(),
        species: organs.iter().map(|organ| organ.species.clone()).collect(),
        area_m2: outcome.solution.organ_area_m2[from..to].to_vec(),
        light: light(&outcome.solution.organs[from * bands..to * bands]),
        absorbed_bias_w: outcome.solution.organ_bias_W[from * bands..to * bands].to_vec(),
        sunlit_area_m2: sunlit.iter().map(|area| area.value).collect(),
        sunlit_area_se_m2: sunlit.iter().map(|area| area.se).collect(),
    }
}

fn triangles(outcome: &HeldSolution, from: usize, to: usize) -> v1::TriangleLight {
    let bands = outcome.bands.len();
    v1::TriangleLight {
        first: from as u64,
        bands: outcome.bands.clone(),
        organ: outcome.organ[from..to].to_vec(),
        area_m2: outcome.solution.triangle_area_m2[from..to].to_vec(),
        light: light(&outcome.solution.triangles[from * bands..to * bands]),
    }
}

fn readings_of(outcome: &HeldSolution, from: usize, to: usize) -> v1::SensorReadings {
    let readings = &outcome.solution.readings[from..to];
    let column = |of: fn(&SensorLight) -> f64| {
        let lights = readings.iter().flat_map(|reading| &reading.light);
        lights.map(of).collect()
    };
    v1::SensorReadings {
        first: from as u64,
        bands: outcome.bands.clone(),
        direct_w_m2: column(|light| light.direct.value),
        direct_se_w_m2: column(|light| light.direct.se),
        scattered_w_m2: column(|light| light.scattered.value),
        scattered_se_w_m2: column(|light| light.scattered.se),
        bias_w_m2: column(|light| light.bias),
    }
}

fn light(items: &[ItemLight]) -> Option<v1::ItemLight> {
    let column = |of: fn(&ItemLight) -> f64| items.iter().map(of).collect();
    Some(v1::ItemLight {
        irradiance_upper_w_m2: column(|item| item.irradiance_upper_W_m2),
        irradiance_lower_w_m2: column(|item| item.irradiance_lower_W_m2),
        absorbed_w: column(|item| item.absorbed_W),
        absorbed_direct_w: column(|item| item.absorbed_direct_W),
        absorbed_se_w: column(|item| item.absorbed_se_W),
    })
}

fn soil_cells(outcome: &HeldSolution, map: &SoilMap, from: usize, to: usize) -> v1::SoilLight {
    let bands = outcome.bands.len();
    let cells = &map.irradiance_W_m2[from * bands..to * bands];
    v1::SoilLight {
        first: from as u64,
        bands: outcome.bands.clone(),
        min_x_m: outcome.origin_m.x + map.min_m.x,
        min_y_m: outcome.origin_m.y + map.min_m.y,
        cell_x_m: map.cell_m.x,
        cell_y_m: map.cell_m.y,
        cells_x: map.nx as u32,
        cells_y: map.ny as u32,
        irradiance_w_m2: cells.iter().map(|cell| cell.value).collect(),
        irradiance_se_w_m2: cells.iter().map(|cell| cell.se).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_everything_once() {
        for (items, bytes) in [(0, 10), (1, 10), (100_000, 92), (7, 1 << 30)] {
            let mut next = 0;
            for (a, b) in parts(items, bytes) {
                assert!(a == next && b > a && ((b - a) * bytes <= SLICE_BYTES || b == a + 1));
                next = b;
            }
            assert_eq!(next, items);
        }
    }
}

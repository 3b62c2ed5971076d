//! How much a plan computes, reckoned beforehand.

use nestrad_kernel::elements::Elements;
use nestrad_kernel::soil::SoilGrid;

use super::Plan;
use crate::exchange::HALF_BATCHES;
use crate::frame::extent_of;
use crate::lit_canopy::LitCanopy;

/// Numbers of what takes time and memory in a solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkCounts {
    /// Triangles of the scene.
    pub triangles: f64,
    /// Elements that they are cut into.
    pub elements: f64,
    /// Cells of the soil.
    pub soil_cells: f64,
    /// Rows of the exchange.
    pub rows: f64,
    /// Directions of the exchange.
    pub directions: f64,
    /// Entries of all rows.
    pub entries: f64,
    /// Lines of the direct light, those of a sky included.
    pub direct_lines: f64,
    /// Directions of a sky.
    pub sky_directions: f64,
}

impl WorkCounts {
    /// Of a plan for a lit canopy.
    pub fn of(lit: &LitCanopy, plan: &Plan) -> Self {
        let mut counts = Self::without_entries(lit, plan);
        let Some(sampling) = &plan.trace.sampling else {
            return counts;
        };
        // each hit is seen from both sides, each line has two ends
        let hits = 0.5 * counts.directions * plan.scale.area_m2 / sampling.line_area_m2;
        let lines = sampling.lines(&extent_of(lit.canopy));
        let rays = f64::from(sampling.batches) * sampling.least_samples * counts.rows
            / HALF_BATCHES as f64;
        counts.entries = 2.0 * hits
            + lines
            + if sampling.sets_per_batch == 0 {
                rays
            } else {
                0.1 * rays
            };
        counts
    }

    /// The same without entries, which take long to count where there are many directions.
    pub(crate) fn without_entries(lit: &LitCanopy, plan: &Plan) -> Self {
        let LitCanopy {
            canopy, sources, ..
        } = *lit;
        let extent = extent_of(canopy);
        let soil = canopy
            .soil_z_m
            .map(|z_m| SoilGrid::over(&extent, z_m, plan.trace.soil_cell_m));
        let elements = Elements::count(canopy.corners_m(), plan.trace.max_edge_m) as f64;
        let soil_cells = soil.map_or(0.0, |s| f64::from(s.len()));
        let rows = 2.0 * elements + soil_cells;
        let areas = plan.light.line_areas_m2(&extent, sources);
        let direct = sources.list.iter().zip(areas);
        let directions = plan.trace.sampling.map_or(0.0, |sampling| {
            f64::from(sampling.batches * sampling.sets_per_batch * sampling.axes.count())
        });
        Self {
            triangles: canopy.len() as f64,
            elements,
            soil_cells,
            rows,
            directions,
            entries: 0.0,
            direct_lines: direct
                .map(|(source, area)| extent.lines_through(-source.direction, area))
                .sum(),
            sky_directions: sources.sky_directions as f64,
        }
    }
}

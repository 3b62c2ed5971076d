//! The tables of a result: organs, triangles and soil cells, one row per item and band.

use nestrad_common::canopy::{Canopy, Kind};
use nestrad_engine::solution::{Estimate, ItemLight, SoilMap, Solution};

use crate::table::{Column, Table};

/// The kind of an organ whose triangles are of several.
pub(crate) const MIXED: &str = "mixed";

/// One row per organ and band.
pub(crate) fn organs<'a>(
    canopy: &'a Canopy,
    bands: &'a [&str],
    solution: &'a Solution,
) -> Table<'a> {
    let count = bands.len();
    let organ = move |row: usize| &canopy.organs[row / count];
    let kinds = canopy.organ_kinds();
    let light = move |row: usize| &solution.organs[row];
    // none without a sun
    let sunlit = move |row: usize| solution.organ_sunlit_m2.get(row / count);
    Table {
        name: "organs",
        rows: canopy.organs.len() * count,
        columns: vec![
            Column::text("species", move |row| &organ(row).species),
            Column::text("plant", move |row| &organ(row).plant),
            Column::text("organ", move |row| &organ(row).id),
            Column::text("kind", move |row| {
                kinds[row / count].map_or(MIXED, Kind::name)
            }),
            Column::quantity("area_m2", move |row| solution.organ_area_m2[row / count]),
            Column::text("band", move |row| bands[row % count]),
            Column::quantity("irradiance_upper_W_m2", move |row| {
                light(row).irradiance_upper_W_m2
            }),
            Column::quantity("irradiance_lower_W_m2", move |row| {
                light(row).irradiance_lower_W_m2
            }),
            Column::quantity("absorbed_W", move |row| light(row).absorbed_W),
            Column::quantity("absorbed_direct_W", move |row| light(row).absorbed_direct_W),
            Column::quantity("absorbed_se_W", move |row| light(row).absorbed_se_W),
            Column::quantity("absorbed_bias_W", move |row| solution.organ_bias_W[row]),
            Column::sparse("sunlit_area_m2", move |row| Some(sunlit(row)?.value)),
            Column::sparse("shaded_area_m2", move |row| {
                Some((solution.organ_area_m2[row / count] - sunlit(row)?.value).max(0.0))
            }),
            Column::sparse("sunlit_area_se_m2", move |row| Some(sunlit(row)?.se)),
        ],
    }
}

/// One row per triangle and band; powers are per m² of one-sided area.
pub(crate) fn triangles<'a>(
    canopy: &'a Canopy,
    bands: &'a [&str],
    solution: &'a Solution,
) -> Table<'a> {
    let count = bands.len();
    let organ = move |row: usize| &canopy.organs[canopy.triangle(row / count).organ as usize];
    let kinds = canopy.kinds();
    let kind = move |row: usize| kinds[canopy.triangle(row / count).material as usize];
    let light = move |row: usize| triangle_light_per_m2(solution, row / count, count, row % count);
    Table {
        name: "triangles",
        rows: canopy.len() * count,
        columns: vec![
            Column::index("triangle", move |row| row / count),
            Column::text("species", move |row| &organ(row).species),
            Column::text("plant", move |row| &organ(row).plant),
            Column::text("organ", move |row| &organ(row).id),
            Column::text("kind", move |row| kind(row).name()),
            Column::quantity("area_m2", move |row| solution.triangle_area_m2[row / count]),
            Column::text("band", move |row| bands[row % count]),
            Column::quantity("irradiance_upper_W_m2", move |row| {
                light(row).irradiance_upper_W_m2
            }),
            Column::quantity("irradiance_lower_W_m2", move |row| {
                light(row).irradiance_lower_W_m2
            }),
            Column::quantity("absorbed_W_m2", move |row| light(row).absorbed_W),
            Column::quantity("absorbed_direct_W_m2", move |row| {
                light(row).absorbed_direct_W
            }),
            Column::quantity("absorbed_se_W_m2", move |row| light(row).absorbed_se_W),
        ],
    }
}

/// The light of a triangle with its powers per m² of one-sided area; a triangle without area has
/// none.
pub(crate) fn triangle_light_per_m2(
    solution: &Solution,
    triangle: usize,
    bands: usize,
    band: usize,
) -> ItemLight {
    let area_m2 = solution.triangle_area_m2[triangle];
    if area_m2 == 0.0 {
        return ItemLight::default();
    }
    let light = solution.triangles[triangle * bands + band];
    ItemLight {
        absorbed_W: light.absorbed_W / area_m2,
        absorbed_direct_W: light.absorbed_direct_W / area_m2,
        absorbed_se_W: light.absorbed_se_W / area_m2,
        ..light
    }
}

/// One row per soil cell and band; positions are the cells' centres in the user's coordinates.
pub(crate) fn soil<'a>(canopy: &'a Canopy, bands: &'a [&str], map: &'a SoilMap) -> Table<'a> {
    let count = bands.len();
    let ix = move |row: usize| row / count % map.nx;
    let iy = move |row: usize| row / count / map.nx;
    let corner_m = canopy.origin_m.truncate() + map.min_m;
    let irradiance = move |row: usize| -> Estimate { map.irradiance_W_m2[row] };
    Table {
        name: "soil",
        rows: map.nx * map.ny * count,
        columns: vec![
            Column::index("ix", ix),
            Column::index("iy", iy),
            Column::coordinate("x_m", move |row| {
                corner_m.x + (ix(row) as f64 + 0.5) * map.cell_m.x
            }),
            Column::coordinate("y_m", move |row| {
                corner_m.y + (iy(row) as f64 + 0.5) * map.cell_m.y
            }),
            Column::quantity("cell_x_m", move |_| map.cell_m.x),
            Column::quantity("cell_y_m", move |_| map.cell_m.y),
            Column::text("band", move |row| bands[row % count]),
            Column::quantity("irradiance_W_m2", move |row| irradiance(row).value),
            Column::quantity("irradiance_se_W_m2", move |row| irradiance(row).se),
        ],
    }
}

//! The tables of a series. Rows are in the order of time, of organs in the scene, of bands.

use std::rc::Rc;

use nestrad_common::canopy::Kind;
use nestrad_engine::solution::Balance;

use super::groups::{Group, plants, species};
use super::{OrganStep, SeriesResult};
use crate::table::{Column, Table};
use crate::tables::MIXED;

/// All of them.
pub(super) fn all<'a>(result: &'a SeriesResult<'a>) -> [Table<'a>; 5] {
    [
        series(result),
        balance(result),
        integrals(result),
        groups(result, "plants", plants(result.canopy), true),
        groups(result, "species", species(result.canopy), false),
    ]
}

/// Micromoles of a photon flux, or moles of a photon number, where the band says what a joule is.
fn photons<'a>(
    result: &'a SeriesResult<'a>,
    name: &'static str,
    per: f64,
    energy: impl Fn(usize) -> f64 + 'a,
) -> Option<Column<'a>> {
    let bands = result.bands.len();
    let any = result.photon_umol_J.iter().any(Option::is_some);
    any.then(|| {
        Column::sparse(name, move |row| {
            let factor = result.photon_umol_J[row % bands]?;
            Some(factor * energy(row) / per)
        })
    })
}

/// One row per moment, organ and band.
fn series<'a>(result: &'a SeriesResult<'a>) -> Table<'a> {
    let bands = result.bands.len();
    let items = result.canopy.organs.len() * bands;
    let organ = move |row: usize| &result.canopy.organs[row % items / bands];
    let kinds = result.canopy.organ_kinds();
    let light = move |row: usize| result.organ(row / items, row % items);
    let mut columns = vec![
        Column::text("time", move |row| &result.times[row / items].time),
        Column::text("species", move |row| &organ(row).species),
        Column::text("plant", move |row| &organ(row).plant),
        Column::text("organ", move |row| &organ(row).id),
        Column::text("kind", move |row| {
            kinds[row % items / bands].map_or(MIXED, Kind::name)
        }),
        Column::quantity("area_m2", move |row| {
            result.organ_area_m2[row % items / bands]
        }),
        Column::text("band", move |row| result.bands[row % bands]),
        Column::quantity("absorbed_W", move |row| light(row).absorbed_W),
        Column::quantity("absorbed_direct_W", move |row| light(row).absorbed_direct_W),
        Column::quantity("absorbed_se_W", move |row| light(row).absorbed_se_W),
        Column::quantity("absorbed_bias_W", move |row| light(row).absorbed_bias_W),
    ];
    let absorbed = move |row| light(row).absorbed_W;
    columns.extend(photons(result, "absorbed_umol_s", 1.0, absorbed));
    Table {
        name: "series",
        rows: result.times.len() * items,
        columns,
    }
}

/// One row per organ and band: sums over time. Errors are added up without regard to sign, which is the most that they
/// come to: those of one geometry go together from moment to moment.
fn integrals<'a>(result: &'a SeriesResult<'a>) -> Table<'a> {
    let bands = result.bands.len();
    let organ = move |row: usize| &result.canopy.organs[row / bands];
    let kinds = result.canopy.organ_kinds();
    let absorbed_J = move |row| result.integral(row, |step: OrganStep| step.absorbed_W);
    let mut columns = vec![
        Column::text("species", move |row| &organ(row).species),
        Column::text("plant", move |row| &organ(row).plant),
        Column::text("organ", move |row| &organ(row).id),
        Column::text("kind", move |row| {
            kinds[row / bands].map_or(MIXED, Kind::name)
        }),
        Column::quantity("area_m2", move |row| result.organ_area_m2[row / bands]),
        Column::text("band", move |row| result.bands[row % bands]),
        Column::quantity("absorbed_J", absorbed_J),
        Column::quantity("absorbed_direct_J", move |row| {
            result.integral(row, |step| step.absorbed_direct_W)
        }),
        Column::quantity("absorbed_se_J", move |row| {
            result.integral(row, |step| step.absorbed_se_W)
        }),
        Column::quantity("absorbed_bias_J", move |row| {
            result.integral(row, |step| step.absorbed_bias_W)
        }),
    ];
    columns.extend(photons(result, "absorbed_mol", 1e6, absorbed_J));
    Table {
        name: "integrals",
        rows: result.canopy.organs.len() * bands,
        columns,
    }
}

/// One row per moment, group of organs and band. Errors of organs of one group go together: their sum is the most that
/// they come to.
fn groups<'a>(
    result: &'a SeriesResult<'a>,
    name: &'static str,
    groups: Vec<Group<'a>>,
    named_plants: bool,
) -> Table<'a> {
    let bands = result.bands.len();
    let items = groups.len() * bands;
    let rows = result.times.len() * items;
    let groups = Rc::new(groups);
    let group = {
        let groups = groups.clone();
        move |row: usize| groups[row % items / bands].first
    };
    let sum = Rc::new(move |row: usize, of: &dyn Fn(OrganStep) -> f64| -> f64 {
        let organs = groups[row % items / bands].organs.iter();
        let item = |organ: &usize| organ * bands + row % bands;
        organs
            .map(|organ| of(result.organ(row / items, item(organ))))
            .sum()
    });
    let quantity = |name: &'static str, of: fn(OrganStep) -> f64| {
        let sum = sum.clone();
        Column::quantity(name, move |row| sum(row, &of))
    };
    let (of_species, of_plant) = (group.clone(), group.clone());
    let mut columns = vec![
        Column::text("time", move |row| &result.times[row / items].time),
        Column::text("species", move |row| &of_species(row).species),
    ];
    if named_plants {
        columns.push(Column::text("plant", move |row| &of_plant(row).plant));
    }
    columns.push(Column::text("band", move |row| result.bands[row % bands]));
    columns.push(quantity("absorbed_W", |step| step.absorbed_W));
    columns.push(quantity("absorbed_direct_W", |step| step.absorbed_direct_W));
    columns.push(quantity("absorbed_error_at_most_W", |step| {
        step.absorbed_se_W + step.absorbed_bias_W
    }));
    let absorbed = move |row| sum(row, &|step| step.absorbed_W);
    columns.extend(photons(result, "absorbed_umol_s", 1.0, absorbed));
    Table {
        name,
        rows,
        columns,
    }
}

/// One row per moment and band: where the energy goes, W per pattern (or per scene, when there is no pattern).
fn balance<'a>(result: &'a SeriesResult<'a>) -> Table<'a> {
    let bands = result.bands.len();
    let step = move |row: usize| result.steps[row / bands].as_ref();
    let flow = move |name: &'static str, of: fn(&Balance) -> f64| {
        Column::quantity(name, move |row| {
            step(row).map_or(0.0, |step| of(&step.facts.balance[row % bands]))
        })
    };
    Table {
        name: "balance",
        rows: result.times.len() * bands,
        columns: vec![
            Column::text("time", move |row| &result.times[row / bands].time),
            Column::quantity("sun_elevation_deg", move |row| {
                result.times[row / bands].sun_elevation_deg
            }),
            Column::text("band", move |row| result.bands[row % bands]),
            flow("incoming_W", |b| b.incoming_W),
            flow("absorbed_plants_W", |b| b.absorbed_plants_W.value),
            flow("absorbed_leaves_W", |b| b.absorbed_leaves_W.value),
            flow("absorbed_stems_W", |b| b.absorbed_stems_W.value),
            flow("absorbed_structures_W", |b| b.absorbed_structures_W.value),
            flow("absorbed_soil_W", |b| b.absorbed_soil_W.value),
            flow("escaped_up_W", |b| b.escaped_up_W.value),
            flow("escaped_down_W", |b| b.escaped_down_W.value),
            flow("scattered_W", |b| b.scattered_W.value),
            flow("closure_W", |b| b.closure_W.value),
            flow("closure_se_W", |b| b.closure_W.se),
            Column::sparse("error_percent", move |row| step(row)?.facts.error_percent),
        ],
    }
}

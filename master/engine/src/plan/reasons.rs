//! The plan in words, one line each, with the reason.

use nestrad_common::canopy::{Canopy, Kind};
use nestrad_common::inspection::SunFacts;
use nestrad_common::options::{Diameter, Scatter};

use super::{Estimator, Plan, Settings};
use crate::lit_canopy::LitCanopy;

/// Says what a plan does and why.
pub(super) fn of(lit: &LitCanopy, settings: &Settings, plan: &Plan) -> Vec<String> {
    let mut lines = vec![light(lit, plan)];
    lines.extend(sun(lit));
    lines.push(bands(lit, settings, plan));
    lines.push(exchange(settings, plan));
    lines.push(field(lit.canopy, settings, plan));
    lines.push(faces(lit.canopy));
    lines.push(soil(lit.canopy, plan));
    lines.extend(sensors(lit));
    lines.push(format!(
        "memory: about {:.2} GiB (program {:.2}, scene {:.2}, rows {:.2}, solver {:.2}) of {} GiB allowed",
        plan.memory.total_GiB(),
        plan.memory.program_GiB,
        plan.memory.scene_GiB,
        plan.memory.rows_GiB,
        plan.memory.solver_GiB,
        (1e3 * settings.memory_GiB).round() / 1e3
    ));
    lines.extend(limits(settings, plan));
    lines
}

/// What a limit made coarser.
fn limits(settings: &Settings, plan: &Plan) -> Option<String> {
    let aims = &plan.aims;
    let percent = |p: f64| (1e2 * p).round() / 1e2;
    let limit = match settings.budget_s {
        Some(s) => format!("--memory {} or --budget {s}", settings.memory_GiB),
        None => format!("--memory {}", settings.memory_GiB),
    };
    plan.is_limited().then(|| {
        format!(
            "limit: {limit} allows no finer plan, so it is coarser than was asked for: for an error of {} % by the exchange, {} % by elements, {} % by soil cells",
            percent(aims.exchange_percent),
            percent(aims.elements_percent),
            percent(aims.soil_percent)
        )
    })
}

fn light(lit: &LitCanopy, plan: &Plan) -> String {
    let pitch_mm = 1e3 * plan.light.direct_line_area_m2.sqrt();
    match lit.sources.list.len() {
        0 => "light: none, so nothing is lit".to_owned(),
        n => {
            format!(
                "light: {n} parallel sources; direct light is sampled every {pitch_mm:.2} mm for the strongest"
            )
        }
    }
}

fn sun(lit: &LitCanopy) -> Option<String> {
    let suns = &lit.sources.list[lit.sources.sky_directions..];
    SunFacts::of(suns).map(|sun| format!("sun: {sun}"))
}

fn bands(lit: &LitCanopy, settings: &Settings, plan: &Plan) -> String {
    if settings.scatter == Scatter::None {
        return format!(
            "bands: {}: direct light only; what is scattered is not followed (--scatter none)",
            lit.optics.names().join(", ")
        );
    }
    let names = |scatters: bool| -> Vec<&str> {
        (0..lit.optics.len())
            .filter(|b| plan.light.scattering_bands.contains(b) == scatters)
            .map(|b| lit.optics.bands[b].name.as_str())
            .collect()
    };
    match (names(true), names(false)) {
        (scatter, black) if black.is_empty() => format!("bands: {} scatter", scatter.join(", ")),
        (scatter, black) if scatter.is_empty() => {
            format!(
                "bands: {} black or unlit, so direct light only",
                black.join(", ")
            )
        }
        (scatter, black) => {
            format!(
                "bands: {} scatter; {} black or unlit, so direct light only",
                scatter.join(", "),
                black.join(", ")
            )
        }
    }
}

fn exchange(settings: &Settings, plan: &Plan) -> String {
    if settings.scatter == Scatter::None {
        return "exchange: none, because scattered light is not followed".to_owned();
    }
    let Some(s) = &plan.trace.sampling else {
        return "exchange: none, because nothing scatters".to_owned();
    };
    match settings.estimator {
        Estimator::Lines => format!(
            "exchange: {} directions of lines {:.1} mm apart, planned for an error of {} %",
            s.batches * s.sets_per_batch * s.axes.count(),
            1e3 * s.line_area_m2.sqrt(),
            (1e3 * plan.aims.exchange_percent).round() / 1e3
        ),
        Estimator::Rays => format!(
            "exchange: {} rays from every face (--estimator rays)",
            2.0 * s.least_samples
        ),
    }
}

fn field(canopy: &Canopy, settings: &Settings, plan: &Plan) -> String {
    match (plan.trace.radius_m, plan.trace.far_field, settings.diameter) {
        (Some(r), Some(f), _) => format!(
            "near field: within {r} m; far field beyond it: {} levels x {} bins per hemisphere, updated with the solution",
            f.levels, f.bins
        ),
        (_, _, Diameter::Metres(_))
            if plan.trace.sampling.is_some() && canopy.pattern.is_none() =>
        {
            "near field: full; no far field, because the scene does not repeat".to_owned()
        }
        (_, _, Diameter::Metres(d)) if plan.trace.sampling.is_some() => {
            format!(
                "near field: full; no far field, because no line of sight is longer than {} m",
                0.5 * d
            )
        }
        _ if plan.trace.sampling.is_some() => {
            "near field: full; no far field, because the rows of the exchange fit the memory"
                .to_owned()
        }
        _ => "near field: none; far field: none".to_owned(),
    }
}

fn faces(canopy: &Canopy) -> String {
    let solid = canopy
        .solids()
        .solid
        .into_iter()
        .filter(|&solid| solid)
        .count();
    format!(
        "faces: two for each of {} triangles; {solid} of them enclose solids, and parts of leaves inside a solid are dark",
        canopy.len()
    )
}

/// What is read after each solve.
fn sensors(lit: &LitCanopy) -> Option<String> {
    let rays: u64 = lit
        .sensors
        .iter()
        .map(|sensor| u64::from(sensor.rays))
        .sum();
    let count = lit.sensors.len();
    (count > 0).then(|| {
        format!(
            "sensors: {count}, by {rays} rays for scattered light and one or more to each source"
        )
    })
}

fn soil(canopy: &Canopy, plan: &Plan) -> String {
    let kinds = canopy.kinds();
    let triangles = canopy.triangles();
    let triangles = triangles
        .filter(|t| kinds[t.material as usize] == Kind::Soil)
        .count();
    let plane = match canopy.soil_z_m {
        Some(_) => format!(
            "a plane in cells of about {:.1} cm",
            100.0 * plan.trace.soil_cell_m
        ),
        None => "no plane: light escapes downwards".to_owned(),
    };
    format!("soil: {plane}; {triangles} triangles")
}

//! The method's own parameters at their ends.

use std::num::NonZeroUsize;

use nestrad_common::generate::LeafAngles;
use nestrad_common::light::Source;
use nestrad_common::optics::{Band, LeafOptics};
use nestrad_common::options::Diameter;
use nestrad_common::scene::Scene;
use nestrad_engine::far_field::layers::{Foliage, Layers};
use nestrad_engine::far_field::transport;
use nestrad_engine::plan::{Plan, Settings};

use super::judge::{changed, coarse, near, refusal, refused, solved, within_se};
use super::{Case, Verdict};
use crate::adding::{plates, stack};
use crate::canopies::{self, par_and_nir, small_leaves, uniform_sky};
use crate::solving::shares;

const AXIS: &str = "Method";

/// Leaves of 12 cm in a layer of 3 m: 130 of them.
fn canopy() -> Scene {
    let leaves = small_leaves(2.0, LeafAngles::Spherical, 1.5e-2, 5);
    canopies::scenery(&leaves, &par_and_nir()[1..], uniform_sky(12, 1)).scene()
}

fn diameter(text: &str) -> Result<Settings, String> {
    Ok(Settings {
        diameter: text.parse::<Diameter>().map_err(refusal)?,
        ..coarse()
    })
}

/// What a diameter does to the light of the canopy, against none.
fn against_plain(text: &str, bound: f64) -> Verdict {
    let scene = canopy();
    let plain = shares(&solved(&scene, &diameter("inf")?)?.solution, 0);
    let found = shares(&solved(&scene, &diameter(text)?)?.solution, 0);
    near("plants", found.plants, plain.plants, bound)
}

pub(super) fn cases() -> Vec<Case> {
    let mut cases = diameters();
    cases.extend(sampling());
    cases.extend(layers());
    cases
}

fn diameters() -> Vec<Case> {
    let mut cases: Vec<Case> = ["0", "-1", "nan", "1e-400"]
        .into_iter()
        .map(|text| {
            Case::new(
                AXIS,
                format!("D = {text}"),
                "refused: no diameter",
                move || refused(diameter(text), &["diameter", "metres above 0", text]),
            )
        })
        .collect();
    for (name, text, bound) in [
        ("D = 1e-9 m", "1e-9", 0.01),
        ("D = 2 cm, smaller than a leaf", "0.02", 0.01),
        ("D = 1 m, the pattern", "1", 0.005),
        ("D = 1e9 m", "1e9", 0.0),
        ("D = inf", "inf", 0.0),
    ] {
        cases.push(Case::new(
            AXIS,
            name,
            format!("light of the canopy as without a sphere within {bound} of what comes in"),
            move || against_plain(text, bound),
        ));
    }
    cases
}

fn with(accuracy_percent: f64, memory_GiB: f64) -> Settings {
    Settings {
        accuracy_percent,
        memory_GiB,
        ..Settings::default()
    }
}

fn sampling() -> Vec<Case> {
    let mut cases = vec![
        Case::new(
            AXIS,
            "accuracy 1e-9 %",
            "refused: more directions than a million",
            || refused(solved(&canopy(), &with(1e-9, 8.0)), &["accuracy", "1e-9"]),
        ),
        Case::new(
            AXIS,
            "accuracy 1e9 %",
            "solved within the error that it states",
            || {
                let solution = solved(&canopy(), &with(1e9, 8.0))?.solution;
                let fine = solved(&canopy(), &with(2.0, 8.0))?.solution;
                let [a, b] = [&solution, &fine].map(|s| s.balance[0].absorbed_plants_W);
                within_se("power/W", a.value, b.value, a.se.hypot(b.se))
            },
        ),
        Case::new(
            AXIS,
            "memory of 1 MiB",
            "refused, with what is needed",
            || {
                let outcome = solved(&canopy(), &with(0.5, 1.0 / 1024.0));
                refused(
                    outcome,
                    &["needs about", "limit is 9.765625e-4 GiB", "--memory"],
                )
            },
        ),
        Case::new(
            AXIS,
            "memory of 1e-300 GiB",
            "refused, with what is needed",
            || {
                refused(
                    solved(&canopy(), &with(0.5, 1e-300)),
                    &["needs about", "--memory"],
                )
            },
        ),
        Case::new(AXIS, "a sky of one direction", "adding of 3 plates", || {
            let leaf = LeafOptics::symmetric(0.4, 0.4);
            let mut scenery = plates(3, 0.1, leaf, 0.2);
            scenery.sources = uniform_sky(1, 1);
            let scene = scenery.scene();
            let solution = changed(&scene, &coarse(), |p| p.trace.max_edge_m = 0.1)?.solution;
            near(
                "albedo",
                shares(&solution, 0).up,
                stack(3, leaf, 0.2).albedo,
                1e-3,
            )
        }),
    ];
    for (name, pitch) in [
        ("lines 3 times as far apart as plates are wide", 3.0),
        ("lines thirty times as close as elements are wide", 3e-3),
    ] {
        cases.push(Case::new(AXIS, name, "adding of 3 plates", move || {
            let leaf = LeafOptics::symmetric(0.4, 0.4);
            let scene = plates(3, 0.1, leaf, 0.2).scene();
            let solution = changed(&scene, &coarse(), |plan: &mut Plan| {
                (plan.trace.max_edge_m, plan.light.direct_line_area_m2) = (0.1, 5e-6);
                if let Some(sampling) = &mut plan.trace.sampling {
                    sampling.line_area_m2 = pitch * pitch;
                }
            })?
            .solution;
            near(
                "albedo",
                shares(&solution, 0).up,
                stack(3, leaf, 0.2).albedo,
                1e-3,
            )
        }));
    }
    cases
}

/// Conservative horizontal leaves over black soil by the layer model: R = rho L / (1 + rho L), whatever
/// the direction of the light (DESIGN, section 7).
fn layer_model(layers: usize, bins: usize, area_index: f64) -> Verdict {
    let count = |n: usize| NonZeroUsize::new(n).ok_or_else(|| "none".to_owned());
    let foliage = Foliage {
        class: 0,
        material: 0,
        lower_face_up: false,
        area_index: area_index / layers as f64,
    };
    let canopy = Layers {
        bottom_z_m: 0.0,
        top_z_m: 1.0,
        class_cosine: vec![1.0],
        foliage: vec![vec![foliage]; layers],
        ground_area_m2: 1.0,
    };
    let band = Band {
        name: "B".to_owned(),
        soil_albedo: 0.0,
        materials: vec![LeafOptics::symmetric(0.5, 0.5)],
    };
    let source = Source {
        direction: crate::scenery::from_zenith(40.0, 0.0),
        irradiance_W_m2: vec![1.0],
    };
    let field = transport::solve(&canopy, &band, 0, &[source], Some(0.0), count(bins)?);
    let thick = 0.5 * area_index;
    near("albedo", field.reflected_W_m2, thick / (1.0 + thick), 1e-9)
}

fn layers() -> Vec<Case> {
    [
        ("1 layer, 1 bin", 1, 1, 3.0),
        ("10,000 layers", 10_000, 1, 3.0),
        ("64 bins", 10, 64, 3.0),
        ("optical depth 0", 10, 6, 0.0),
        ("optical depth 1e-12", 10, 6, 1e-12),
        ("optical depth 1e4", 10, 6, 1e4),
    ]
    .into_iter()
    .map(|(name, layers, bins, area_index)| {
        Case::new(
            AXIS,
            format!("layer model: {name}"),
            "conservative horizontal leaves: R = rho L / (1 + rho L)",
            move || layer_model(layers, bins, area_index),
        )
    })
    .collect()
}

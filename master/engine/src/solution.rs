//! What a solve gives: light per organ, per triangle and per soil cell, and the energy balance.

use glam::DVec2;
use nestrad_common::canopy::Kind;
use nestrad_common::sensors::Sensor;
use serde::{Deserialize, Serialize};

use crate::frame::{Order, back};

/// A value with its standard error, in the same unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// One standard error of it.
    pub se: f64,
}

/// The light of one item (an organ or a triangle) in one band.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ItemLight {
    /// Mean irradiance of the upper faces, W per m² of one-sided area.
    pub irradiance_upper_W_m2: f64,
    /// Mean irradiance of the lower faces, W per m² of one-sided area.
    pub irradiance_lower_W_m2: f64,
    /// Power absorbed by both faces, W.
    pub absorbed_W: f64,
    /// The part of it that came straight from the sources, W.
    pub absorbed_direct_W: f64,
    /// Standard error of `absorbed_W`, W.
    pub absorbed_se_W: f64,
}

/// What a sensor reads.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The sensor, in metres relative to the scene's local origin.
    pub sensor: Sensor,
    /// One per band.
    pub light: Vec<SensorLight>,
}

/// The light of a sensor in one band, W m⁻²; of radiance W m⁻² sr⁻¹.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorLight {
    /// Straight from the sources.
    pub direct: Estimate,
    /// From what they light.
    pub scattered: Estimate,
    /// How far both together may be off besides their standard errors: by the size of elements and soil cells, by the
    /// directions of a sky.
    pub bias: f64,
}

impl SensorLight {
    /// All of it.
    pub fn total(&self) -> Estimate {
        Estimate {
            value: self.direct.value + self.scattered.value,
            se: self.direct.se.hypot(self.scattered.se),
        }
    }
}

/// Irradiance of the soil plane on a regular grid of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct SoilMap {
    /// Lower corner of cell (0, 0), in metres relative to the scene's local origin.
    pub min_m: DVec2,
    /// Size of a cell, metres.
    pub cell_m: DVec2,
    /// Number of cells along x and y; cell (ix, iy) is number `iy * nx + ix`.
    pub nx: usize,
    /// See `nx`.
    pub ny: usize,
    /// W m⁻², indexed `cell * bands + band`.
    pub irradiance_W_m2: Vec<Estimate>,
}

/// Where the energy of a band goes, in W per pattern (or per scene, when there is no pattern).
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Balance {
    /// Name of the band.
    pub band: String,
    /// What the sources bring, and in an open scene what the soil beyond its map sends.
    pub incoming_W: f64,
    /// Absorbed by plants: leaves and stems.
    pub absorbed_plants_W: Estimate,
    /// The part of it that leaves absorb.
    #[serde(default)]
    pub absorbed_leaves_W: Estimate,
    /// The part of it that stems absorb.
    #[serde(default)]
    pub absorbed_stems_W: Estimate,
    /// Absorbed by what is declared to be a structure.
    #[serde(default)]
    pub absorbed_structures_W: Estimate,
    /// Absorbed by the soil plane and by soil triangles.
    pub absorbed_soil_W: Estimate,
    /// Leaves upwards to the sky.
    pub escaped_up_W: Estimate,
    /// Leaves downwards into the void where there is no soil.
    pub escaped_down_W: Estimate,
    /// Scattered where it first met something, and not followed: all that was scattered in a band that was not solved
    /// for, nothing in others.
    #[serde(default)]
    pub scattered_W: Estimate,
    /// `incoming - absorbed - escaped - scattered`: what the estimate does not account for.
    pub closure_W: Estimate,
    /// Absorbed by the triangles of each material, in the scene's order.
    #[serde(default)]
    pub materials: Vec<MaterialLight>,
}

/// What a material absorbs in a band.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct MaterialLight {
    /// Its name, as in [`Material`](nestrad_common::canopy::Material).
    pub name: String,
    /// What it counts as.
    pub kind: Kind,
    /// By all of it, W.
    pub absorbed_W: Estimate,
}

/// What the error of a band's organs comes from: each as the root mean square of [`OrganSpread`](crate::account::OrganSpread), percent.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct BandAccount {
    /// Name of the band.
    pub band: String,
    /// Sampling of the exchange and of the far field.
    pub exchange_percent: f64,
    /// Sampling of the direct light.
    pub direct_percent: f64,
    /// Directions that stand for a whole sky.
    pub sky_percent: f64,
    /// That a radiosity is constant over an element.
    pub elements_percent: f64,
    /// That the same holds for cells of the soil, and for zones of the soil around them.
    #[serde(default)]
    pub soil_percent: f64,
    /// That light from beyond the sphere is that of a mean field.
    pub far_field_percent: f64,
    /// What the solver left undone, at most; the whole of it, not of an organ.
    pub solver_percent: f64,
}

impl BandAccount {
    /// All of it: parts are independent of each other, but for what the solver left.
    pub fn total_percent(&self) -> f64 {
        let squares = [
            self.exchange_percent,
            self.direct_percent,
            self.sky_percent,
            self.elements_percent,
            self.soil_percent,
            self.far_field_percent,
        ];
        squares.iter().map(|p| p * p).sum::<f64>().sqrt() + self.solver_percent
    }

    /// The parts, with names.
    pub fn named(&self) -> [(f64, &'static str); 7] {
        [
            (self.exchange_percent, "exchange"),
            (self.direct_percent, "direct light"),
            (self.sky_percent, "sky directions"),
            (self.elements_percent, "element size"),
            (self.soil_percent, "soil cell size"),
            (self.far_field_percent, "far field"),
            (self.solver_percent, "solver"),
        ]
    }

    /// The name of the largest part.
    pub fn largest(&self) -> &'static str {
        let parts = self.named();
        let larger = |a: (f64, &'static str), b: (f64, &'static str)| if b.0 > a.0 { b } else { a };
        parts.into_iter().fold(parts[0], larger).1
    }
}

/// All results of a solve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solution {
    /// Indexed `organ * bands + band`, organs in the scene's order.
    pub organs: Vec<ItemLight>,
    /// How far `absorbed_W` of each organ may be off besides its standard error: by the size of elements and
    /// soil cells, by the directions of a sky, by the mean field beyond a sphere; W, indexed like `organs`.
    pub organ_bias_W: Vec<f64>,
    /// Indexed `triangle * bands + band`, triangles in the scene's order.
    pub triangles: Vec<ItemLight>,
    /// One-sided area of each organ, m².
    pub organ_area_m2: Vec<f64>,
    /// One-sided area of each triangle, m².
    pub triangle_area_m2: Vec<f64>,
    /// One-sided area of each organ that the sun reaches on either side, m²: of the sources that are not directions of a
    /// sky, the strongest. Empty without a sun.
    pub organ_sunlit_m2: Vec<Estimate>,
    /// Where there is a soil plane.
    pub soil: Option<SoilMap>,
    /// What sensors read, in their order.
    pub readings: Vec<Reading>,
    /// One per band.
    pub balance: Vec<Balance>,
    /// What the error of organs comes from, for each band in which something is absorbed.
    pub account: Vec<BandAccount>,
}

impl Solution {
    /// The solution of a frame in that order, in the order of the canopy.
    pub(crate) fn in_order_of(self, order: &Order) -> Self {
        let bands = self.balance.len();
        let mut balance = self.balance;
        for band in &mut balance {
            band.materials = back(&band.materials, &order.material, 1);
        }
        Self {
            balance,
            organs: back(&self.organs, &order.organ, bands),
            organ_bias_W: back(&self.organ_bias_W, &order.organ, bands),
            organ_sunlit_m2: back(&self.organ_sunlit_m2, &order.organ, 1),
            organ_area_m2: back(&self.organ_area_m2, &order.organ, 1),
            triangles: back(&self.triangles, &order.triangle, bands),
            triangle_area_m2: back(&self.triangle_area_m2, &order.triangle, 1),
            ..self
        }
    }
}

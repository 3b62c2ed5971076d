//! What a solve gives: light per organ, per triangle and per soil cell, and the energy balance.

use glam::DVec2;
use serde::{Deserialize, Serialize};

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
    /// Absorbed by all triangles (soil triangles included in `absorbed_soil_W` instead).
    pub absorbed_plants_W: Estimate,
    /// Absorbed by the soil plane and by soil triangles.
    pub absorbed_soil_W: Estimate,
    /// Leaves upwards to the sky.
    pub escaped_up_W: Estimate,
    /// Leaves downwards into the void where there is no soil.
    pub escaped_down_W: Estimate,
    /// `incoming - absorbed - escaped`: what the estimate does not account for.
    pub closure_W: Estimate,
}

/// All results of a solve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solution {
    /// Indexed `organ * bands + band`, organs in the scene's order.
    pub organs: Vec<ItemLight>,
    /// How far `absorbed_W` of each organ may be off besides its standard error: by the size of elements, by
    /// the directions of a sky, by the mean field beyond a sphere; W, indexed like `organs`.
    pub organ_bias_W: Vec<f64>,
    /// Indexed `triangle * bands + band`, triangles in the scene's order.
    pub triangles: Vec<ItemLight>,
    /// One-sided area of each organ, m².
    pub organ_area_m2: Vec<f64>,
    /// One-sided area of each triangle, m².
    pub triangle_area_m2: Vec<f64>,
    /// Where there is a soil plane.
    pub soil: Option<SoilMap>,
    /// One per band.
    pub balance: Vec<Balance>,
}

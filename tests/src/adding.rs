//! Full plates one above the other: the adding of layers (Stokes 1862).

use glam::DVec2;
use nestrad_common::optics::LeafOptics;

use crate::enclosure::full_plate;
use crate::scenery::{Scenery, from_zenith};

/// What plates of one kind over soil do with unit irradiance.
pub struct Stack {
    /// Of plates and soil together.
    pub albedo: f64,
    /// Irradiance of each plate's upper face, from the top down.
    pub upper: Vec<f64>,
    /// Irradiance of each plate's lower face, from the top down.
    pub lower: Vec<f64>,
    /// Irradiance of the soil.
    pub soil: f64,
}

/// `n` plates over soil. What lies below a plate is known by its albedo alone.
pub fn stack(n: usize, leaf: LeafOptics, soil_albedo: f64) -> Stack {
    let (upper, lower) = (leaf.upper, leaf.lower);
    // albedo under plate k, counted from the bottom
    let mut under = vec![soil_albedo];
    for k in 0..n {
        let r = under[k];
        under.push(upper.rho + through(upper.tau, lower.rho * r) * r * lower.tau);
    }
    let mut down = 1.0;
    let (mut e_upper, mut e_lower) = (Vec::new(), Vec::new());
    for k in (0..n).rev() {
        // light between this plate and what is below goes to and fro
        let below = down * through(upper.tau, lower.rho * under[k]);
        e_upper.push(down);
        e_lower.push(below * under[k]);
        down = below;
    }
    Stack {
        albedo: under[n],
        upper: e_upper,
        lower: e_lower,
        soil: down,
    }
}

/// What comes through a plate and to and fro below it; nothing comes of nothing, even between mirrors.
fn through(tau: f64, to_and_fro: f64) -> f64 {
    if tau > 0.0 {
        tau / (1.0 - to_and_fro)
    } else {
        0.0
    }
}

/// Plates `gap_m` apart over soil at 0, each moved past the edges of the pattern by its own bit; under
/// two sources of 100 W m⁻² together.
pub fn plates(n: usize, gap_m: f64, leaf: LeafOptics, soil_albedo: f64) -> Scenery {
    let mut scenery = Scenery::periodic(DVec2::new(0.6, 0.4)).soil(0.0);
    for k in 0..n {
        let z = gap_m * (n - k) as f64;
        let offset = DVec2::new(0.07, -0.05) * k as f64;
        full_plate(&mut scenery, &format!("leaf {k}"), z, offset);
    }
    scenery.band("B", soil_albedo, &[("leaf", leaf)]);
    scenery.source(from_zenith(0.0, 0.0), 60.0);
    scenery.source(from_zenith(50.0, 30.0), 40.0);
    scenery
}

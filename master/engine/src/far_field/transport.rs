//! Plane-parallel transport of scattered light through the layers of a canopy.
//!
//! Leaves are small, randomly placed within a layer, and turned to all azimuths alike; radiance is
//! averaged over azimuth and constant over a polar bin (Shultis & Myneni 1988 for the scattering of
//! two-sided Lambertian leaves; Max et al. 1997 for its use as a far field). With one bin per
//! hemisphere this is the classical two-stream model of isotropic fluxes.

use std::f64::consts::TAU;
use std::num::NonZeroUsize;

use nestrad_common::light::Source;
use nestrad_common::optics::Band;

use super::adding::{Fluxes, add_layers};
use super::layer_slab::LayerSlab;
use super::layers::Layers;
use super::leaf::Bins;
use super::medium::{Beams, Medium};

/// Scattered light in a canopy, in one band.
///
/// What comes straight from the sources is not in the radiances; all powers have it. Energy balance:
/// `incoming = sum of absorbed + reflected + (1 - soil albedo) * transmitted`.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    bins: usize,
    /// Indexed `level * bins + bin`.
    radiance_up: Vec<f64>,
    /// Likewise.
    radiance_down: Vec<f64>,
    /// What the sources bring, W per m² of ground.
    pub incoming_W_m2: f64,
    /// Absorbed by each layer, W per m² of ground, layer 0 lowest.
    pub absorbed_W_m2: Vec<f64>,
    /// Leaves the canopy at the top, W per m² of ground.
    pub reflected_W_m2: f64,
    /// Arrives at level 0 from above, W per m² of ground.
    pub transmitted_W_m2: f64,
}

impl Field {
    /// Polar bins per hemisphere. Bin `b` holds directions with `|cos(zenith angle)|` from
    /// `b / bins` to `(b + 1) / bins`.
    pub fn bins_per_hemisphere(&self) -> usize {
        self.bins
    }

    /// Number of levels, one more than layers.
    pub fn levels(&self) -> usize {
        self.absorbed_W_m2.len() + 1
    }

    /// Radiance of scattered light that travels upwards, W m⁻² sr⁻¹, `>= 0`. Level 0 is the lowest,
    /// bin 0 the one next to the horizon.
    pub fn radiance_up(&self, level: usize, bin: usize) -> f64 {
        self.radiance_up[level * self.bins + bin]
    }

    /// Radiance of scattered light that travels downwards, W m⁻² sr⁻¹, `>= 0`; see
    /// [`Self::radiance_up`].
    pub fn radiance_down(&self, level: usize, bin: usize) -> f64 {
        self.radiance_down[level * self.bins + bin]
    }
}

/// The scattered light in `layers`, lit by parallel `sources` alone.
///
/// `band` must have an entry for every material of the layers and physical optics; `band_index` says
/// which of the sources' irradiances is its own; sources travel downwards. `soil_albedo`, 0 to 1, is
/// that of a Lambertian plane at level 0; `None` is a black void. All of that is checked where a
/// [`nestrad_common::scene::Scene`] is made.
///
/// Memory: about `16 bins^2` bytes per layer that holds something; time: of order `layers bins^3`.
pub fn solve(
    layers: &Layers,
    band: &Band,
    band_index: usize,
    sources: &[Source],
    soil_albedo: Option<f64>,
    bins_per_hemisphere: NonZeroUsize,
) -> Field {
    let bins = Bins(bins_per_hemisphere.get());
    let beams = Beams::new(sources, band_index);
    let medium = Medium::new(layers, bins, band, &beams);
    let slabs_from_top = layers.foliage.iter().rev().map(|foliage| {
        let layer = medium.layer(foliage)?;
        Some(LayerSlab::of_layer(&layer))
    });
    let fluxes = add_layers(
        bins,
        slabs_from_top,
        &beams.irradiance,
        soil_albedo.unwrap_or(0.0),
    );
    field(bins, fluxes, beams.irradiance.iter().sum())
}

fn field(bins: Bins, fluxes: Fluxes, incoming_W_m2: f64) -> Field {
    let power = |level: Option<&Vec<f64>>| level.into_iter().flatten().sum::<f64>();
    // Flux of a bin is radiance times solid angle, TAU / m, times mean cosine. Rounding may leave a
    // trace below zero where there is no light.
    let radiance = |levels: &[Vec<f64>]| {
        let of_bin = |(b, flux): (usize, &f64)| flux * bins.0 as f64 / (TAU * bins.mu(b));
        levels
            .iter()
            .flat_map(|level| level.iter().enumerate().map(of_bin))
            .map(|x| if x < 0.0 { 0.0 } else { x })
            .collect()
    };
    Field {
        bins: bins.0,
        radiance_up: radiance(&fluxes.up),
        radiance_down: radiance(&fluxes.down),
        incoming_W_m2,
        reflected_W_m2: power(fluxes.up.last()),
        transmitted_W_m2: power(fluxes.down.first()) + fluxes.beams_at_ground,
        absorbed_W_m2: fluxes.absorbed,
    }
}

//! What is to be solved, and what comes of it.

use nestrad_common::optics::Optics;

use super::groups::Groups;
use crate::exchange::{Exchange, FarRows, Outlook};
use crate::frame::Frame;
use crate::sinks::SINKS;

/// What is to be solved.
#[derive(Clone, Copy)]
pub struct System<'a> {
    /// Elements and numbers.
    pub frame: &'a Frame,
    /// In the frame's order.
    pub optics: &'a Optics,
    /// What rows see.
    pub exchange: &'a Exchange,
    /// What of it is not a radiosity to solve for.
    pub outlook: &'a Outlook,
    /// Which rows share one radiosity when elements are larger.
    pub groups: &'a Groups,
    /// What the far field is the mean of, where there is one.
    pub far: Option<&'a FarRows>,
    /// E0, indexed `row * all bands + band`.
    pub direct_W_m2: &'a [f64],
    /// Radiosity of the ends that are not rows (sky, void, outer soil, buried, far field: its start),
    /// indexed `(end - rows) * all bands + band`.
    pub fixed_W_m2: &'a [f64],
    /// Incoming power of all bands, W: what tolerances are relative to.
    pub incoming_W: &'a [f64],
    /// What the far field is judged by, where there is one.
    pub far_sample: Option<FarSample<'a>>,
}

/// An exchange and what of it is not a radiosity to solve for.
#[derive(Clone, Copy, Debug)]
pub struct Sampled<'a> {
    /// What rows see.
    pub exchange: &'a Exchange,
    /// See [`System::outlook`].
    pub outlook: &'a Outlook,
}

/// The exchange by the same few lines within the sphere and without end.
#[derive(Clone, Copy, Debug)]
pub struct FarSample<'a> {
    /// As the solve has it.
    pub within: Sampled<'a>,
    /// On the true geometry.
    pub without_end: Sampled<'a>,
}

/// Irradiances of all rows, in both halves.
#[derive(Clone, Debug, Default)]
pub struct Irradiance {
    /// From the first and from the second half, W m⁻², indexed `row * bands + band`.
    pub halves: [Vec<f64>; 2],
    /// What leaves upwards and downwards through the far field, W per m² of ground, per band.
    pub leaving_W_m2: Vec<[f64; 2]>,
    /// Bands, as indexed here.
    pub bands: usize,
    /// Passes over all rows that it took.
    pub passes: u32,
    /// Estimated remaining change of absorbed power relative to incoming, per band.
    pub left: Vec<f64>,
    /// What the sampling of the exchange leaves uncertain, per band.
    pub variances: Vec<Variances>,
    /// What the size of elements may do, per band.
    pub of_element_size: Vec<Deviation>,
    /// What the mean field beyond the sphere does, per band, where there is one.
    pub of_far_field: Vec<Deviation>,
}

impl Irradiance {
    /// The mean of both halves.
    pub fn mean(&self, row: usize, band: usize) -> f64 {
        let k = row * self.bands + band;
        0.5 * (self.halves[0][k] + self.halves[1][k])
    }
}

/// Variances of one band.
#[derive(Clone, Debug, Default)]
pub struct Variances {
    /// Of the power that each triangle absorbs, W².
    pub triangle_W2: Vec<f64>,
    /// Of the power that each organ absorbs, W².
    pub organ_W2: Vec<f64>,
    /// Of the irradiance of each soil cell, (W m⁻²)².
    pub soil_W2_m4: Vec<f64>,
    /// Of the power that each material absorbs, W².
    pub material_W2: Vec<f64>,
    /// Of the power that goes to each sink: plants, soil, the sky and so on, W².
    pub sinks_W2: [f64; SINKS],
    /// Of what is missing in their sum, W².
    pub closure_W2: f64,
}

/// A change of the power that organs absorb in one band, if the model were another.
#[derive(Clone, Debug, Default)]
pub struct Deviation {
    /// By the lines of each half, W, per organ.
    pub halves_W: [Vec<f64>; 2],
}

//! Light of sources of one colour: which shine with the same shares of all bands, as the directions of a sky do. What
//! they light is summed for all bands together.

use nestrad_common::light::Source;
use nestrad_common::optics::Optics;

use super::Direct;
use super::lit_areas::LitAreas;
use crate::frame::Frame;

/// Shares of two sources are the same if they differ by rounding alone.
const ROUNDING: f64 = 1e-12;

/// What sources of one colour light, in W m⁻² of all bands together.
pub(super) struct Coloured {
    /// Irradiance of each row.
    irradiance_W_m2: Vec<f64>,
    /// Variance of each row: of the power that a face intercepts, W², or of the irradiance of a soil cell.
    variance: Vec<f64>,
    /// Irradiance that plants keep from each zone of the soil around the map.
    shade_W_m2: Vec<f64>,
    /// The sum of the sources, per band, W m⁻² of the horizontal.
    band_W_m2: Vec<f64>,
}

/// Whether sources have the same shares of all bands.
pub(super) fn are_alike(a: &Source, b: &Source) -> bool {
    let [sum_a, sum_b] = [a, b].map(Source::irradiance_of_bands_W_m2);
    let bands = a.irradiance_W_m2.iter().zip(&b.irradiance_W_m2);
    bands
        .into_iter()
        .all(|(of_a, of_b)| (of_a * sum_b - of_b * sum_a).abs() <= ROUNDING * sum_a * sum_b)
}

impl Coloured {
    pub(super) fn dark(frame: &Frame, bands: usize) -> Self {
        Self {
            irradiance_W_m2: vec![0.0; frame.rows()],
            variance: vec![0.0; frame.rows()],
            shade_W_m2: vec![0.0; frame.ends.outer_zones as usize],
            band_W_m2: vec![0.0; bands],
        }
    }

    /// Adds the light of a source to what its direction lights.
    pub(super) fn add(&mut self, frame: &Frame, lit: &LitAreas, source: &Source) {
        for (sum, of_band) in self.band_W_m2.iter_mut().zip(&source.irradiance_W_m2) {
            *sum += of_band;
        }
        let irradiance_W_m2 = source.irradiance_of_bands_W_m2();
        // perpendicular to the source
        let intensity_W_m2 = irradiance_W_m2 / lit.towards.z;
        let of_a_line_W2 = (intensity_W_m2 * lit.line_area_m2).powi(2);
        for face in &lit.faces {
            let row = face.row as usize;
            self.irradiance_W_m2[row] += intensity_W_m2 * face.part;
            self.variance[row] += of_a_line_W2 * f64::from(face.variance);
        }
        for cell in &lit.soil {
            let row = frame.ends.soil(cell.cell) as usize;
            self.irradiance_W_m2[row] += irradiance_W_m2 * cell.part;
            self.variance[row] += irradiance_W_m2 * irradiance_W_m2 * cell.variance;
        }
        for shade in &lit.shades {
            self.shade_W_m2[shade.zone as usize] += irradiance_W_m2 * shade.part;
        }
    }

    /// Gives all of it to the bands, and is dark again.
    pub(super) fn pour(&mut self, frame: &Frame, optics: &Optics, direct: &mut Direct) {
        let bands = optics.len();
        let all_W_m2: f64 = self.band_W_m2.iter().sum();
        let elements = frame.area_m2.len();
        for (b, band) in optics.bands.iter().enumerate() {
            if self.band_W_m2[b] == 0.0 {
                continue;
            }
            let share = self.band_W_m2[b] / all_W_m2;
            for (row, irradiance) in self.irradiance_W_m2.iter().enumerate() {
                direct.irradiance_W_m2[row * bands + b] += share * irradiance;
            }
            for (e, variance) in self.variance[..2 * elements].chunks_exact(2).enumerate() {
                let t = frame.triangle_of_element[e] as usize;
                let material = &band.materials[frame.material[t] as usize];
                // bands may be so far apart that the square of a share is no number
                let of = |upper: bool, variance: f64| {
                    let absorbed = share * material.absorptance(upper);
                    absorbed * (absorbed * variance)
                };
                direct.element_variance_W2[e * bands + b] +=
                    of(true, variance[0]) + of(false, variance[1]);
            }
            for (cell, variance) in self.variance[2 * elements..].iter().enumerate() {
                direct.soil_variance_W2_m4[cell * bands + b] += share * (share * variance);
            }
            for (zone, shade) in self.shade_W_m2.iter().enumerate() {
                direct.shade_W_m2[zone * bands + b] += share * shade;
            }
        }
        for of in [
            &mut self.irradiance_W_m2,
            &mut self.variance,
            &mut self.shade_W_m2,
            &mut self.band_W_m2,
        ] {
            of.fill(0.0);
        }
    }
}

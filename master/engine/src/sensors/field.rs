//! The radiosities of all that a ray can meet: those of the solution, and those by which its errors are told.

use super::Surroundings;
use crate::solver::Groups;

/// What there is of each band.
pub(super) const VARIANTS: usize = 6;

/// The radiosity of the first and of the second half of the exchange; the mean of both, were elements larger, or cells of
/// the soil, put together in either way; and the variance of what each end sends out of direct light, W² m⁻⁴.
#[derive(Clone, Copy)]
pub(super) enum Variant {
    FirstHalf = 0,
    SecondHalf = 1,
    LargerElements = 2,
    LargerCells = 3,
    OtherLargerCells = 4,
    DirectVariance = 5,
}

/// Radiosities, W m⁻², by end, band and variant.
pub(super) struct Field {
    bands: usize,
    values: Vec<f64>,
    /// How much wider larger elements are.
    pub(super) wider: f64,
}

impl Field {
    pub(super) fn of(around: &Surroundings, groups: &Groups) -> Self {
        let bands = around.optics.len();
        let ends = around.frame.ends.len();
        let mut field = Self {
            bands,
            values: vec![0.0; ends * bands * VARIANTS],
            wider: groups.wider(),
        };
        for (k, &b) in around.scattering.iter().enumerate() {
            let halves = [0, 1].map(|half| of_half(around, (k, b), half));
            let [x, y] = &halves;
            let mean: Vec<f64> = x.iter().zip(y).map(|(x, y)| 0.5 * (x + y)).collect();
            let exposed_m2 =
                |row: usize| around.frame.row_area_m2(row) * around.outlook.exposed[row];
            field.put(
                b,
                Variant::LargerElements,
                &groups.of_larger_elements(exposed_m2, &mean),
            );
            let [one, other] = groups.of_larger_cells(&mean);
            field.put(b, Variant::LargerCells, &one);
            field.put(b, Variant::OtherLargerCells, &other);
            field.put(b, Variant::DirectVariance, &of_direct(around, b));
            field.put(b, Variant::FirstHalf, x);
            field.put(b, Variant::SecondHalf, y);
        }
        field
    }

    pub(super) fn bands(&self) -> usize {
        self.bands
    }

    /// All bands of an end: `band * VARIANTS + variant`.
    pub(super) fn at(&self, end: u32) -> &[f64] {
        let lanes = self.bands * VARIANTS;
        &self.values[end as usize * lanes..][..lanes]
    }

    fn put(&mut self, band: usize, variant: Variant, radiosity: &[f64]) {
        let lanes = self.bands * VARIANTS;
        let first = band * VARIANTS + variant as usize;
        let places = self.values.iter_mut().skip(first).step_by(lanes);
        places.zip(radiosity).for_each(|(to, &from)| *to = from);
    }
}

/// The variance of what every row sends out of the direct light of a band, W² m⁻⁴: of an element in proportion to that
/// of what it absorbs.
fn of_direct(around: &Surroundings, b: usize) -> Vec<f64> {
    let (frame, band, direct) = (around.frame, &around.optics.bands[b], around.direct);
    let bands = around.optics.len();
    let on = |row: usize| direct.irradiance_W_m2[row * bands + b];
    let mut variances = vec![0.0; frame.ends.len()];
    for (e, &t) in frame.triangle_of_element.iter().enumerate() {
        let optics = band.materials[frame.material[t as usize] as usize];
        let (upper, lower) = (on(2 * e), on(2 * e + 1));
        let absorbed_W = frame.area_m2[e]
            * (optics.upper.absorptance() * upper + optics.lower.absorptance() * lower);
        if absorbed_W > 0.0 {
            let relative = direct.element_variance_W2[e * bands + b] / (absorbed_W * absorbed_W);
            let sent = optics.radiosities([upper, lower]);
            for (side, sent) in sent.into_iter().enumerate() {
                variances[2 * e + side] = relative * sent * sent;
            }
        }
    }
    let cells = direct.soil_variance_W2_m4.iter().skip(b).step_by(bands);
    let soil = variances[frame.ends.faces() as usize..].iter_mut();
    soil.zip(cells)
        .for_each(|(to, variance)| *to = band.soil_albedo * band.soil_albedo * variance);
    variances
}

/// What every end sends out in a band by a half of the exchange, W m⁻².
fn of_half(around: &Surroundings, (k, b): (usize, usize), half: usize) -> Vec<f64> {
    let (frame, band) = (around.frame, &around.optics.bands[b]);
    let (bands, ends) = (around.irradiance.bands, &frame.ends);
    let on = |row: usize| around.irradiance.halves[half][row * bands + k];
    let mut radiosity = vec![0.0; ends.len()];
    for (e, &t) in frame.triangle_of_element.iter().enumerate() {
        let optics = band.materials[frame.material[t as usize] as usize];
        let sent = optics.radiosities([on(2 * e), on(2 * e + 1)]);
        radiosity[2 * e..][..2].copy_from_slice(&sent);
    }
    let soil = ends.faces() as usize..frame.rows();
    for (row, out) in soil.clone().zip(&mut radiosity[soil]) {
        *out = band.soil_albedo * on(row);
    }
    let all = around.optics.len();
    let (of_zones, beyond) = around
        .outer_soil_W_m2
        .split_at(ends.outer_zones as usize * all);
    radiosity[ends.outer_soil() as usize] = beyond[b];
    let zones = radiosity[ends.zone(0) as usize..].iter_mut();
    zones
        .zip(of_zones.iter().skip(b).step_by(all))
        .for_each(|(to, &from)| *to = from);
    radiosity
}

//! The account of errors: how far a solution is thought to be off, and what that comes from.

use serde::Serialize;

use crate::direct::Direct;
use crate::solution::{BandAccount, Solution};
use crate::solver::{Deviation, Irradiance};

/// What the standard errors of a band's organs come to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OrganSpread {
    /// Name of the band.
    pub band: String,
    /// Standard error of an organ's absorbed power per area, root mean square over the plants' area,
    /// in percent of the mean over that area; none where nothing is absorbed.
    pub rms_percent: Option<f64>,
}

/// What the errors of organs come from.
pub(crate) struct Accounting<'a> {
    direct: &'a Direct,
    irradiance: &'a Irradiance,
    scattering: &'a [usize],
}

impl<'a> Accounting<'a> {
    /// Of direct light and of the irradiances in the bands that scatter, which have these numbers.
    pub(crate) fn of(
        direct: &'a Direct,
        irradiance: &'a Irradiance,
        scattering: &'a [usize],
    ) -> Self {
        Self {
            direct,
            irradiance,
            scattering,
        }
    }

    /// One per band in which something is absorbed; `plants` tells which organs are of plants.
    pub(crate) fn of_bands(&self, plants: &[bool], solution: &Solution) -> Vec<BandAccount> {
        let bands = solution.balance.len();
        let rms = |square_W2: &dyn Fn(usize) -> f64| rms_of(plants, solution, square_W2);
        let sampling = organ_spread(plants, solution);
        let direct = rms(&|item| self.direct.organ_variance_W2[item]);
        let sky = rms(&|item| self.sky_W2(item));
        let elements = rms(&|item| self.elements(item, bands).map_or(0.0, squared));
        let soil = rms(&|item| {
            let ways = self.soil_cells(item, bands);
            0.5 * ways.into_iter().flatten().map(squared).sum::<f64>()
        });
        let far = rms(&|item| self.far_field(item, bands).map_or(0.0, squared));
        let part = |b: usize| {
            let [sampling, direct] = [&sampling, &direct].map(|part| part[b].rms_percent);
            let (sampling, direct) = (sampling?, direct?);
            let of = |part: &[OrganSpread]| part[b].rms_percent.unwrap_or(0.0);
            let balance = &solution.balance[b];
            let left = self.solved(b).map_or(0.0, |k| self.irradiance.left[k]);
            Some(BandAccount {
                band: balance.band.clone(),
                exchange_percent: (sampling * sampling - direct * direct).max(0.0).sqrt(),
                direct_percent: direct,
                sky_percent: of(&sky),
                elements_percent: of(&elements),
                soil_percent: of(&soil),
                far_field_percent: of(&far),
                solver_percent: 100.0 * left * balance.incoming_W / balance.absorbed_plants_W.value,
            })
        };
        (0..bands).filter_map(part).collect()
    }

    /// All but sampling, of each organ, W.
    pub(crate) fn bias_W(&self, solution: &Solution) -> Vec<f64> {
        let bands = solution.balance.len();
        let mean = |halves: Option<[f64; 2]>| halves.map_or(0.0, |[a, b]| 0.5 * (a + b));
        let of = |item: usize| {
            let sky = self.sky_W2(item).max(0.0);
            let elements = mean(self.elements(item, bands));
            let soil = self.soil_cells(item, bands).map(|way| mean(way).powi(2));
            let far = mean(self.far_field(item, bands));
            (sky + elements * elements + 0.5 * (soil[0] + soil[1]) + far * far).sqrt()
        };
        (0..solution.organs.len()).map(of).collect()
    }

    fn solved(&self, band: usize) -> Option<usize> {
        self.scattering.iter().position(|&s| s == band)
    }

    /// What halves of a sky differ by is that error of each, squared; with twice as many directions it is
    /// smaller by [`TWICE_AS_MANY`]. What they differ by for the sampling of the direct light is taken off.
    fn sky_W2(&self, item: usize) -> f64 {
        let [a, b] = self
            .direct
            .sky_halves_W
            .each_ref()
            .map(|half| half.get(item));
        let Some((a, b)) = a.zip(b) else { return 0.0 };
        let of_both = (a - b).powi(2) - 4.0 * self.direct.organ_variance_W2[item];
        0.5 * of_both * TWICE_AS_MANY
    }

    fn elements(&self, item: usize, bands: usize) -> Option<[f64; 2]> {
        self.deviation(&self.irradiance.of_element_size, item, bands)
    }

    /// In either way of putting cells together.
    fn soil_cells(&self, item: usize, bands: usize) -> [Option<[f64; 2]>; 2] {
        let ways = self.irradiance.of_soil_cells.each_ref();
        ways.map(|way| self.deviation(way, item, bands))
    }

    fn far_field(&self, item: usize, bands: usize) -> Option<[f64; 2]> {
        self.deviation(&self.irradiance.of_far_field, item, bands)
    }

    fn deviation(&self, of: &[Deviation], item: usize, bands: usize) -> Option<[f64; 2]> {
        let deviation = of.get(self.solved(item % bands)?)?;
        let [a, b] = deviation
            .halves_W
            .each_ref()
            .map(|half| half.get(item / bands));
        Some([*a?, *b?])
    }
}

/// By two independent estimates, so that their noise does not count.
fn squared([a, b]: [f64; 2]) -> f64 {
    a * b
}

/// How the square of a sky's error goes with the number of directions: as its power -1.6 (see
/// `light::sky::directions_for`).
pub(crate) const TWICE_AS_MANY: f64 = 0.33;

/// One per band; `plants` tells which organs are of plants, which alone count.
pub fn organ_spread(plants: &[bool], solution: &Solution) -> Vec<OrganSpread> {
    rms_of(plants, solution, |item| {
        solution.organs[item].absorbed_se_W.powi(2)
    })
}

/// The same of some variances, in W², indexed like the solution's organs.
fn rms_of(
    plants: &[bool],
    solution: &Solution,
    variance_W2: impl Fn(usize) -> f64,
) -> Vec<OrganSpread> {
    let bands = solution.balance.len();
    let rms_percent = |band: usize| {
        let (mut area_m2, mut absorbed_W, mut square) = (0.0, 0.0, 0.0);
        for (organ, &own_m2) in solution.organ_area_m2.iter().enumerate() {
            if plants[organ] && own_m2 > 0.0 {
                let item = organ * bands + band;
                area_m2 += own_m2;
                absorbed_W += solution.organs[item].absorbed_W;
                square += variance_W2(item) / own_m2;
            }
        }
        (absorbed_W > 0.0).then(|| 100.0 * (square.max(0.0) * area_m2).sqrt() / absorbed_W)
    };
    let names = solution.balance.iter().map(|balance| &balance.band);
    names
        .enumerate()
        .map(|(band, name)| OrganSpread {
            band: name.clone(),
            rms_percent: rms_percent(band),
        })
        .collect()
}

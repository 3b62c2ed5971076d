//! How large the errors of a result are thought to be, in one number per band.

use nestrad_common::scene::Scene;
use serde::{Deserialize, Serialize};

use crate::direct::Direct;
use crate::solution::Solution;
use crate::solver::{Deviation, Irradiance};
use crate::world::is_soil;

/// What the standard errors of a band's organs come to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OrganErrors {
    /// Name of the band.
    pub band: String,
    /// Standard error of an organ's absorbed power per area, root mean square over the plants' area,
    /// in percent of the mean over that area; none where nothing is absorbed.
    pub rms_percent: Option<f64>,
}

/// What the error of a band's organs comes from: each as the root mean square of [`OrganErrors`], percent.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct ErrorParts {
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
    /// That light from beyond the sphere is that of a mean field.
    pub far_field_percent: f64,
    /// What the solver left undone, at most; the whole of it, not of an organ.
    pub solver_percent: f64,
}

impl ErrorParts {
    /// All of it: parts are independent of each other, but for what the solver left.
    pub fn total_percent(&self) -> f64 {
        let squares = [
            self.exchange_percent,
            self.direct_percent,
            self.sky_percent,
            self.elements_percent,
            self.far_field_percent,
        ];
        squares.iter().map(|p| p * p).sum::<f64>().sqrt() + self.solver_percent
    }

    /// The parts, with names.
    pub fn named(&self) -> [(f64, &'static str); 6] {
        [
            (self.exchange_percent, "exchange"),
            (self.direct_percent, "direct light"),
            (self.sky_percent, "directions of the sky"),
            (self.elements_percent, "size of elements"),
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

/// What the errors of organs come from.
pub(crate) struct OrganParts<'a> {
    direct: &'a Direct,
    irradiance: &'a Irradiance,
    scattering: &'a [usize],
}

impl<'a> OrganParts<'a> {
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

    /// One per band in which something is absorbed.
    pub(crate) fn of_scene(&self, scene: &Scene, solution: &Solution) -> Vec<ErrorParts> {
        let bands = solution.balance.len();
        let rms = |square_W2: &dyn Fn(usize) -> f64| rms_of(scene, solution, square_W2);
        let sampling = organ_errors(scene, solution);
        let direct = rms(&|item| self.direct.organ_variance_W2[item]);
        let sky = rms(&|item| self.sky_W2(item));
        let elements = rms(&|item| self.elements(item, bands).map_or(0.0, squared));
        let far = rms(&|item| self.far_field(item, bands).map_or(0.0, squared));
        let part = |b: usize| {
            let [sampling, direct] = [&sampling, &direct].map(|part| part[b].rms_percent);
            let (sampling, direct) = (sampling?, direct?);
            let of = |part: &[OrganErrors]| part[b].rms_percent.unwrap_or(0.0);
            let balance = &solution.balance[b];
            let left = self.solved(b).map_or(0.0, |k| self.irradiance.left[k]);
            Some(ErrorParts {
                band: balance.band.clone(),
                exchange_percent: (sampling * sampling - direct * direct).max(0.0).sqrt(),
                direct_percent: direct,
                sky_percent: of(&sky),
                elements_percent: of(&elements),
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
            let far = mean(self.far_field(item, bands));
            (sky + elements * elements + far * far).sqrt()
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
const TWICE_AS_MANY: f64 = 0.33;

/// One per band. Soil triangles do not count.
pub fn organ_errors(scene: &Scene, solution: &Solution) -> Vec<OrganErrors> {
    rms_of(scene, solution, |item| {
        solution.organs[item].absorbed_se_W.powi(2)
    })
}

/// The same of some variances, in W², indexed like the solution's organs.
pub(crate) fn rms_of(
    scene: &Scene,
    solution: &Solution,
    variance_W2: impl Fn(usize) -> f64,
) -> Vec<OrganErrors> {
    let bands = solution.balance.len();
    let mut plant = vec![true; scene.organs.len()];
    for (&organ, soil) in scene.organ.iter().zip(is_soil(scene)) {
        plant[organ as usize] &= !soil;
    }
    let rms_percent = |band: usize| {
        let (mut area_m2, mut absorbed_W, mut square) = (0.0, 0.0, 0.0);
        for (organ, &own_m2) in solution.organ_area_m2.iter().enumerate() {
            if plant[organ] && own_m2 > 0.0 {
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
        .map(|(band, name)| OrganErrors {
            band: name.clone(),
            rms_percent: rms_percent(band),
        })
        .collect()
}

//! From irradiances of elements to light per organ and triangle, and the energy balance.

use nestrad_common::optics::{Band, LeafOptics, Optics};
use nestrad_kernel::far_grid::Exit;

use crate::direct::Direct;
use crate::exchange::Outlook;
use crate::frame::Frame;
use crate::sinks::{SINKS, Sink};
use crate::solution::{Balance, Estimate, ItemLight, MaterialLight, SoilMap, Solution};
use crate::solver::{Irradiance, Variances};

/// All that the results are put together from.
pub(crate) struct Parts<'a> {
    /// Elements and soil cells.
    pub frame: &'a Frame,
    /// In the frame's order.
    pub optics: &'a Optics,
    /// Uncollided light.
    pub direct: &'a Direct,
    /// See [`outer_soil`](crate::outer_soil).
    pub outer_soil_W_m2: &'a [f64],
    /// What rows see of the sky.
    pub outlook: &'a Outlook,
    /// Of the bands in `scattering`; the others have direct light only.
    pub irradiance: &'a Irradiance,
    /// Numbers of the bands that were solved.
    pub scattering: &'a [usize],
}

impl Parts<'_> {
    /// Puts the results together.
    pub(crate) fn assemble(&self) -> Solution {
        let (bands, frame) = (self.optics.len(), self.frame);
        let triangles = frame.organ.len();
        let mut solution = Solution {
            organs: vec![ItemLight::default(); frame.organs * bands],
            triangles: vec![ItemLight::default(); triangles * bands],
            organ_area_m2: vec![0.0; frame.organs],
            triangle_area_m2: vec![0.0; triangles],
            ..Solution::default()
        };
        for (e, &t) in frame.triangle_of_element.iter().enumerate() {
            let area = frame.area_m2[e];
            solution.triangle_area_m2[t as usize] += area;
            solution.organ_area_m2[frame.organ[t as usize] as usize] += area;
        }
        for b in 0..bands {
            self.add_items(b, &mut solution);
        }
        finish(&mut solution.organs, &solution.organ_area_m2, bands);
        finish(&mut solution.triangles, &solution.triangle_area_m2, bands);
        let sunlit = self.direct.sunlit.iter().map(|sunlit| Estimate {
            value: sunlit.area_m2,
            se: sunlit.variance_m4.sqrt(),
        });
        solution.organ_sunlit_m2 = sunlit.collect();
        solution.soil = self.soil_map();
        solution.balance = (0..bands).map(|b| self.balance(b, &solution)).collect();
        solution
    }

    /// Mean irradiance of a row, W m⁻² of all of it.
    fn irradiance_W_m2(&self, row: usize, b: usize) -> f64 {
        match self.solved(b) {
            Some(k) => self.irradiance.mean(row, k) * self.outlook.exposed[row],
            None => self.first_W_m2(row, b),
        }
    }

    fn first_W_m2(&self, row: usize, b: usize) -> f64 {
        self.direct.irradiance_W_m2[row * self.optics.len() + b]
    }

    fn solved(&self, b: usize) -> Option<usize> {
        self.scattering.iter().position(|&s| s == b)
    }

    fn variances(&self, b: usize) -> Option<&Variances> {
        self.solved(b).map(|k| &self.irradiance.variances[k])
    }

    /// Sums over the elements of each item, with variances in place of standard errors.
    fn add_items(&self, b: usize, solution: &mut Solution) {
        let (bands, frame) = (self.optics.len(), self.frame);
        for (e, &t) in frame.triangle_of_element.iter().enumerate() {
            let t = t as usize;
            let optics = self.optics.bands[b].materials[frame.material[t] as usize];
            let (upper, lower) = (optics.upper.absorptance(), optics.lower.absorptance());
            let area = frame.area_m2[e];
            let (on_upper, on_lower) = (
                self.irradiance_W_m2(2 * e, b),
                self.irradiance_W_m2(2 * e + 1, b),
            );
            let (first_upper, first_lower) =
                (self.first_W_m2(2 * e, b), self.first_W_m2(2 * e + 1, b));
            for item in [
                &mut solution.triangles[t * bands + b],
                &mut solution.organs[frame.organ[t] as usize * bands + b],
            ] {
                item.irradiance_upper_W_m2 += on_upper * area;
                item.irradiance_lower_W_m2 += on_lower * area;
                item.absorbed_W += area * (upper * on_upper + lower * on_lower);
                item.absorbed_direct_W += area * (upper * first_upper + lower * first_lower);
            }
            solution.triangles[t * bands + b].absorbed_se_W +=
                self.direct.element_variance_W2[e * bands + b];
        }
        for (o, item) in solution
            .organs
            .iter_mut()
            .skip(b)
            .step_by(bands)
            .enumerate()
        {
            item.absorbed_se_W = self.direct.organ_variance_W2[o * bands + b];
        }
        if let Some(variances) = self.variances(b) {
            let add = |items: &mut [ItemLight], of: &[f64]| {
                for (item, v) in items.iter_mut().skip(b).step_by(bands).zip(of) {
                    item.absorbed_se_W += v;
                }
            };
            add(&mut solution.triangles, &variances.triangle_W2);
            add(&mut solution.organs, &variances.organ_W2);
        }
    }

    fn soil_map(&self) -> Option<SoilMap> {
        let soil = self.frame.world.soil?;
        let bands = self.optics.len();
        let irradiance_W_m2 = (0..soil.len() as usize * bands)
            .map(|k| {
                let (cell, b) = (k / bands, k % bands);
                Estimate {
                    value: self.irradiance_W_m2(self.frame.ends.soil(cell as u32) as usize, b),
                    se: (self.variances(b).map_or(0.0, |v| v.soil_W2_m4[cell])
                        + self.direct.soil_variance_W2_m4[k])
                        .sqrt(),
                }
            })
            .collect();
        Some(SoilMap {
            min_m: soil.min_m,
            cell_m: soil.cell_m,
            nx: soil.cells[0] as usize,
            ny: soil.cells[1] as usize,
            irradiance_W_m2,
        })
    }

    fn balance(&self, b: usize, solution: &Solution) -> Balance {
        let (bands, band) = (self.optics.len(), &self.optics.bands[b]);
        let frame = self.frame;
        let mut sinks = [0.0; SINKS];
        let mut materials = vec![0.0; frame.kinds.len()];
        for t in 0..frame.organ.len() {
            let absorbed = solution.triangles[t * bands + b].absorbed_W;
            for &sink in Sink::of(frame.kind(t)) {
                sinks[sink as usize] += absorbed;
            }
            materials[frame.material[t] as usize] += absorbed;
        }
        for row in frame.ends.faces() as usize..frame.rows() {
            sinks[Sink::Soil as usize] +=
                (1.0 - band.soil_albedo) * frame.row_area_m2(row) * self.irradiance_W_m2(row, b);
        }
        let [up, scattered_down] = self.solved(b).map_or([0.0; 2], |k| self.escaped_W(band, k));
        sinks[Sink::Up as usize] = up;
        sinks[Sink::Down as usize] = scattered_down + self.direct.passed_W[b];
        let incoming = self.direct.incoming_W[b] + self.outer_soil_W(b);
        let scattered = match self.solved(b) {
            Some(_) => Estimate::default(),
            None => Estimate {
                value: self.scattered_once_W(b),
                se: self.direct.share_variances[b].scattered_W2.sqrt(),
            },
        };
        let missing = |left: f64, sink: Sink| left - sinks[sink as usize];
        let closure = Sink::WHOLE
            .into_iter()
            .fold(incoming - scattered.value, missing);
        let none = Variances::default();
        let variances = self.variances(b).unwrap_or(&none);
        let estimate = |value: f64, variance: f64| Estimate {
            value,
            se: variance.sqrt(),
        };
        let direct = &self.direct.share_variances[b];
        let mut sinks_W2 = variances.sinks_W2;
        for (sum, direct_W2) in sinks_W2.iter_mut().zip(&direct.sinks_W2) {
            *sum += direct_W2;
        }
        // over soil nothing passes by
        if frame.world.extent.periodic && frame.world.soil.is_none() {
            sinks_W2[Sink::Down as usize] += direct.caught_W2;
        }
        // of a little more scattered light the same parts leave as of all of it
        let once_W = self.direct.incoming_W[b]
            - self.direct.passed_W[b]
            - self.absorbed_at_once_W(b, solution);
        for (sink, leaving_W) in [(Sink::Up, up), (Sink::Down, scattered_down)] {
            let part = if once_W > 0.0 {
                (leaving_W / once_W).clamp(0.0, 1.0)
            } else {
                0.0
            };
            sinks_W2[sink as usize] += part * part * direct.scattered_W2;
        }
        let of = |sink: Sink| estimate(sinks[sink as usize], sinks_W2[sink as usize]);
        let material = |(m, &absorbed): (usize, &f64)| MaterialLight {
            name: frame.materials[m].clone(),
            kind: frame.kinds[m],
            absorbed_W: estimate(
                absorbed,
                variances.material_W2.get(m).copied().unwrap_or(0.0) + direct.material_W2[m],
            ),
        };
        Balance {
            band: band.name.clone(),
            incoming_W: incoming,
            absorbed_plants_W: of(Sink::Plants),
            absorbed_leaves_W: of(Sink::Leaves),
            absorbed_stems_W: of(Sink::Stems),
            absorbed_structures_W: of(Sink::Structures),
            absorbed_soil_W: of(Sink::Soil),
            escaped_up_W: of(Sink::Up),
            escaped_down_W: of(Sink::Down),
            scattered_W: scattered,
            closure_W: estimate(
                closure,
                variances.closure_W2 + self.direct.closure_variance_W2[b],
            ),
            materials: materials.iter().enumerate().map(material).collect(),
        }
    }

    /// What plants and soil absorb of uncollided light, W.
    fn absorbed_at_once_W(&self, b: usize, solution: &Solution) -> f64 {
        let bands = self.optics.len();
        let items = solution.organs.iter().skip(b).step_by(bands);
        let rows = self.frame.ends.faces() as usize..self.frame.rows();
        let on_soil = rows.map(|row| self.frame.row_area_m2(row) * self.first_W_m2(row, b));
        items.map(|item| item.absorbed_direct_W).sum::<f64>()
            + (1.0 - self.optics.bands[b].soil_albedo) * on_soil.sum::<f64>()
    }

    /// What plants and soil scatter of uncollided light, W.
    fn scattered_once_W(&self, b: usize) -> f64 {
        let (frame, band) = (self.frame, &self.optics.bands[b]);
        let of_elements = frame.triangle_of_element.iter().enumerate().map(|(e, &t)| {
            let LeafOptics { upper, lower } = band.materials[frame.material[t as usize] as usize];
            let [on_upper, on_lower] = [2 * e, 2 * e + 1].map(|row| self.first_W_m2(row, b));
            frame.area_m2[e]
                * ((upper.rho + upper.tau) * on_upper + (lower.rho + lower.tau) * on_lower)
        });
        let soil = frame.ends.faces() as usize..frame.rows();
        let on_soil = soil.map(|row| frame.row_area_m2(row) * self.first_W_m2(row, b));
        of_elements.sum::<f64>() + band.soil_albedo * on_soil.sum::<f64>()
    }

    /// Power that the soil beyond the map of an open scene sends to what is on it, W.
    fn outer_soil_W(&self, b: usize) -> f64 {
        if self.solved(b).is_none() {
            return 0.0;
        }
        let radiosity = self
            .outer_soil_W_m2
            .iter()
            .skip(b)
            .step_by(self.optics.len());
        let seen_m2 = &self.outlook.outer_soil_m2;
        radiosity.zip(seen_m2).map(|(b, seen)| b * seen).sum()
    }

    /// Scattered power that leaves the scene upwards and downwards, W.
    ///
    /// What a face sends out by one half is taken to leave along the lines of the other: a face that by
    /// chance sees more of the sky gets less light by the same lines.
    fn escaped_W(&self, band: &Band, k: usize) -> [f64; 2] {
        let frame = self.frame;
        if frame.ends.far_ends > 0 {
            let ground_m2 = frame.world.ground_area_m2();
            return Exit::BOTH
                .map(|exit| self.irradiance.leaving_W_m2[k][exit as usize] * ground_m2);
        }
        let mut sum = [0.0; 2];
        for (half, irradiance) in self.irradiance.halves.iter().enumerate() {
            let on = |row: usize| irradiance[row * self.irradiance.bands + k];
            let to_sky = &self.outlook.to_sky[1 - half];
            let mut add = |row: usize, radiosity: f64| {
                let power = 0.5 * radiosity * frame.row_area_m2(row) * self.outlook.exposed[row];
                sum[0] += power * to_sky[row];
                sum[1] += power * self.outlook.to_void(1 - half, row);
            };
            for (e, &t) in frame.triangle_of_element.iter().enumerate() {
                let optics = band.materials[frame.material[t as usize] as usize];
                let [upper, lower] = optics.radiosities([on(2 * e), on(2 * e + 1)]);
                add(2 * e, upper);
                add(2 * e + 1, lower);
            }
            for row in frame.ends.faces() as usize..frame.rows() {
                add(row, band.soil_albedo * on(row));
            }
        }
        sum
    }
}

/// From sums over elements to means over area, and from variances to standard errors.
fn finish(items: &mut [ItemLight], area_m2: &[f64], bands: usize) {
    for (k, item) in items.iter_mut().enumerate() {
        let area = area_m2[k / bands];
        if area > 0.0 {
            item.irradiance_upper_W_m2 /= area;
            item.irradiance_lower_W_m2 /= area;
        }
        item.absorbed_se_W = item.absorbed_se_W.sqrt();
    }
}

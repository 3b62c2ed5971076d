//! From irradiances of elements to light per organ and triangle, and the energy balance.

use nestrad_common::problem::Problem;

use crate::direct::Direct;
use crate::exchange::Outlook;
use crate::solution::{Balance, Estimate, ItemLight, SoilMap, Solution};
use crate::solver::Irradiance;
use crate::world::{self, World};

/// Puts the results together. `scattering`: the numbers of the bands that `irradiance` holds; the
/// others have direct light only.
pub fn assemble(
    problem: &Problem,
    world: &World,
    direct: &Direct,
    outlook: &Outlook,
    irradiance: &Irradiance,
    scattering: &[usize],
) -> Solution {
    let bands = problem.bands.len();
    let scene = &problem.scene;
    let mut solution = Solution {
        organs: vec![ItemLight::default(); scene.organs.len() * bands],
        triangles: vec![ItemLight::default(); scene.triangles.len() * bands],
        organ_area_m2: vec![0.0; scene.organs.len()],
        triangle_area_m2: vec![0.0; scene.triangles.len()],
        ..Solution::default()
    };
    for e in 0..world.elements.len() {
        let t = world.triangle_of_element[e] as usize;
        solution.triangle_area_m2[t] += world.elements.area_m2[e];
        solution.organ_area_m2[scene.organ[t] as usize] += world.elements.area_m2[e];
    }
    for (b, band) in problem.bands.iter().enumerate() {
        let solved = scattering.iter().position(|&s| s == b);
        let of_row = |row: usize| match solved {
            Some(k) => irradiance.mean(row, k) * outlook.exposed[row],
            None => direct.irradiance_W_m2[row * bands + b],
        };
        for e in 0..world.elements.len() {
            let t = world.triangle_of_element[e] as usize;
            let optics = band.materials[scene.material[t] as usize];
            let (upper, lower) = (optics.upper.absorptance(), optics.lower.absorptance());
            let area = world.elements.area_m2[e];
            let (eu, el) = (of_row(2 * e), of_row(2 * e + 1));
            let first = [
                direct.irradiance_W_m2[2 * e * bands + b],
                direct.irradiance_W_m2[(2 * e + 1) * bands + b],
            ];
            let sampled = solved.map_or(0.0, |k| {
                irradiance.element_variance_W2[e * irradiance.bands + k]
            });
            let item = ItemLight {
                irradiance_upper_W_m2: eu * area,
                irradiance_lower_W_m2: el * area,
                absorbed_W: area * (upper * eu + lower * el),
                absorbed_direct_W: area * (upper * first[0] + lower * first[1]),
                absorbed_se_W: sampled + direct.element_variance_W2[e * bands + b],
            };
            for to in [
                &mut solution.triangles[t * bands + b],
                &mut solution.organs[scene.organ[t] as usize * bands + b],
            ] {
                to.irradiance_upper_W_m2 += item.irradiance_upper_W_m2;
                to.irradiance_lower_W_m2 += item.irradiance_lower_W_m2;
                to.absorbed_W += item.absorbed_W;
                to.absorbed_direct_W += item.absorbed_direct_W;
                to.absorbed_se_W += item.absorbed_se_W;
            }
        }
        for o in 0..scene.organs.len() {
            let sampled = solved.map_or(0.0, |k| {
                irradiance.organ_variance_W2[o * irradiance.bands + k]
            });
            solution.organs[o * bands + b].absorbed_se_W =
                sampled + direct.organ_variance_W2[o * bands + b];
        }
    }
    finish(&mut solution.organs, &solution.organ_area_m2, bands);
    finish(&mut solution.triangles, &solution.triangle_area_m2, bands);
    solution.soil = soil_map(world, direct, irradiance, scattering, bands);
    solution.balance = balance(
        problem, world, direct, outlook, irradiance, scattering, &solution,
    );
    solution
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

fn soil_map(
    world: &World,
    direct: &Direct,
    irradiance: &Irradiance,
    scattering: &[usize],
    bands: usize,
) -> Option<SoilMap> {
    let soil = world.soil?;
    let mut map = SoilMap {
        min_m: soil.min_m,
        cell_m: soil.cell_m,
        nx: soil.nx as usize,
        ny: soil.ny as usize,
        irradiance_W_m2: vec![Estimate::default(); soil.cells() as usize * bands],
    };
    for cell in 0..soil.cells() {
        let row = world.ends.soil(cell) as usize;
        for b in 0..bands {
            map.irradiance_W_m2[cell as usize * bands + b].value =
                match scattering.iter().position(|&s| s == b) {
                    Some(k) => irradiance.mean(row, k),
                    None => direct.irradiance_W_m2[row * bands + b],
                };
        }
    }
    Some(map)
}

fn balance(
    problem: &Problem,
    world: &World,
    direct: &Direct,
    outlook: &Outlook,
    irradiance: &Irradiance,
    scattering: &[usize],
    solution: &Solution,
) -> Vec<Balance> {
    let bands = problem.bands.len();
    let is_soil = world::is_soil(&problem.scene);
    let value = |value: f64| Estimate { value, se: 0.0 };
    problem
        .bands
        .iter()
        .enumerate()
        .map(|(b, band)| {
            let of = |soil: bool| -> f64 {
                (0..is_soil.len())
                    .filter(|&t| is_soil[t] == soil)
                    .map(|t| solution.triangles[t * bands + b].absorbed_W)
                    .sum()
            };
            let plane: f64 = solution.soil.as_ref().map_or(0.0, |map| {
                let cell = map.cell_m.x * map.cell_m.y;
                (0..map.nx * map.ny)
                    .map(|c| cell * map.irradiance_W_m2[c * bands + b].value)
                    .sum::<f64>()
                    * (1.0 - band.soil_albedo)
            });
            let (plants, soil) = (of(false), of(true) + plane);
            let [up, down] = match scattering.iter().position(|&s| s == b) {
                Some(k) => escaped(problem, world, irradiance, outlook, band, k),
                None => [0.0, 0.0],
            };
            let (incoming, down) = (direct.incoming_W[b], down + direct.passed_W[b]);
            Balance {
                band: band.name.clone(),
                incoming_W: incoming,
                absorbed_plants_W: value(plants),
                absorbed_soil_W: value(soil),
                escaped_up_W: value(up),
                escaped_down_W: value(down),
                closure_W: value(incoming - plants - soil - up - down),
            }
        })
        .collect()
}

/// Scattered power that leaves the scene upwards and downwards, W.
fn escaped(
    problem: &Problem,
    world: &World,
    irradiance: &Irradiance,
    outlook: &Outlook,
    band: &nestrad_common::optics::Band,
    k: usize,
) -> [f64; 2] {
    let mut sum = [0.0; 2];
    let mut add = |row: usize, radiosity: f64| {
        let power = radiosity * world.row_area_m2(row as u32) * outlook.exposed[row];
        sum[0] += power * outlook.to_sky[row];
        sum[1] += power * outlook.to_void[row];
    };
    for e in 0..world.elements.len() {
        let m = problem.scene.material[world.triangle_of_element[e] as usize] as usize;
        let optics = band.materials[m];
        let (eu, el) = (irradiance.mean(2 * e, k), irradiance.mean(2 * e + 1, k));
        add(2 * e, optics.upper.rho * eu + optics.lower.tau * el);
        add(2 * e + 1, optics.lower.rho * el + optics.upper.tau * eu);
    }
    for row in world.ends.faces() as usize..world.rows() {
        add(row, band.soil_albedo * irradiance.mean(row, k));
    }
    sum
}

//! How much the directions that stand for a sky matter: what every other one of them says, against the rest.

use nestrad_common::problem::Problem;

use super::{Direct, GROUPS};
use crate::world::World;

/// What halves of a sky make organs absorb, W, each as if it were all of it; `parts` are those of the groups of
/// sources.
///
/// The directions of a sky lie on a spiral (`light::sky`), every other one of which is a spiral again.
pub(super) fn halves_W(problem: &Problem, world: &World, parts: &[Direct]) -> [Vec<f64>; 2] {
    let sky = problem.sky_directions;
    if sky < 2 {
        return Default::default();
    }
    let groups = &parts[..GROUPS.min(sky)];
    let bands = problem.bands.len();
    [0, 1].map(|half: usize| {
        let of_sky = |of: &mut dyn Iterator<Item = usize>, band: usize| -> f64 {
            of.map(|k| problem.sources[k].irradiance_W_m2[band]).sum()
        };
        let whole: Vec<f64> = (0..bands)
            .map(|b| {
                let own = of_sky(&mut (half..sky).step_by(2), b);
                if own > 0.0 {
                    of_sky(&mut (0..sky), b) / own
                } else {
                    0.0
                }
            })
            .collect();
        let mut absorbed_W = vec![0.0; problem.scene.organs.len() * bands];
        for part in groups.iter().skip(half).step_by(2) {
            for (e, &t) in world.triangle_of_element.iter().enumerate() {
                let organ = problem.scene.organ[t as usize] as usize;
                let material = problem.scene.material[t as usize] as usize;
                let area_m2 = world.elements.area_m2[e];
                for (b, band) in problem.bands.iter().enumerate() {
                    let optics = band.materials[material];
                    let on = |row: usize| part.irradiance_W_m2[row * bands + b];
                    absorbed_W[organ * bands + b] += whole[b]
                        * area_m2
                        * (optics.upper.absorptance() * on(2 * e)
                            + optics.lower.absorptance() * on(2 * e + 1));
                }
            }
        }
        absorbed_W
    })
}

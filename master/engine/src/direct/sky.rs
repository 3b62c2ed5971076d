//! How much the directions that stand for a sky matter: what every other one of them says, against the rest.

use nestrad_common::light::Sources;
use nestrad_common::optics::Optics;

use crate::frame::Frame;

/// What halves of a sky make organs absorb, W, each as if it were all of it, indexed `organ * bands + band`;
/// `parts_W_m2` are the irradiances that the groups of its directions bring, indexed `row * bands + band`.
///
/// The directions of a sky lie on a spiral (`light::sky`), every other one of which is a spiral again.
pub(super) fn halves_W(
    frame: &Frame,
    optics: &Optics,
    sources: &Sources,
    parts_W_m2: &[&[f64]],
) -> [Vec<f64>; 2] {
    let sky = sources.sky_directions;
    if sky < 2 {
        return Default::default();
    }
    let bands = optics.len();
    [0, 1].map(|half: usize| {
        let mut absorbed_W = vec![0.0; frame.organs * bands];
        for (b, band) in optics.bands.iter().enumerate() {
            let of_sky = |of: &mut dyn Iterator<Item = usize>| -> f64 {
                of.map(|k| sources.list[k].irradiance_W_m2[b]).sum()
            };
            let own = of_sky(&mut (half..sky).step_by(2));
            let whole = if own > 0.0 {
                of_sky(&mut (0..sky)) / own
            } else {
                0.0
            };
            let own_parts = parts_W_m2.iter().skip(half).step_by(2);
            // all parts of an element one after the other would be rounded otherwise
            let mut sums = vec![0.0; frame.organs];
            for part in own_parts {
                frame.add_by_organ(band, &mut sums, |e, optics| {
                    let on = |row: usize| part[row * bands + b];
                    [whole
                        * frame.area_m2[e]
                        * (optics.absorptance(true) * on(2 * e)
                            + optics.absorptance(false) * on(2 * e + 1))]
                });
            }
            for (organ, sum) in sums.into_iter().enumerate() {
                absorbed_W[organ * bands + b] = sum;
            }
        }
        absorbed_W
    })
}

//! Where in the canopy leaf area is and light is absorbed, and how much of the area the sources reach.

use serde::Serialize;

/// Classes of direct light, of equal width; the last is open.
pub const LIT_CLASSES: usize = 40;
/// Width of a class, as a part of the irradiance above the canopy.
pub const LIT_STEP: f64 = 0.025;

/// A piece of the canopy, of one height.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Patch {
    /// Height, metres.
    pub z_m: f64,
    /// One-sided area, m².
    pub area_m2: f64,
    /// Per band.
    pub light: Vec<PatchLight>,
}

/// The light of a patch in a band.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PatchLight {
    /// Absorbed by both faces, W per m² of one-sided area.
    pub absorbed_W_m2: f64,
    /// The part of it that came straight from the sources.
    pub direct_W_m2: f64,
    /// Irradiances of both faces, summed, W m⁻².
    pub irradiance_W_m2: f64,
}

impl PatchLight {
    /// Irradiance that came straight from the sources, both faces, W m⁻²: as large a part of the
    /// irradiance as of what is absorbed, which is exact where both faces absorb alike.
    pub fn direct_irradiance_W_m2(&self) -> f64 {
        if self.absorbed_W_m2 > 0.0 {
            self.irradiance_W_m2 * (self.direct_W_m2 / self.absorbed_W_m2).min(1.0)
        } else {
            0.0
        }
    }
}

/// What lies between two heights.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Layer {
    /// Lower end, metres.
    pub low_m: f64,
    /// Upper end, metres.
    pub high_m: f64,
    /// One-sided area, m².
    pub area_m2: f64,
    /// Per band, W.
    pub absorbed_W: Vec<f64>,
    /// Per band and class of direct irradiance, m².
    pub by_direct_m2: Vec<Vec<f64>>,
}

/// `count` layers of equal height over all patches. `above_W_m2` is the irradiance above the canopy, per
/// band. A patch belongs to one layer and to one class, whole.
pub fn layers(patches: &[Patch], above_W_m2: &[f64], count: usize) -> Vec<Layer> {
    let heights = patches.iter().map(|patch| patch.z_m);
    let low = heights.clone().fold(f64::INFINITY, f64::min);
    let high = heights.fold(f64::NEG_INFINITY, f64::max);
    if patches.is_empty() {
        return Vec::new();
    }
    let step = (high - low) / count as f64;
    let mut layers: Vec<Layer> = (0..count)
        .map(|k| Layer {
            low_m: low + k as f64 * step,
            high_m: low + (k + 1) as f64 * step,
            area_m2: 0.0,
            absorbed_W: vec![0.0; above_W_m2.len()],
            by_direct_m2: vec![vec![0.0; LIT_CLASSES]; above_W_m2.len()],
        })
        .collect();
    for patch in patches {
        // all at one height: a flat canopy has all in its first layer
        let layer = if step > 0.0 {
            (((patch.z_m - low) / step) as usize).min(count - 1)
        } else {
            0
        };
        let layer = &mut layers[layer];
        layer.area_m2 += patch.area_m2;
        for (band, light) in patch.light.iter().enumerate() {
            layer.absorbed_W[band] += light.absorbed_W_m2 * patch.area_m2;
            let class = class(light.direct_irradiance_W_m2(), above_W_m2[band]);
            layer.by_direct_m2[band][class] += patch.area_m2;
        }
    }
    layers
}

fn class(direct_W_m2: f64, above_W_m2: f64) -> usize {
    if above_W_m2 > 0.0 {
        ((direct_W_m2 / above_W_m2 / LIT_STEP) as usize).min(LIT_CLASSES - 1)
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn patch(z_m: f64, area_m2: f64, absorbed_W_m2: f64) -> Patch {
        let light = PatchLight {
            absorbed_W_m2,
            direct_W_m2: absorbed_W_m2 / 2.0,
            irradiance_W_m2: 2.0 * absorbed_W_m2,
        };
        Patch {
            z_m,
            area_m2,
            light: vec![light; 2],
        }
    }

    proptest! {
        #[test]
        fn layers_add_up_to_the_whole(
            parts in prop::collection::vec((-1.0..3.0, 0.0..0.1, 0.0..500.0), 1..100),
        ) {
            let patches: Vec<Patch> = parts.iter().map(|&(z, a, w)| patch(z, a, w)).collect();
            let layers = layers(&patches, &[400.0, 0.0], 20);
            let area: f64 = patches.iter().map(|p| p.area_m2).sum();
            let absorbed: f64 = patches.iter().map(|p| p.area_m2 * p.light[0].absorbed_W_m2).sum();
            prop_assert!((layers.iter().map(|l| l.area_m2).sum::<f64>() - area).abs() < 1e-9);
            for band in 0..2 {
                let sum: f64 = layers.iter().map(|l| l.absorbed_W[band]).sum();
                prop_assert!((sum - absorbed).abs() < 1e-9 * absorbed.max(1.0));
                let classes: f64 = layers.iter().flat_map(|l| &l.by_direct_m2[band]).sum();
                prop_assert!((classes - area).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_flat_canopy_is_one_layer() {
        let layers = layers(
            &[patch(1.0, 2.0, 3.0), patch(1.0, 1.0, 0.0)],
            &[3.0, 3.0],
            4,
        );
        assert_eq!(layers[0].area_m2, 3.0);
        assert_eq!(layers[0].absorbed_W, [6.0, 6.0]);
        // 3 of 3 W m-2 is direct: the open class; nothing at all: the first
        assert_eq!(layers[0].by_direct_m2[0][LIT_CLASSES - 1], 2.0);
        assert_eq!(layers[0].by_direct_m2[0][0], 1.0);
        assert!(super::layers(&[], &[1.0], 4).is_empty());
    }
}

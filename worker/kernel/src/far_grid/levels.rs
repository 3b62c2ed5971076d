//! Levels and polar bins: the far field of a canopy of horizontal layers.

use super::{FarGrid, InLayers, Passage};

/// Levels evenly spaced from the bottom to the top of the scene, each with bins uniform in the cosine of the
/// zenith angle.
///
/// Level l of bin b is end `b * levels + l`, the bins of light that comes down first (0 is nearest to the
/// horizontal), then those of light that comes up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Levels {
    /// Number of levels, 2 to 65536.
    pub levels: u32,
    /// Bins per hemisphere, 1 to 64.
    pub bins: u32,
}

/// Most levels and bins that a block may have.
const MOST_LEVELS: u32 = 1 << 16;
const MOST_BINS: u32 = 64;

impl Levels {
    /// A grid, if it is not too fine.
    pub fn new(levels: u32, bins: u32) -> Option<Self> {
        let proper = (1..=MOST_LEVELS).contains(&levels) && (1..=MOST_BINS).contains(&bins);
        proper.then_some(Self { levels, bins })
    }
}

impl FarGrid for Levels {
    fn len(&self) -> u32 {
        2 * self.bins * self.levels
    }

    /// One of the two levels around the point, at random with the weights of linear interpolation: so the mean
    /// over lines is the interpolated value, and every end keeps the same weight.
    fn end_at(&self, passage: &Passage<'_>) -> u32 {
        let last = self.levels - 1;
        let level = ((passage.height * f64::from(last) + passage.random) as u32).min(last);
        let bin = ((passage.direction_z.abs() * f64::from(self.bins)) as u32).min(self.bins - 1);
        let way = if passage.direction_z < 0.0 {
            self.bins
        } else {
            0
        };
        (way + bin) * self.levels + level
    }

    fn layers(&self) -> [u32; 2] {
        [self.levels, self.bins]
    }

    fn in_layers(&self, end: u32) -> InLayers {
        let bin = end / self.levels;
        InLayers {
            from_above: bin < self.bins,
            level: end % self.levels,
            bin: bin % self.bins,
        }
    }

    fn as_levels(&self) -> Option<Levels> {
        Some(*self)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    #[test]
    fn every_place_in_the_layers_has_an_end_of_its_own() {
        let grid = Levels { levels: 5, bins: 3 };
        for end in 0..grid.len() {
            let at = grid.in_layers(end);
            let cosine = (f64::from(at.bin) + 0.5) / 3.0;
            let passage = Passage {
                height: f64::from(at.level) / 4.0,
                at_m: &|| DVec2::ZERO,
                direction_z: if at.from_above { cosine } else { -cosine },
                random: 0.0,
            };
            assert_eq!(grid.end_at(&passage), end);
        }
    }

    #[test]
    fn points_between_levels_are_dealt_out_to_both() {
        let grid = Levels { levels: 3, bins: 1 };
        let level = |height: f64, random: f64| {
            grid.end_at(&Passage {
                height,
                at_m: &|| DVec2::ZERO,
                direction_z: 0.3,
                random,
            })
        };
        // a quarter of the way from level 0 to level 1
        let upper = (0..100).filter(|k| level(0.125, f64::from(*k) / 100.0) == 1);
        assert_eq!(upper.count(), 25);
        assert_eq!(level(1.0, 0.999), 2);
    }
}

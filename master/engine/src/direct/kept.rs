//! Directions that are kept: light that comes from there again is not projected again.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use glam::DVec3;
use nestrad_kernel::Tracer;

use super::lit_areas::LitAreas;
use super::projection::Projection;

/// What directions light, of one frame; of bounded size. What is kept changes no result.
#[derive(Default)]
pub struct KeptDirections {
    most_bytes: u64,
    kept: Mutex<Kept>,
    /// The scene as rays see it, once one was cast.
    tracer: OnceLock<Tracer>,
}

#[derive(Debug, Default)]
struct Kept {
    /// Number of the light.
    light: u64,
    bytes: u64,
    directions: HashMap<Key, Direction>,
    /// Organs that are too small for a lattice, by direction and cross-section of its lines.
    thin: HashMap<([u64; 3], u64), usize>,
}

/// All that decides what a direction lights, in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    /// Number of the source, which its random numbers go with.
    number: usize,
    towards: [u64; 3],
    line_area: u64,
    seed: u64,
    /// Small organs are probed with rays.
    probed: bool,
}

#[derive(Debug)]
struct Direction {
    lit: Arc<LitAreas>,
    /// The last light that came from there.
    light: u64,
}

/// Counts of small organs are forgotten when there are more of them.
const MOST_COUNTS: usize = 1 << 16;

impl KeptDirections {
    /// Keeps so many bytes at most.
    pub fn within(most_bytes: u64) -> Self {
        Self {
            most_bytes,
            ..Self::default()
        }
    }

    /// Bytes that are kept.
    pub fn bytes(&self) -> u64 {
        self.lock().bytes + self.tracer.get().map_or(0, Tracer::bytes)
    }

    /// What rays are cast in, if that is to stay.
    pub(super) fn tracer(&self) -> Option<&OnceLock<Tracer>> {
        (self.most_bytes > 0).then_some(&self.tracer)
    }

    /// Another light begins.
    pub(super) fn next_light(&self) {
        self.lock().light += 1;
    }

    /// What a direction lights: kept, or found.
    pub(super) fn lit_areas(
        &self,
        projection: &Projection,
        seed: u64,
        probed: bool,
        find: impl FnOnce() -> LitAreas,
    ) -> Arc<LitAreas> {
        if self.most_bytes == 0 {
            return Arc::new(find());
        }
        let key = Key {
            number: projection.k,
            towards: bits(projection.towards),
            line_area: projection.line_area_m2.to_bits(),
            seed,
            probed,
        };
        {
            let mut kept = self.lock();
            let light = kept.light;
            if let Some(direction) = kept.directions.get_mut(&key) {
                direction.light = light;
                return direction.lit.clone();
            }
        }
        let mut lit = find();
        lit.shrink();
        let lit = Arc::new(lit);
        self.lock().put(key, lit.clone(), self.most_bytes);
        lit
    }

    /// How many organs are too small for a lattice of such lines: known, or found.
    pub(super) fn thin(
        &self,
        towards: DVec3,
        line_area_m2: f64,
        find: impl FnOnce() -> usize,
    ) -> usize {
        let key = (bits(towards), line_area_m2.to_bits());
        if let Some(&known) = self.lock().thin.get(&key) {
            return known;
        }
        let found = find();
        if self.most_bytes > 0 {
            let thin = &mut self.lock().thin;
            if thin.len() >= MOST_COUNTS {
                thin.clear();
            }
            thin.insert(key, found);
        }
        found
    }

    fn lock(&self) -> MutexGuard<'_, Kept> {
        // what is behind the lock is whole at any time
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Kept {
    /// Keeps a direction where there is room, or where there is once those have gone that neither this light nor the
    /// one before came from: where all of them do not fit, it is always the same ones that stay.
    fn put(&mut self, key: Key, lit: Arc<LitAreas>, most_bytes: u64) {
        let bytes = lit.bytes();
        if self.bytes + bytes > most_bytes {
            let light = self.light;
            let mut gone = 0;
            self.directions.retain(|_, direction| {
                let stays = direction.light + 1 >= light;
                gone += if stays { 0 } else { direction.lit.bytes() };
                stays
            });
            self.bytes -= gone;
        }
        if self.bytes + bytes > most_bytes {
            return;
        }
        let light = self.light;
        if let Entry::Vacant(place) = self.directions.entry(key) {
            place.insert(Direction { lit, light });
            self.bytes += bytes;
        }
    }
}

fn bits(direction: DVec3) -> [u64; 3] {
    direction.to_array().map(f64::to_bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn from(kept: &KeptDirections, number: usize) -> bool {
        let projection = Projection {
            k: number,
            towards: DVec3::Z,
            line_area_m2: 1.0,
            random: [0.0; 4],
        };
        let mut found = false;
        kept.lit_areas(&projection, 1, false, || {
            found = true;
            LitAreas::default()
        });
        found
    }

    #[test]
    fn a_direction_is_projected_once() {
        let kept = KeptDirections::within(1 << 20);
        assert!(from(&kept, 0) && from(&kept, 1) && !from(&kept, 0));
        assert_eq!(kept.bytes(), 2 * LitAreas::default().bytes());
    }

    #[test]
    fn what_does_not_fit_pushes_out_only_what_is_old() {
        let one = LitAreas::default().bytes();
        let kept = KeptDirections::within(2 * one);
        kept.next_light();
        // the third does not fit, in any light
        for _ in 0..3 {
            kept.next_light();
            (0..3).for_each(|number| {
                from(&kept, number);
            });
            assert!(!from(&kept, 0) && !from(&kept, 1) && from(&kept, 2));
            assert_eq!(kept.bytes(), 2 * one);
        }
        // a light from elsewhere, twice: what neither of them came from goes
        for _ in 0..2 {
            kept.next_light();
            from(&kept, 3);
        }
        kept.next_light();
        assert!(!from(&kept, 3) && from(&kept, 0));
    }

    #[test]
    fn without_room_nothing_is_kept() {
        let kept = KeptDirections::default();
        assert!(from(&kept, 0) && from(&kept, 0));
        assert_eq!(kept.bytes(), 0);
    }
}

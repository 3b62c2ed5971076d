//! Canopies that stay traced from one solve to the next: another light, or other optics, trace nothing.
//!
//! They save time and change no result: a canopy is used again only for the plan that it was traced by.

use std::fmt;
use std::sync::Mutex;

use nestrad_engine::plan::Settings;
use nestrad_engine::resident::Resident;

use super::identity::Id;
use super::lock::lock;

/// Canopies of bounded size, the longest unused of which makes room for others.
pub(super) struct Residents {
    most_bytes: u64,
    known: Mutex<Known>,
}

#[derive(Default)]
struct Known {
    /// The longest unused first. What a solve uses is not among them.
    held: Vec<Held>,
    /// Workers that have returned wrong rows so far.
    untrusted: usize,
}

struct Held {
    geometry: Id,
    settings: Settings,
    resident: Resident,
}

/// A canopy that a solve uses, and what is needed to give it back.
pub(super) struct Used {
    pub(super) resident: Resident,
    geometry: Id,
    settings: Settings,
    untrusted: usize,
}

impl fmt::Debug for Residents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, bytes) = self.count_and_bytes();
        write!(
            f,
            "Residents({count}, {bytes} of {} bytes)",
            self.most_bytes
        )
    }
}

impl Residents {
    pub(super) fn new(most_bytes: u64) -> Self {
        Self {
            most_bytes,
            known: Mutex::default(),
        }
    }

    /// The canopy of a geometry as it was traced for such settings, or room for it. So many workers have returned
    /// wrong rows so far: what was traced before the last of them was found may be wrong.
    pub(super) fn take(&self, geometry: Id, settings: &Settings, untrusted: usize) -> Used {
        let mut known = lock(&self.known);
        known.distrust(untrusted);
        let is_it = |held: &Held| held.geometry == geometry && held.settings == *settings;
        let found = known.held.iter().position(is_it);
        let resident = match found {
            Some(k) => known.held.remove(k).resident,
            None => Resident::within(self.most_bytes),
        };
        Used {
            resident,
            geometry,
            settings: *settings,
            untrusted,
        }
    }

    /// Keeps it for the next solve, if there is room, and no worker was found to be wrong meanwhile.
    pub(super) fn give_back(&self, used: Used, untrusted: usize) {
        let mut known = lock(&self.known);
        known.distrust(untrusted);
        if used.untrusted != known.untrusted || used.resident.bytes() == 0 {
            return;
        }
        let held = Held {
            geometry: used.geometry,
            settings: used.settings,
            resident: used.resident,
        };
        known.held.push(held);
        let mut bytes = known.bytes();
        while bytes > self.most_bytes && !known.held.is_empty() {
            bytes -= known.held.remove(0).resident.bytes();
        }
    }

    /// How many there are, and the bytes that they take.
    pub(super) fn count_and_bytes(&self) -> (usize, u64) {
        let known = lock(&self.known);
        (known.held.len(), known.bytes())
    }
}

impl Known {
    fn distrust(&mut self, untrusted: usize) {
        if untrusted > self.untrusted {
            self.untrusted = untrusted;
            self.held.clear();
        }
    }

    fn bytes(&self) -> u64 {
        self.held.iter().map(|held| held.resident.bytes()).sum()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;
    use nestrad_common::canopy::{Canopy, Material, Mesh, Organ, Triangle};
    use nestrad_common::light::{Light, Source};
    use nestrad_common::optics::{Band, LeafOptics, Optics};
    use nestrad_common::scene::Scene;
    use nestrad_engine::exchange::ThisProcess;
    use nestrad_engine::progress::Progress;
    use nestrad_engine::rounds::light_in_rounds;
    use nestrad_engine::run::Run;
    use nestrad_engine::stop::Stop;
    use nestrad_engine::stopwatch::Stopwatch;

    use super::super::identity::solve_id;
    use super::*;

    /// A leaf over soil.
    fn leaf() -> Scene {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let triangle = Triangle {
            corners_m: corners.map(|p| 0.1 * p + 0.1 * DVec3::Z),
            organ: 0,
            material: 0,
        };
        let mut canopy = Canopy::of_meshes(vec![Mesh::from_iter([triangle])]);
        canopy.organs = vec![Organ::default()];
        canopy.materials = vec![Material::Leaf { species: 1 }];
        canopy.soil_z_m = Some(0.0);
        let band = Band {
            name: "PAR".to_owned(),
            soil_albedo: 0.2,
            materials: vec![LeafOptics::symmetric(0.1, 0.1)],
        };
        let sun = Source {
            direction: -DVec3::Z,
            irradiance_W_m2: vec![100.0],
        };
        Scene {
            sensors: Arc::default(),
            canopy: Arc::new(canopy),
            optics: Arc::new(Optics { bands: vec![band] }),
            light: Arc::new(Light {
                suns: vec![sun],
                sky: None,
            }),
        }
    }

    fn id(scene: u64) -> Id {
        solve_id(0, scene)
    }

    /// Solves a leaf under this name; whether it had to be traced. So many workers are known to be wrong before and after.
    fn traces(residents: &Residents, scene: u64, untrusted: [usize; 2]) -> bool {
        let settings = Settings::default();
        let mut used = residents.take(id(scene), &settings, untrusted[0]);
        let run = Run {
            stop: &Stop::default(),
            progress: &Progress::default(),
        };
        let (lit, rows) = (leaf(), ThisProcess::default());
        let with = (&lit, &mut used.resident);
        let watch = &mut Stopwatch::start();
        let solved = light_in_rounds(with, &settings, &rows, &run, watch, |_, _| {});
        residents.give_back(used, untrusted[1]);
        solved.unwrap().work.jobs.traced > 0
    }

    #[test]
    fn the_longest_unused_makes_room() {
        // no room for directions of light
        let one = Residents::new(1 << 23);
        assert!(traces(&one, 1, [0, 0]));
        let (count, bytes) = one.count_and_bytes();
        assert!(count == 1 && bytes > 1000, "{count} {bytes}");
        // room for two
        let two = Residents::new(5 * bytes / 2);
        for (scene, traced) in [
            (1, true),
            (2, true),
            (1, false),
            (3, true),
            (1, false),
            (2, true),
        ] {
            assert_eq!(traces(&two, scene, [0, 0]), traced, "{scene}");
            let (count, all) = two.count_and_bytes();
            assert!(count <= 2 && all <= 5 * bytes / 2);
        }
        let none = Residents::new(0);
        assert!(traces(&none, 1, [0, 0]) && traces(&none, 1, [0, 0]));
        assert_eq!(none.count_and_bytes(), (0, 0));
    }

    #[test]
    fn what_a_wrong_worker_may_have_traced_is_forgotten() {
        let all = Residents::new(u64::MAX);
        assert!(traces(&all, 1, [0, 0]));
        assert!(!traces(&all, 1, [0, 0]));
        // found between two solves
        assert!(traces(&all, 1, [1, 1]));
        assert!(!traces(&all, 1, [1, 1]));
        // found during a solve: what that used is not kept either
        assert!(traces(&all, 2, [1, 2]));
        assert!(traces(&all, 1, [2, 2]));
        assert!(traces(&all, 2, [2, 2]));
        assert!(!traces(&all, 2, [2, 2]));
    }
}

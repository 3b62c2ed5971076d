//! The scenes that the master holds: geometries, and what light falls on them. Of bounded size; what
//! was not used for longest goes first.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use nestrad_common::scene::Scene;

use super::budget::{Budget, Reservation};
use super::error::{ErrorCode, ServiceError};
use super::held::{HeldCanopy, Lighting};
use super::identity::{Id, scene_id};
use super::intake::Surface;

/// Scenes that are held at a time, however small.
const MAX_SCENES: usize = 1024;

/// What a scene takes besides its numbers, bytes.
const SCENE_BYTES: u64 = 1024;

/// What is held, and the memory that it is counted with.
#[derive(Debug)]
struct Counted<T> {
    item: T,
    _memory: Reservation,
}

/// A scene that can be solved.
#[derive(Clone, Debug)]
pub(super) struct HeldScene {
    pub(super) id: Id,
    geometry: Arc<Counted<HeldCanopy>>,
    lighting: Arc<Counted<Lighting>>,
}

impl HeldScene {
    pub(super) fn geometry(&self) -> &HeldCanopy {
        &self.geometry.item
    }

    pub(super) fn lighting(&self) -> &Lighting {
        &self.lighting.item
    }

    /// The scene, of which nothing is copied.
    pub(super) fn scene(&self) -> Scene {
        Scene {
            canopy: self.geometry().canopy.clone(),
            optics: self.lighting().optics.clone(),
            light: self.lighting().light.clone(),
        }
    }
}

/// All that is held.
#[derive(Debug)]
pub(super) struct Scenes {
    budget: Budget,
    held: Mutex<Held>,
}

#[derive(Debug, Default)]
struct Held {
    /// Goes up with every use.
    clock: u64,
    geometries: HashMap<Id, Used<Arc<Counted<HeldCanopy>>>>,
    scenes: HashMap<Id, Used<HeldScene>>,
}

#[derive(Debug)]
struct Used<T> {
    item: T,
    at: u64,
}

impl Scenes {
    pub(super) fn new(limit_bytes: u64) -> Self {
        Self {
            budget: Budget::new(limit_bytes),
            held: Mutex::default(),
        }
    }

    /// Makes room for something that is about to come. What others still work with cannot be thrown out.
    pub(super) fn reserve(&self, bytes: u64) -> Result<Reservation, ServiceError> {
        let mut held = self.lock();
        loop {
            if let Some(reservation) = self.budget.take(bytes) {
                return Ok(reservation);
            }
            // what could never fit must not drive out the others
            if bytes > self.budget.limit() || !held.evict() {
                let (limit, used) = (self.budget.limit(), self.budget.used());
                let message = format!(
                    "the scene takes {bytes} bytes: the master holds {limit} bytes of scenes at most, \
                     of which {used} are in use"
                );
                return Err(ServiceError::new(ErrorCode::Exhausted, message));
            }
        }
    }

    /// Keeps a geometry; the one that is there already if it is the same.
    pub(super) fn keep_geometry(&self, geometry: HeldCanopy, memory: Reservation) {
        let mut held = self.lock();
        let at = held.tick();
        held.geometries
            .entry(geometry.id)
            .and_modify(|known| known.at = at)
            .or_insert_with(|| Used {
                item: Arc::new(Counted {
                    item: geometry,
                    _memory: memory,
                }),
                at,
            });
    }

    /// What a geometry that is held is made of.
    pub(super) fn surfaces(&self, id: Id) -> Result<Vec<Surface>, ServiceError> {
        let geometry = self.lock().geometry(id)?;
        Ok(Surface::of(&geometry.item.canopy))
    }

    /// Keeps a scene of a geometry that is held.
    pub(super) fn keep_scene(
        &self,
        geometry: Id,
        lighting: Lighting,
    ) -> Result<HeldScene, ServiceError> {
        let memory = self.reserve(SCENE_BYTES + lighting.bytes())?;
        let mut held = self.lock();
        let scene = HeldScene {
            id: scene_id(geometry, &lighting.optics, &lighting.light),
            geometry: held.geometry(geometry)?,
            lighting: Arc::new(Counted {
                item: lighting,
                _memory: memory,
            }),
        };
        while held.scenes.len() >= MAX_SCENES && !held.scenes.contains_key(&scene.id) {
            held.evict_scene();
        }
        let at = held.tick();
        let known = held
            .scenes
            .entry(scene.id)
            .or_insert(Used { item: scene, at });
        known.at = at;
        Ok(known.item.clone())
    }

    /// A scene that was uploaded.
    pub(super) fn scene(&self, id: Id) -> Result<HeldScene, ServiceError> {
        let mut held = self.lock();
        let at = held.tick();
        let Some(known) = held.scenes.get_mut(&id) else {
            return Err(not_held("scene", id));
        };
        known.at = at;
        let scene = known.item.clone();
        held.geometry(scene.geometry().id)?;
        Ok(scene)
    }

    /// How many scenes there are.
    pub(super) fn count(&self) -> usize {
        self.lock().scenes.len()
    }

    /// Bytes that are taken, in use or not.
    pub(super) fn bytes(&self) -> u64 {
        self.budget.used()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Held> {
        // the maps are whole at any time, even if a thread died with the lock
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Held {
    fn tick(&mut self) -> u64 {
        self.clock += 1;
        self.clock
    }

    fn geometry(&mut self, id: Id) -> Result<Arc<Counted<HeldCanopy>>, ServiceError> {
        let at = self.tick();
        let Some(known) = self.geometries.get_mut(&id) else {
            return Err(not_held("geometry", id));
        };
        known.at = at;
        Ok(known.item.clone())
    }

    /// Throws out the geometry that was not used for longest, with its scenes, or else a scene. False
    /// if there is nothing left.
    fn evict(&mut self) -> bool {
        let oldest = self.geometries.iter().min_by_key(|(_, used)| used.at);
        let Some((&id, _)) = oldest else {
            return self.evict_scene();
        };
        self.geometries.remove(&id);
        self.scenes.retain(|_, used| used.item.geometry().id != id);
        true
    }

    fn evict_scene(&mut self) -> bool {
        let oldest = self.scenes.iter().min_by_key(|(_, used)| used.at);
        let oldest = oldest.map(|(&id, _)| id);
        oldest.is_some_and(|id| self.scenes.remove(&id).is_some())
    }
}

fn not_held(what: &str, id: Id) -> ServiceError {
    let message = format!("the master does not hold {what} {id} (any more): upload it again");
    ServiceError::new(ErrorCode::NotFound, message)
}

#[cfg(test)]
mod tests {
    use nestrad_common::inspection::Inspection;

    use super::*;

    fn geometry(number: u64) -> HeldCanopy {
        HeldCanopy {
            id: super::super::identity::solve_id(0, number),
            canopy: Arc::default(),
            inspection: Inspection::default(),
        }
    }

    fn keep(scenes: &Scenes, number: u64, bytes: u64) -> Result<HeldScene, ServiceError> {
        let geometry = geometry(number);
        let id = geometry.id;
        scenes.keep_geometry(geometry, scenes.reserve(bytes)?);
        let lighting = Lighting {
            optics: Arc::default(),
            light: Arc::default(),
        };
        scenes.keep_scene(id, lighting)
    }

    #[test]
    fn what_was_not_used_for_longest_goes_first() {
        let scenes = Scenes::new(30_000);
        let [a, b] = [1, 2].map(|k| keep(&scenes, k, 10_000).unwrap().id);
        scenes.scene(a).unwrap();
        let c = keep(&scenes, 3, 10_000).unwrap().id;
        assert!(scenes.scene(a).is_ok() && scenes.scene(c).is_ok());
        assert_eq!(scenes.scene(b).unwrap_err().code, ErrorCode::NotFound);
        assert_eq!(
            (scenes.count(), scenes.bytes()),
            (2, 2 * (10_000 + SCENE_BYTES))
        );
    }

    #[test]
    fn what_is_in_use_counts_until_it_is_not() {
        let scenes = Scenes::new(30_000);
        let used = keep(&scenes, 1, 20_000).unwrap();
        let refused = keep(&scenes, 2, 20_000).unwrap_err();
        assert_eq!(refused.code, ErrorCode::Exhausted);
        assert!(refused.message.contains("30000 bytes"), "{refused}");
        drop(used);
        assert!(keep(&scenes, 2, 20_000).is_ok());
    }

    #[test]
    fn what_could_never_fit_drives_nothing_out() {
        let scenes = Scenes::new(30_000);
        let id = keep(&scenes, 1, 20_000).unwrap().id;
        assert!(scenes.reserve(30_001).is_err());
        assert!(scenes.scene(id).is_ok());
    }

    #[test]
    fn the_same_content_is_held_once() {
        let scenes = Scenes::new(30_000);
        let first = keep(&scenes, 1, 10_000).unwrap();
        let again = keep(&scenes, 1, 10_000).unwrap();
        assert_eq!(first.id, again.id);
        assert_eq!((scenes.count(), scenes.bytes()), (1, 10_000 + SCENE_BYTES));
    }
}

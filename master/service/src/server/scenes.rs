//! The scenes that the master holds: geometries, and what light falls on them. Of bounded size: where there is no
//! room, the client that has the most gives some, of which what was not used for longest goes first.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use nestrad_common::scene::Scene;
use nestrad_common::sensors::Sensor;

use super::budget::{Budget, Reservation};
use super::caller::Caller;
use super::error::{ErrorCode, ServiceError};
use super::held::{HeldCanopy, Lighting};
use super::identity::{Id, scene_id};
use super::intake::Surface;
use super::lock::lock;

/// Scenes that are held at a time, however small.
const MAX_SCENES: usize = 1024;

/// What a scene takes besides its numbers, bytes.
const SCENE_BYTES: u64 = 1024;

/// Who waits for scenes that others work with asks again after this.
const AGAIN: Duration = Duration::from_secs(10);

/// What is held, and the memory that it is counted with.
#[derive(Debug)]
struct Counted<T> {
    item: T,
    memory: Reservation,
}

/// A scene that can be solved.
#[derive(Clone, Debug)]
pub(super) struct HeldScene {
    pub(super) id: Id,
    geometry: Arc<Counted<HeldCanopy>>,
    lighting: Arc<Counted<Lighting>>,
    /// Of one solve.
    sensors: Arc<[Sensor]>,
}

impl HeldScene {
    pub(super) fn geometry(&self) -> &HeldCanopy {
        &self.geometry.item
    }

    pub(super) fn geometry_bytes(&self) -> u64 {
        self.geometry.memory.bytes()
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
            sensors: self.sensors.clone(),
        }
    }

    pub(super) fn sensors(&self) -> &[Sensor] {
        &self.sensors
    }

    /// The same with sensors.
    pub(super) fn with(self, sensors: Arc<[Sensor]>) -> Self {
        Self { sensors, ..self }
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

    /// Refuses what could never fit.
    pub(super) fn could_hold(&self, bytes: u64) -> Result<(), ServiceError> {
        if bytes <= self.budget.limit() {
            return Ok(());
        }
        Err(ServiceError::new(ErrorCode::Exhausted, self.no_room(bytes)))
    }

    /// Makes room for something that has come. What others still work with cannot be thrown out, nor what is of
    /// clients that have less.
    pub(super) fn reserve(&self, caller: Caller, bytes: u64) -> Result<Reservation, ServiceError> {
        self.could_hold(bytes)?;
        let mut held = self.lock();
        loop {
            if let Some(reservation) = self.budget.take(caller, bytes) {
                return Ok(reservation);
            }
            let has = |other: Caller| match self.budget.used_by(other) {
                own if other == caller => own + bytes,
                others => others,
            };
            if !held.evict(caller, has) {
                let error = ServiceError::new(ErrorCode::Exhausted, self.no_room(bytes));
                return Err(error.again_after(AGAIN));
            }
        }
    }

    fn no_room(&self, bytes: u64) -> String {
        let (limit, used) = (self.budget.limit(), self.budget.used());
        format!(
            "the scene takes {bytes} bytes: the master holds {limit} bytes of scenes at most, of which {used} are taken"
        )
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
                    memory,
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
        caller: Caller,
        geometry: Id,
        lighting: Lighting,
    ) -> Result<HeldScene, ServiceError> {
        let memory = self.reserve(caller, SCENE_BYTES + lighting.bytes())?;
        let mut held = self.lock();
        let scene = HeldScene {
            id: scene_id(geometry, &lighting.optics, &lighting.light),
            geometry: held.geometry(geometry)?,
            lighting: Arc::new(Counted {
                item: lighting,
                memory,
            }),
            sensors: Arc::default(),
        };
        while held.scenes.len() >= MAX_SCENES && !held.scenes.contains_key(&scene.id) {
            held.evict_one_of_many(caller);
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

    fn lock(&self) -> MutexGuard<'_, Held> {
        lock(&self.held)
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

    /// Throws something out for a client: of the one that has the most of what can go, and that is not less than the
    /// client itself then has. The geometry that was not used for longest goes first, with its scenes, or else a scene.
    /// False if nothing can go.
    fn evict(&mut self, caller: Caller, has: impl Fn(Caller) -> u64) -> bool {
        // others work with what is counted more often than here
        let mut own: HashMap<Id, usize> = HashMap::new();
        for used in self.scenes.values() {
            *own.entry(used.item.geometry().id).or_default() += 1;
        }
        let is_free = |id: &Id, geometry: &Arc<Counted<HeldCanopy>>| {
            Arc::strong_count(geometry) == 1 + own.get(id).copied().unwrap_or_default()
        };
        let geometries = self.geometries.iter();
        let geometries = geometries
            .filter(|(id, used)| is_free(id, &used.item))
            .map(|(&id, used)| (used.item.memory.caller(), used.at, id, true));
        let scenes = self.scenes.iter();
        let scenes = scenes
            .filter(|(_, used)| Arc::strong_count(&used.item.lighting) == 1)
            .map(|(&id, used)| (used.item.lighting.memory.caller(), used.at, id, false));
        let may_go = geometries
            .chain(scenes)
            .filter(|(of, ..)| has(*of) >= has(caller));
        let order = |&(of, at, _, is_geometry): &(Caller, u64, Id, bool)| {
            (has(of), of, is_geometry, std::cmp::Reverse(at))
        };
        let Some((_, _, id, is_geometry)) = may_go.max_by_key(order) else {
            return false;
        };
        if is_geometry {
            self.geometries.remove(&id);
            self.scenes.retain(|_, used| used.item.geometry().id != id);
        } else {
            self.scenes.remove(&id);
        }
        true
    }

    /// Throws out a scene of the client that has the most of them: where it has as many as others, of `caller`.
    fn evict_one_of_many(&mut self, caller: Caller) {
        let of = |used: &Used<HeldScene>| used.item.lighting.memory.caller();
        let mut count: HashMap<Caller, usize> = HashMap::from([(caller, 1)]);
        for used in self.scenes.values() {
            *count.entry(of(used)).or_default() += 1;
        }
        let order = |used: &Used<HeldScene>| {
            let of = of(used);
            (count.get(&of), of == caller, of, std::cmp::Reverse(used.at))
        };
        let most = self.scenes.iter().max_by_key(|(_, used)| order(used));
        let id = most.map(|(&id, _)| id);
        let Some(scene) = id.and_then(|id| self.scenes.remove(&id)) else {
            return;
        };
        let geometry = scene.item.geometry().id;
        let is_used = |used: &Used<HeldScene>| used.item.geometry().id == geometry;
        if !self.scenes.values().any(is_used) {
            self.geometries.remove(&geometry);
        }
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

    fn keep(
        scenes: &Scenes,
        caller: u8,
        number: u64,
        bytes: u64,
    ) -> Result<HeldScene, ServiceError> {
        let caller = Caller::number(caller);
        let geometry = geometry(number);
        let id = geometry.id;
        scenes.keep_geometry(geometry, scenes.reserve(caller, bytes)?);
        let lighting = Lighting {
            optics: Arc::default(),
            light: Arc::default(),
        };
        scenes.keep_scene(caller, id, lighting)
    }

    #[test]
    fn what_was_not_used_for_longest_goes_first() {
        let scenes = Scenes::new(30_000);
        let [a, b] = [1, 2].map(|k| keep(&scenes, 1, k, 10_000).unwrap().id);
        scenes.scene(a).unwrap();
        let c = keep(&scenes, 1, 3, 10_000).unwrap().id;
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
        let used = keep(&scenes, 1, 1, 20_000).unwrap();
        let refused = keep(&scenes, 1, 2, 20_000).unwrap_err();
        assert_eq!(refused.code, ErrorCode::Exhausted);
        assert!(refused.message.contains("30000 bytes"), "{refused}");
        assert_eq!(refused.again_after, Some(AGAIN));
        drop(used);
        assert!(keep(&scenes, 1, 2, 20_000).is_ok());
    }

    #[test]
    fn what_could_never_fit_drives_nothing_out() {
        let scenes = Scenes::new(30_000);
        let id = keep(&scenes, 1, 1, 20_000).unwrap().id;
        let refused = scenes.reserve(Caller::number(1), 30_001).unwrap_err();
        assert_eq!(refused.again_after, None);
        assert!(scenes.scene(id).is_ok());
    }

    #[test]
    fn the_same_content_is_held_once() {
        let scenes = Scenes::new(30_000);
        let first = keep(&scenes, 1, 1, 10_000).unwrap();
        let again = keep(&scenes, 1, 1, 10_000).unwrap();
        assert_eq!(first.id, again.id);
        assert_eq!((scenes.count(), scenes.bytes()), (1, 10_000 + SCENE_BYTES));
    }

    #[test]
    fn scenes_of_a_client_with_few_are_not_driven_out_by_one_with_many() {
        let scenes = Scenes::new(100_000);
        let small = keep(&scenes, 2, 0, 10_000).unwrap().id;
        let keeps = |k| keep(&scenes, 1, k, 10_000).is_ok();
        assert!((1..20).all(keeps));
        assert!(scenes.scene(small).is_ok());
        // not even where its own are all in use
        let used: Vec<_> = (20..40)
            .map_while(|k| keep(&scenes, 1, k, 10_000).ok())
            .collect();
        assert!(used.len() < 10);
        assert!(scenes.scene(small).is_ok());
        // and it gets its share from the one with many, once they are not
        drop(used);
        for k in 50..53 {
            keep(&scenes, 2, k, 10_000).unwrap();
        }
        assert!(scenes.scene(small).is_ok());
    }

    #[test]
    fn many_small_scenes_drive_out_none_of_others() {
        let scenes = Scenes::new(1 << 30);
        let other = keep(&scenes, 2, 0, 100).unwrap().id;
        for k in 1..2 * MAX_SCENES as u64 {
            keep(&scenes, 1, k, 100).unwrap();
        }
        assert_eq!(scenes.count(), MAX_SCENES);
        assert!(scenes.scene(other).is_ok());
    }
}

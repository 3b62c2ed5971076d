//! What came of a solve, as long as it is kept.

use nestrad_common::canopy::Organ;
use nestrad_common::sensors::Sensor;
use nestrad_engine::account::organ_spread;
use nestrad_engine::rounds::Solved;
use nestrad_engine::solution::{
    Estimate, ItemLight, MaterialLight, Reading, SensorLight, Solution,
};
use nestrad_engine::stopwatch::{Stage, Usage};
use nestrad_proto::v1;

use super::intake::sent;
use super::scenes::HeldScene;

/// Results, and all that is needed to give them out without the scene.
#[derive(Debug)]
pub(super) struct HeldSolution {
    pub(super) bands: Vec<String>,
    pub(super) organs: Vec<Organ>,
    /// Per triangle.
    pub(super) organ: Vec<u32>,
    /// What was subtracted from the coordinates that were uploaded.
    pub(super) origin_m: glam::DVec3,
    pub(super) solution: Solution,
    pub(super) summary: v1::SolveSummary,
}

impl HeldSolution {
    pub(super) fn new(
        scene: &HeldScene,
        solved: Solved,
        stages: &[Stage],
        usage: Usage,
    ) -> Result<Self, serde_json::Error> {
        let canopy = &scene.geometry().canopy;
        let plan_json = serde_json::to_string(&solved.plan_record())?;
        let Solved {
            solution,
            work,
            accuracy,
            ..
        } = solved;
        let errors = organ_spread(&canopy.plants(), &solution);
        let bands = solution.balance.iter().zip(errors);
        let bands = bands.map(|(balance, error)| v1::BandSummary {
            band: balance.band.clone(),
            incoming_w: balance.incoming_W,
            absorbed_plants_w: quantity(balance.absorbed_plants_W),
            absorbed_leaves_w: quantity(balance.absorbed_leaves_W),
            absorbed_stems_w: quantity(balance.absorbed_stems_W),
            absorbed_structures_w: quantity(balance.absorbed_structures_W),
            absorbed_soil_w: quantity(balance.absorbed_soil_W),
            escaped_up_w: quantity(balance.escaped_up_W),
            escaped_down_w: quantity(balance.escaped_down_W),
            closure_w: quantity(balance.closure_W),
            scattered_w: quantity(balance.scattered_W),
            organ_error_percent: error.rms_percent,
            materials: balance.materials.iter().map(material).collect(),
        });
        let summary = v1::SolveSummary {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            bands: bands.collect(),
            plan_json,
            elements: work.elements as u64,
            direct_lines: work.direct_lines,
            lines: work.exchange.lines,
            segments: work.exchange.segments,
            rays: work.exchange.rays,
            row_entries: work.exchange.row_entries,
            passes: work.passes,
            stages: stages.iter().map(cost).collect(),
            wall_s: usage.wall_s,
            cpu_s: usage.cpu_s,
            peak_memory_bytes: usage.peak_memory_bytes.unwrap_or(0),
            jobs_traced: work.jobs.traced,
            jobs_kept: work.jobs.kept,
            sources: work.sources as u64,
            fault: accuracy.failure.unwrap_or_default(),
        };
        Ok(Self {
            bands: scene
                .lighting()
                .optics
                .names()
                .into_iter()
                .map(str::to_owned)
                .collect(),
            organs: canopy.organs.clone(),
            organ: canopy.triangles().map(|t| t.organ).collect(),
            origin_m: canopy.origin_m,
            solution,
            summary,
        })
    }

    /// Bytes that the results of a scene take, but for its soil.
    pub(super) fn least_bytes(scene: &HeldScene) -> u64 {
        let canopy = &scene.geometry().canopy;
        let bands = scene.lighting().optics.len();
        let names: usize = canopy.organs.iter().map(name_bytes).sum();
        let readings = reading_bytes(scene.sensors().iter(), bands);
        bytes(canopy.len(), canopy.organs.len(), 0, bands) + names as u64 + readings
    }

    /// Bytes that these results take.
    pub(super) fn bytes(&self) -> u64 {
        let soil = self.solution.soil.as_ref();
        let cells = soil.map_or(0, |map| map.nx * map.ny);
        let names: usize = self.organs.iter().map(name_bytes).sum();
        let (triangles, organs) = (self.organ.len(), self.organs.len());
        let readings = self.solution.readings.iter().map(|reading| &reading.sensor);
        let readings = reading_bytes(readings, self.bands.len());
        bytes(triangles, organs, cells, self.bands.len()) + names as u64 + readings
    }
}

fn bytes(triangles: usize, organs: usize, cells: usize, bands: usize) -> u64 {
    let light = bands * size_of::<ItemLight>();
    let of_triangles = triangles * (light + 12);
    let of_organs = organs * (light + 8 * (bands + 3) + size_of::<Organ>());
    (of_triangles + of_organs + cells * bands * size_of::<Estimate>() + (4 << 10)) as u64
}

fn reading_bytes<'a>(sensors: impl Iterator<Item = &'a Sensor>, bands: usize) -> u64 {
    let of_bands = bands * size_of::<SensorLight>();
    let bytes = sensors.map(|sensor| size_of::<Reading>() + sensor.name.len() + of_bands);
    bytes.sum::<usize>() as u64
}

fn name_bytes(organ: &Organ) -> usize {
    organ.id.len() + organ.plant.len() + organ.species.len()
}

fn quantity(estimate: Estimate) -> Option<v1::Quantity> {
    Some(v1::Quantity {
        value: estimate.value,
        se: estimate.se,
    })
}

fn material(of: &MaterialLight) -> v1::MaterialLight {
    v1::MaterialLight {
        name: of.name.clone(),
        kind: sent(of.kind).into(),
        absorbed_w: quantity(of.absorbed_W),
    }
}

fn cost(stage: &Stage) -> v1::StageCost {
    v1::StageCost {
        name: stage.name.clone(),
        wall_s: stage.wall_s,
        cpu_s: stage.cpu_s,
    }
}

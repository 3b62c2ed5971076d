//! The geometry of a block: as a message, and for the kernel in this process.

use glam::DVec3;
use nestrad_common::scene::Scene;
use nestrad_proto::{mesh, v1};
use nestrad_worker::{Block, BlockFault};

use super::jobs::{BlockOf, world_message};
use crate::world::World;

/// The geometry of a block, as jobs carry it.
pub fn block_message(scene: &Scene, world: &World, block: &BlockOf) -> v1::Block {
    let corners = |triangle: [DVec3; 3]| triangle.map(|corner| corner.to_array());
    v1::Block {
        mesh: Some(mesh::pack(triangles(scene, block).map(corners))),
        ..frame(world, block)
    }
}

/// The block for the kernel in this process, where its triangles are at hand.
pub fn block_here(scene: &Scene, world: &World, block: &BlockOf) -> Result<Block, BlockFault> {
    Block::of_triangles(&frame(world, block), triangles(scene, block).collect())
}

/// The same as if the near field had no bound: the sun is farther away than any sphere.
pub(crate) fn unbounded_block_here(
    scene: &Scene,
    world: &World,
    block: &BlockOf,
) -> Result<Block, BlockFault> {
    let mut frame = frame(world, block);
    if let Some(world) = &mut frame.world {
        (world.sphere_radius_m, world.far_levels) = (f64::INFINITY, 0);
    }
    Block::of_triangles(&frame, triangles(scene, block).collect())
}

fn triangles(scene: &Scene, block: &BlockOf) -> impl ExactSizeIterator<Item = [DVec3; 3]> {
    let triangles = block.triangles.iter();
    triangles.map(|&(t, _)| scene.triangles[t as usize])
}

/// All of a block but its triangles.
fn frame(world: &World, block: &BlockOf) -> v1::Block {
    let mut runs: Vec<v1::TriangleRun> = Vec::new();
    let mut next_element = 0;
    for &(t, owned) in &block.triangles {
        let t = t as usize;
        let skipped_elements = world.elements.first[t] - next_element;
        next_element = world.elements.first[t + 1];
        let run = v1::TriangleRun {
            triangles: 1,
            skipped_elements,
            divisions: world.elements.divisions[t],
            owned,
            solid: world.solid[t],
        };
        match runs.last_mut() {
            Some(last) if continues(last, &run) => last.triangles += 1,
            _ => runs.push(run),
        }
    }
    v1::Block {
        world: Some(world_message(world)),
        mesh: None,
        runs,
        owned_soil: cell_runs(&block.soil_cells),
    }
}

/// Runs of cells whose numbers rise.
fn cell_runs(cells: &[u32]) -> Vec<v1::CellRun> {
    let mut next = 0;
    let runs = cells.chunk_by(|a, b| a + 1 == *b).map(|run| {
        let skipped_cells = run[0] - next;
        next = run[0] + run.len() as u32;
        v1::CellRun {
            cells: run.len() as u32,
            skipped_cells,
        }
    });
    runs.collect()
}

fn continues(last: &v1::TriangleRun, run: &v1::TriangleRun) -> bool {
    let alike = |r: &v1::TriangleRun| (r.divisions, r.owned, r.solid);
    run.skipped_elements == 0 && alike(last) == alike(run)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_that_follow_one_another_are_a_run() {
        let run = |skipped_cells, cells| v1::CellRun {
            cells,
            skipped_cells,
        };
        assert_eq!(cell_runs(&[]), []);
        assert_eq!(cell_runs(&[0, 1, 2]), [run(0, 3)]);
        let runs = [run(3, 2), run(2, 1), run(1, 2)];
        assert_eq!(cell_runs(&[3, 4, 7, 9, 10]), runs);
    }
}

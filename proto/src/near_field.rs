//! Blocks and batches as messages, and back to what the kernel takes: this is the one place where the two meet.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use nestrad_kernel::block::{BlockFrame, CellRun, TriangleRun};
use nestrad_kernel::far_grid::{Levels, SharedFarGrid};
use nestrad_kernel::job::{Batch, Lines, Rays};
use nestrad_kernel::lattice::{Extent, Soup};
use nestrad_kernel::part::Part;
use nestrad_kernel::soil::SoilGrid;
use nestrad_kernel::world::World;
use nestrad_kernel::{Block, BlockFault, Demand};
use thiserror::Error;

use crate::mesh::{self, MeshFault};
use crate::v1;

/// Why a block is refused.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum BlockMessageFault {
    /// A message that must be there is not.
    #[error("block without {0}")]
    Missing(&'static str),
    /// A far field that is no far field.
    #[error("block with far field out of range")]
    FarField,
    /// Its triangles cannot be unpacked.
    #[error(transparent)]
    Mesh(#[from] MeshFault),
    /// What it describes cannot be.
    #[error(transparent)]
    Block(#[from] BlockFault),
}

/// A far-field grid that no message can carry.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("this far-field grid cannot be sent to workers: expected levels and bins")]
pub struct UnknownGrid;

/// A block as it is sent; its triangles are those of its frame, in order.
pub fn block_message(
    frame: &BlockFrame,
    triangles: impl ExactSizeIterator<Item = [DVec3; 3]>,
) -> Result<v1::Block, UnknownGrid> {
    Ok(v1::Block {
        world: Some(world_message(&frame.world)?),
        mesh: Some(mesh::pack(triangles)),
        runs: frame.runs.iter().map(run_message).collect(),
        owned_soil: frame.owned_soil.iter().map(cells_message).collect(),
    })
}

fn world_message(world: &World) -> Result<v1::World, UnknownGrid> {
    let levels = match &world.far {
        Some(grid) => Some(grid.as_levels().ok_or(UnknownGrid)?),
        None => None,
    };
    Ok(v1::World {
        min_m: Some(vector(world.extent.min_m)),
        max_m: Some(vector(world.extent.max_m)),
        periodic: world.extent.periodic,
        elements: world.elements,
        soil: world.soil.map(|s| v1::SoilPlane {
            z_m: s.z_m,
            min_x_m: s.min_m.x,
            min_y_m: s.min_m.y,
            cell_x_m: s.cell_m.x,
            cell_y_m: s.cell_m.y,
            cells_x: s.cells[0],
            cells_y: s.cells[1],
        }),
        sphere_radius_m: world.radius_m,
        far_levels: levels.map_or(0, |grid| grid.levels),
        far_bins: levels.map_or(0, |grid| grid.bins),
    })
}

fn run_message(run: &TriangleRun) -> v1::TriangleRun {
    v1::TriangleRun {
        triangles: run.triangles,
        skipped_elements: run.skipped_elements,
        divisions: run.divisions,
        owned: run.owned,
        solid: run.solid,
    }
}

fn cells_message(run: &CellRun) -> v1::CellRun {
    v1::CellRun {
        cells: run.cells,
        skipped_cells: run.skipped_cells,
    }
}

/// A block that came; nothing in it is trusted, but for its sizes: see [`demand`].
pub fn block(message: &v1::Block) -> Result<Block, BlockMessageFault> {
    let mesh = message.mesh.as_ref();
    let mesh = mesh.ok_or(BlockMessageFault::Missing("mesh"))?;
    let frame = frame(message)?;
    let soup: Soup = mesh::unpack(mesh)?;
    Ok(Block::new(&frame, Arc::new(soup))?)
}

/// All of a block that came but its triangles.
fn frame(message: &v1::Block) -> Result<BlockFrame, BlockMessageFault> {
    let world = message.world.as_ref();
    let world = world.ok_or(BlockMessageFault::Missing("world"))?;
    let corner = |corner: &Option<v1::Vector>, name| {
        let corner = corner.as_ref().ok_or(BlockMessageFault::Missing(name))?;
        Ok::<_, BlockMessageFault>(DVec3::new(corner.x, corner.y, corner.z))
    };
    let far = match (world.far_levels, world.far_bins) {
        (0, _) => None,
        (levels, bins) => {
            let grid = Levels::new(levels, bins).ok_or(BlockMessageFault::FarField)?;
            Some(Arc::new(grid) as SharedFarGrid)
        }
    };
    Ok(BlockFrame {
        world: World {
            extent: Extent {
                min_m: corner(&world.min_m, "min_m")?,
                max_m: corner(&world.max_m, "max_m")?,
                periodic: world.periodic,
            },
            elements: world.elements,
            soil: world.soil.as_ref().map(soil),
            radius_m: world.sphere_radius_m,
            far,
        },
        runs: message.runs.iter().map(run).collect(),
        owned_soil: message.owned_soil.iter().map(cells).collect(),
    })
}

fn soil(plane: &v1::SoilPlane) -> SoilGrid {
    SoilGrid {
        z_m: plane.z_m,
        min_m: DVec2::new(plane.min_x_m, plane.min_y_m),
        cell_m: DVec2::new(plane.cell_x_m, plane.cell_y_m),
        cells: [plane.cells_x, plane.cells_y],
    }
}

fn run(run: &v1::TriangleRun) -> TriangleRun {
    TriangleRun {
        triangles: run.triangles,
        skipped_elements: run.skipped_elements,
        divisions: run.divisions,
        owned: run.owned,
        solid: run.solid,
    }
}

fn cells(run: &v1::CellRun) -> CellRun {
    CellRun {
        cells: run.cells,
        skipped_cells: run.skipped_cells,
    }
}

/// A batch as it is sent.
pub fn batch_message(batch: &Batch) -> v1::Batch {
    let lines = batch.lines.iter().map(|lines| v1::Lines {
        direction: Some(vector(lines.direction)),
        random_x: lines.random[0],
        random_y: lines.random[1],
        random_count: lines.random[2],
        line_area_m2: lines.line_area_m2,
        parts: lines.part.count(),
        part: lines.part.number(),
    });
    v1::Batch {
        index: batch.index,
        lines: lines.collect(),
        rays: batch.rays.map(|rays| v1::Rays {
            seed: rays.seed,
            least_samples: rays.least_samples,
            batches_in_half: rays.batches_in_half,
            lines_per_m2: rays.lines_per_m2,
            in_a_row_m: rays.in_a_row_m,
            parts: rays.part.count(),
            part: rays.part.number(),
        }),
    }
}

/// A batch that came; a direction that is none has no lines.
pub fn batch(message: &v1::Batch) -> Batch {
    let lines = message.lines.iter().filter_map(|lines| {
        let d = lines.direction.as_ref()?;
        Some(Lines {
            direction: DVec3::new(d.x, d.y, d.z),
            random: [lines.random_x, lines.random_y, lines.random_count],
            line_area_m2: lines.line_area_m2,
            part: Part::new(lines.part, lines.parts),
        })
    });
    Batch {
        index: message.index,
        lines: lines.collect(),
        rays: message.rays.as_ref().map(|rays| Rays {
            seed: rays.seed,
            least_samples: rays.least_samples,
            batches_in_half: rays.batches_in_half,
            lines_per_m2: rays.lines_per_m2,
            in_a_row_m: rays.in_a_row_m,
            part: Part::new(rays.part, rays.parts),
        }),
    }
}

/// What a block says of its sizes, before any memory is taken for them; of its jobs, nothing.
pub fn demand(block: &v1::Block) -> Demand {
    let mesh = block.mesh.as_ref();
    let triangles = mesh.map_or(0, |mesh| mesh.triangles.max(mesh.vertices.div_ceil(3)));
    let elements = |run: &v1::TriangleRun| {
        let pieces = u64::from(run.divisions).pow(2);
        u64::from(run.triangles).saturating_mul(pieces)
    };
    let world = block.world.unwrap_or_default();
    let soil = world.soil.unwrap_or_default();
    let cells = u64::from(soil.cells_x) * u64::from(soil.cells_y);
    let far = u64::from(world.far_levels) * u64::from(world.far_bins);
    // more cannot be numbered
    let capped = |count: u64| count.min(u64::from(u32::MAX));
    Demand {
        triangles: u64::from(triangles),
        elements: capped(block.runs.iter().map(elements).fold(0, u64::saturating_add)),
        other_ends: capped(cells) + 2 * capped(far),
        ..Demand::default()
    }
}

fn vector(v: DVec3) -> v1::Vector {
    v1::Vector {
        x: v.x,
        y: v.y,
        z: v.z,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLES: [[DVec3; 3]; 2] = [
        [DVec3::ZERO, DVec3::X, DVec3::Y],
        [DVec3::Y, DVec3::X, DVec3::ONE],
    ];

    fn frame_of_two() -> BlockFrame {
        BlockFrame {
            world: World {
                extent: Extent {
                    min_m: DVec3::ZERO,
                    max_m: DVec3::ONE,
                    periodic: true,
                },
                elements: 5,
                soil: Some(SoilGrid {
                    z_m: -0.1,
                    min_m: DVec2::ZERO,
                    cell_m: DVec2::new(0.5, 1.0),
                    cells: [2, 1],
                }),
                radius_m: 0.4,
                far: Some(Arc::new(Levels { levels: 5, bins: 3 })),
            },
            runs: vec![TriangleRun {
                triangles: 2,
                skipped_elements: 1,
                divisions: 1,
                owned: true,
                solid: true,
            }],
            owned_soil: vec![CellRun {
                cells: 1,
                skipped_cells: 1,
            }],
        }
    }

    #[test]
    fn blocks_come_back() {
        let sent = block_message(&frame_of_two(), TRIANGLES.into_iter()).unwrap();
        let back = frame(&sent).unwrap();
        assert_eq!(format!("{back:?}"), format!("{:?}", frame_of_two()));
        let block = block(&sent).unwrap();
        assert!(block.soup().triangles().eq(TRIANGLES));
        assert_eq!(block.rows(), 5);
        let demand = demand(&sent);
        assert_eq!((demand.triangles, demand.elements), (2, 2));
    }

    #[test]
    fn batches_come_back() {
        let batch = Batch {
            index: 3,
            lines: vec![Lines {
                direction: DVec3::new(0.6, 0.0, 0.8),
                random: [0.1, 0.2, 0.3],
                line_area_m2: 1e-4,
                part: Part::new(2, 5),
            }],
            rays: Some(Rays {
                seed: 7,
                least_samples: 4.0,
                batches_in_half: 8,
                lines_per_m2: 1e5,
                in_a_row_m: 0.04,
                part: Part::default(),
            }),
        };
        assert_eq!(super::batch(&batch_message(&batch)), batch);
    }

    #[test]
    fn what_is_not_there_is_refused() {
        type Spoil = fn(&mut v1::Block);
        let spoilt: [(Spoil, &str); 5] = [
            (|b| b.mesh = None, "without mesh"),
            (|b| b.world = None, "without world"),
            (
                |b| b.mesh = Some(v1::Mesh::default()),
                "x_m of the mesh cannot be unpacked",
            ),
            (|b| b.world.as_mut().unwrap().far_bins = 65, "far field"),
            (|b| b.world.as_mut().unwrap().min_m = None, "without min_m"),
        ];
        for (spoil, expected) in spoilt {
            let mut message = block_message(&frame_of_two(), TRIANGLES.into_iter()).unwrap();
            spoil(&mut message);
            let fault = block(&message).err().unwrap().to_string();
            assert!(fault.contains(expected), "{fault}, expected {expected}");
        }
    }

    #[test]
    fn a_message_of_few_bytes_can_be_a_large_block() {
        let run = v1::TriangleRun {
            triangles: u32::MAX,
            divisions: 100,
            ..v1::TriangleRun::default()
        };
        let block = v1::Block {
            runs: vec![run; 3],
            ..v1::Block::default()
        };
        assert_eq!(demand(&block).elements, u64::from(u32::MAX));
    }
}

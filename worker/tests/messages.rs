//! Blocks as raw bytes: whatever comes is refused or taken, and what is taken holds together.

#![allow(clippy::unwrap_used)]

use nestrad_proto::{mesh, v1};
use nestrad_worker::{Block, Demand};
use proptest::prelude::*;
use prost::Message;

fn block() -> v1::Block {
    let vector = |x, y, z| Some(v1::Vector { x, y, z });
    let at = |k: u32| f64::from(k * 7 % 18) / 18.0;
    v1::Block {
        world: Some(v1::World {
            min_m: vector(0.0, 0.0, 0.0),
            max_m: vector(1.0, 1.0, 1.0),
            periodic: true,
            elements: 5,
            soil: Some(v1::SoilPlane {
                z_m: 0.0,
                cell_x_m: 0.5,
                cell_y_m: 0.5,
                cells_x: 2,
                cells_y: 2,
                ..v1::SoilPlane::default()
            }),
            sphere_radius_m: 0.4,
            far_levels: 5,
            far_bins: 3,
        }),
        mesh: Some(mesh::pack(
            [0, 1]
                .map(|t| {
                    [0, 1, 2].map(|corner| [0, 1, 2].map(|axis| at(9 * t + 3 * corner + axis)))
                })
                .into_iter(),
        )),
        runs: vec![
            v1::TriangleRun {
                triangles: 1,
                divisions: 2,
                owned: true,
                ..v1::TriangleRun::default()
            },
            v1::TriangleRun {
                triangles: 1,
                divisions: 1,
                solid: true,
                ..v1::TriangleRun::default()
            },
        ],
        owned_soil: [0, 2]
            .map(|skipped_cells| v1::CellRun {
                cells: 1,
                skipped_cells,
            })
            .to_vec(),
    }
}

#[test]
fn the_block_is_taken_as_it_is() {
    assert!(Block::new(&block()).is_ok());
}

/// Whether it takes no more memory than a worker might have that looks first, as workers do.
fn fits(message: &v1::Block) -> bool {
    Demand::of_message(message).block_bytes() < 1 << 30
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4096, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn blocks_with_a_few_wrong_bytes_are_refused_or_taken(
        wrong in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let mut bytes = block().encode_to_vec();
        for (at, byte) in wrong {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if let Ok(message) = v1::Block::decode(&bytes[..])
            && fits(&message)
            && let Ok(taken) = Block::new(&message)
        {
            prop_assert!(taken.ends() >= 4);
        }
    }

    #[test]
    fn any_bytes_are_refused_or_taken(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        if let Ok(message) = v1::Block::decode(&bytes[..])
            && fits(&message)
        {
            let _ = Block::new(&message);
        }
    }
}

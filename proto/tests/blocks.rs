//! Blocks as raw bytes: whatever comes is refused or taken, and what is taken holds together.

#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use glam::{DVec2, DVec3};
use nestrad_kernel::block::{BlockFrame, CellRun, TriangleRun};
use nestrad_kernel::far_grid::Levels;
use nestrad_kernel::lattice::Extent;
use nestrad_kernel::soil::SoilGrid;
use nestrad_kernel::world::World;
use nestrad_proto::{near_field, v1};
use proptest::prelude::*;
use prost::Message;

fn block() -> v1::Block {
    let at = |k: u32| f64::from(k * 7 % 18) / 18.0;
    let triangle = |t: u32| {
        [0, 1, 2].map(|corner| DVec3::from([0, 1, 2].map(|axis| at(9 * t + 3 * corner + axis))))
    };
    let frame = BlockFrame {
        world: World {
            extent: Extent {
                min_m: DVec3::ZERO,
                max_m: DVec3::ONE,
                periodic: true,
            },
            elements: 5,
            soil: Some(SoilGrid {
                z_m: 0.0,
                min_m: DVec2::ZERO,
                cell_m: DVec2::splat(0.5),
                cells: [2, 2],
            }),
            radius_m: 0.4,
            far: Some(Arc::new(Levels { levels: 5, bins: 3 })),
        },
        runs: vec![
            TriangleRun {
                triangles: 1,
                skipped_elements: 0,
                divisions: 2,
                owned: true,
                solid: false,
            },
            TriangleRun {
                triangles: 1,
                skipped_elements: 0,
                divisions: 1,
                owned: false,
                solid: true,
            },
        ],
        owned_soil: [0, 2]
            .map(|skipped_cells| CellRun {
                cells: 1,
                skipped_cells,
            })
            .to_vec(),
    };
    near_field::block_message(&frame, [0, 1].map(triangle).into_iter()).unwrap()
}

#[test]
fn the_block_is_taken_as_it_is() {
    assert!(near_field::block(&block()).is_ok());
}

/// Whether it takes no more memory than a worker might have that looks first, as workers do.
fn fits(message: &v1::Block) -> bool {
    near_field::demand(message).block_bytes() < 1 << 30
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
            && let Ok(taken) = near_field::block(&message)
        {
            prop_assert!(taken.ends() >= 4);
        }
    }

    #[test]
    fn any_bytes_are_refused_or_taken(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        if let Ok(message) = v1::Block::decode(&bytes[..])
            && fits(&message)
        {
            let _ = near_field::block(&message);
        }
    }
}

#![no_main]

use libfuzzer_sys::fuzz_target;
use nestrad_common::formats::{MAX_COORDINATE, can};

fuzz_target!(|bytes: &[u8]| {
    let Ok(mesh) = can::parse("f", bytes) else {
        return;
    };
    let vertices = mesh.triangles.iter().flatten();
    assert!(
        vertices
            .copied()
            .all(|vertex| vertex.abs().max_element() <= MAX_COORDINATE)
    );
    assert!(mesh.organ.iter().all(|&i| (i as usize) < mesh.organs.len()));
    assert!(
        mesh.material
            .iter()
            .all(|&i| (i as usize) < mesh.materials.len())
    );
});

#![no_main]

use libfuzzer_sys::fuzz_target;
use nestrad_common::formats::{MAX_COORDINATE, obj};

fuzz_target!(|bytes: &[u8]| {
    let Ok(file) = obj::parse("f", bytes) else {
        return;
    };
    let mesh = &file.mesh;
    assert!(
        mesh.vertices
            .iter()
            .all(|vertex| vertex.abs().max_element() <= MAX_COORDINATE)
    );
    let corners = mesh.triangles.as_flattened();
    assert!(corners.iter().all(|&i| (i as usize) < mesh.vertices.len()));
    assert!(mesh.organ.iter().all(|&i| (i as usize) < file.organs.len()));
    assert!(
        mesh.material
            .iter()
            .all(|&i| (i as usize) < file.materials.len())
    );
    let triangles = [file.line.len(), mesh.organ.len(), mesh.material.len()];
    assert_eq!(triangles, [mesh.len(); 3]);
});

//! The descriptors in the Python package are those of the `.proto` files.

#![allow(clippy::unwrap_used, reason = "what cannot be read fails the test")]

use std::collections::HashSet;
use std::path::Path;

use nestrad_proto::DESCRIPTORS;
use prost::Message;
use prost_types::FileDescriptorSet;

/// Writes them where it is set.
const WRITE: &str = "NESTRAD_WRITE_DESCRIPTORS";

/// What a client needs: without comments, and without the messages of workers.
fn of_clients() -> Vec<u8> {
    let mut set = FileDescriptorSet::decode(DESCRIPTORS).unwrap();
    let mut needed = HashSet::from(["nestrad/v1/client.proto".to_owned()]);
    // files stand after what they import
    for file in set.file.iter().rev() {
        if needed.contains(file.name()) {
            needed.extend(file.dependency.iter().cloned());
        }
    }
    set.file.retain(|file| needed.contains(file.name()));
    for file in &mut set.file {
        file.source_code_info = None;
    }
    set.encode_to_vec()
}

#[test]
fn fault_the_python_package_had_descriptors_of_another_protocol() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR")).join("python/src/nestrad");
    let path = package.join("protocol.binpb");
    let expected = of_clients();
    if std::env::var_os(WRITE).is_some() {
        std::fs::write(&path, &expected).unwrap();
    }
    assert!(
        std::fs::read(&path).unwrap() == expected,
        "the .proto files have changed: {WRITE}=1 cargo test -p nestrad-proto --test python_descriptors",
    );
}

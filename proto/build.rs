//! Compiles the `.proto` files with protox, so that no `protoc` needs to be installed.

use std::env;
use std::error::Error;
use std::path::PathBuf;

use protox::Compiler;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=nestrad");
    let mut compiler = Compiler::new(["."])?;
    compiler.include_imports(true).include_source_info(true);
    compiler.open_files([
        "nestrad/v1/near_field.proto",
        "nestrad/v1/worker.proto",
        "nestrad/v1/client.proto",
    ])?;
    // with the comments, for whoever asks the reflection service
    let encoded = PathBuf::from(env::var("OUT_DIR")?).join("descriptors.bin");
    std::fs::write(encoded, compiler.encode_file_descriptor_set())?;
    tonic_prost_build::configure()
        .bytes(".nestrad.v1.FetchBlockResponse.chunk")
        .bytes(".nestrad.v1.ReturnRowsRequest.chunk")
        .compile_fds(compiler.file_descriptor_set())?;
    Ok(())
}

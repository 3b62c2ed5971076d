//! Compiles the `.proto` files with protox, so that no `protoc` needs to be installed.

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let files = ["nestrad/v1/near_field.proto"];
    println!("cargo:rerun-if-changed=nestrad");
    let descriptors = protox::compile(files, ["."])?;
    prost_build::Config::new().compile_fds(descriptors)?;
    Ok(())
}

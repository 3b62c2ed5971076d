#![no_main]

use libfuzzer_sys::fuzz_target;
use nestrad_proto::v1;
use nestrad_worker::{Block, Demand};
use prost::Message;

fuzz_target!(|bytes: &[u8]| {
    let Ok(message) = v1::Block::decode(bytes) else {
        return;
    };
    // as a worker does, which takes no more memory than was announced
    if Demand::of_message(&message).block_bytes() < 64 << 20 {
        let _ = Block::new(&message);
    }
});

#![no_main]

use libfuzzer_sys::fuzz_target;
use nestrad_proto::{near_field, v1};
use prost::Message;

fuzz_target!(|bytes: &[u8]| {
    let Ok(message) = v1::Block::decode(bytes) else {
        return;
    };
    // as a worker does, which takes no more memory than was announced
    if near_field::demand(&message).block_bytes() < 64 << 20 {
        let _ = near_field::block(&message);
    }
});

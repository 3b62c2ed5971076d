//! Workers as processes over real sockets: the same bits with any number of them, and whatever fails.

#![allow(clippy::unwrap_used, reason = "what cannot be set up fails the test")]

mod alone;
mod audits;
mod bits;
mod faults;
mod hold_ups;
mod kept;
mod masters;
mod memory;
mod partition;
mod rogues;

use nestrad_tests::desk::Desk;

/// Two plants of maize, and what they get when they are solved in one process.
fn maize(more: &[&str]) -> (Desk, [Vec<u8>; 3]) {
    let desk = Desk::new();
    desk.done(&[
        "generate", "maize", "--rows", "2x1", "--seed", "1", "--out", "maize",
    ]);
    let solve = ["solve", SCENE, "--out", "here"];
    desk.done(&[&solve, more].concat());
    let tables = desk.tables("here");
    (desk, tables)
}

const SCENE: &str = "maize/scene.toml";

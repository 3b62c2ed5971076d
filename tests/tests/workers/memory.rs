use nestrad_tests::crew::{Solving, worker};
use nestrad_tests::desk::Desk;

/// A worker that may take far less than the scene needs gets blocks that fit, and keeps to its word.
#[test]
fn a_small_worker_computes_a_large_scene_within_its_memory() {
    let desk = Desk::new();
    desk.done(&[
        "generate", "maize", "--rows", "8x8", "--seed", "1", "--out", "field",
    ]);
    let (scene, more) = ("field/scene.toml", ["--diameter", "0.1", "--accuracy", "2"]);
    desk.done(&[&["solve", scene, "--out", "here"], &more[..]].concat());
    let mut solving = Solving::begin(desk.folder(), scene, "there", &more);
    let limit = 0.08;
    let small = worker(solving.address, &["--memory", &limit.to_string()]);
    // it goes with the end of the solve
    let mut peak = 0;
    while let Some(bytes) = small.peak_bytes() {
        peak = bytes;
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    solving.succeeds();
    assert!(desk.tables("here") == desk.tables("there"));
    let bytes = (limit * (1u64 << 30) as f64) as u64;
    let blocks = small.log().matches("block is ready").count();
    assert!(blocks > 2, "{blocks} blocks");
    assert!(peak > 0 && peak <= bytes, "limit {bytes}, peak {peak}");
}

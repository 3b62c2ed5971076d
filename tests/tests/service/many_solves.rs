//! A thousand small solves leave nothing behind.

#![allow(clippy::print_stderr, reason = "figures of the test")]

use std::time::{Duration, Instant};

use nestrad_proto::v1;
use nestrad_tests::calls::{block_on, client, ended, fetch, one_leaf, start, upload};
use nestrad_tests::processes::{Master, until};

#[test]
fn a_thousand_solves_through_one_master_leave_nothing_behind() {
    // room for some hundred scenes and results
    let master = Master::start(&[
        "--scene-memory",
        "0.0005",
        "--result-memory",
        "0.0005",
        "--resident-memory",
        "0.0005",
    ]);
    let begun = Instant::now();
    let solve = |k: u32| {
        block_on(async {
            let mut client = client(&master);
            let mut slices = one_leaf();
            // every time another geometry, and a leaf that scatters
            if let Some(v1::scene_slice::Part::Triangles(slice)) = &mut slices[2].part {
                slice.vertices_m[2] = 1.0 + f64::from(k) * 1e-3;
            }
            if let Some(v1::scene_slice::Part::Header(header)) = &mut slices[0].part {
                let optics = &mut header.bands[0].materials[0];
                (optics.rho_upper, optics.rho_lower) = (0.4, 0.4);
            }
            let scene = upload(&mut client, slices).await.unwrap().scene_id;
            let options = v1::SolveOptions {
                accuracy_percent: Some(20.0),
                ..v1::SolveOptions::default()
            };
            let id = start(&mut client, &scene, options).await;
            let last = ended(&mut client, &id).await;
            assert_eq!(last.state(), v1::SolveState::Finished, "{}", last.reason);
            fetch(&mut client, &id).await.unwrap();
        });
    };
    let closed = || master.metric("nestrad_connections") == 0.0;
    // free memory is given back once a second, after a solve
    let at_rest = |last| {
        std::thread::sleep(Duration::from_millis(1100));
        solve(last);
        until("connections are closed", closed);
        std::thread::sleep(Duration::from_millis(300));
        master.metric("nestrad_resident_memory_bytes")
    };
    (0..299).for_each(solve);
    let memory_bytes = at_rest(299);
    let files = master.metric("nestrad_open_files");
    (300..999).for_each(solve);
    let more = at_rest(999) - memory_bytes;
    assert_eq!(
        master.metric("nestrad_solves_ended_total{outcome=\"finished\"}"),
        1000.0
    );
    assert!(master.metric("nestrad_solves{state=\"ended\"}") <= 256.0);
    let bound = 0.0005 * (1u64 << 30) as f64;
    assert!(master.metric("nestrad_scene_bytes") <= bound);
    assert!(master.metric("nestrad_result_bytes") <= bound);
    assert!(master.metric("nestrad_traced_canopy_bytes") <= bound);
    assert!(more < 4e6, "{more} bytes more");
    // a loaded machine may close what the last metric was read through a little later
    until("files are closed", || {
        master.metric("nestrad_open_files") <= files
    });
    // shown with --nocapture
    eprintln!(
        "1000 solves in {:.1} s; {memory_bytes} bytes resident after 300, {more} more after 1000",
        begun.elapsed().as_secs_f64()
    );
}

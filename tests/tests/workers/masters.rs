use nestrad_tests::crew::worker;
use nestrad_tests::processes::{Master, until};

use super::{SCENE, maize};

#[test]
fn workers_come_back_to_a_master_that_was_killed() {
    let (desk, expected) = maize(&[]);
    let master = Master::start(&[]);
    let address = master.address;
    let mut worker = worker(address, &[]);
    worker.says("joined");
    let solve = |out: &str, url: &str| {
        desk.done(&["solve", SCENE, "--out", out, "--master", url]);
        desk.tables(out)
    };
    assert!(expected == solve("first", &master.url()));
    assert!(master.log().contains("worker joins"));
    master.kill();
    let master = Master::start_at(&address.to_string(), &[]);
    worker.says("joined");
    assert!(expected == solve("second", &master.url()));
    until("results came from the worker", || {
        master.metric("nestrad_worker_results_total") > 0.0
    });
    // a worker outlives its master, and leaves when it is told to itself
    assert!(master.terminate().success());
    worker.signal("TERM");
    assert!(worker.ends().success(), "{}", worker.log());
}

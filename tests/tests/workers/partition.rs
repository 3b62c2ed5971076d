use nestrad_tests::crew::{Solving, worker};
use nestrad_tests::proxy::Proxy;
use nestrad_tests::rogue::Rogue;

use super::{SCENE, maize};

#[test]
fn a_network_that_heals_brings_the_worker_back() {
    let fine = ["--accuracy", "0.3"];
    let (desk, expected) = maize(&fine);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &fine);
    let proxy = Proxy::new(solving.address);
    let mut remote = worker(proxy.address, &[]);
    remote.says("block is ready");
    proxy.cut();
    // somebody on this side sees the leases go: one that was taken by the other is given out again
    let witness = Rogue::join(solving.address);
    let job = witness.lease();
    let (header, packed) = witness.compute(&job);
    assert!(witness.bring(&header, &packed).unwrap());
    let cut = std::time::Instant::now();
    while cut.elapsed() < std::time::Duration::from_secs(3) {
        // longer than two lease times: the master has forgotten the other
        witness.renew(vec![]).unwrap();
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    proxy.heal();
    solving.succeeds();
    assert!(remote.ends().success(), "{}", remote.log());
    assert!(expected == desk.tables("there"));
}

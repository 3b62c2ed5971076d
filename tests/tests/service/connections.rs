//! Connections that are there to be there.

use std::net::TcpStream;

use nestrad_proto::connections::ConnectionLimits;
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::Master;

#[test]
fn thousands_of_silent_connections_lock_no_client_out() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    let open = |address, count| -> Vec<TcpStream> {
        (0..count)
            .map(|_| TcpStream::connect(address).unwrap())
            .collect()
    };
    // more than any address has places, so that they are taken again and again
    let limits = ConnectionLimits::default().within_open_files();
    let _silent = open(master.address, limits.of_an_address + 200);
    desk.compare("scene.toml", &[], &master);
    assert!(master.metric("nestrad_connections_turned_away_total") >= 200.0);
    assert!(master.metric("nestrad_connections") <= limits.of_an_address as f64);
    let _as_many = open(master.metrics, 100);
    assert!(master.metric("nestrad_connections_turned_away_total") >= 200.0);
}

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio_stream::StreamExt;

use super::*;

const FEW: ConnectionLimits = ConnectionLimits {
    connections: 4,
    of_an_address: 3,
    first_call: Duration::from_secs(10),
};

fn at(address: &str) -> SocketAddr {
    address.parse().unwrap()
}

async fn next(incoming: &mut Incoming) -> Connection {
    incoming.next().await.unwrap().unwrap()
}

async fn a_port(limits: ConnectionLimits) -> (Connections, Incoming, SocketAddr) {
    let connections = Connections::new(limits);
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    (connections.clone(), connections.incoming(listener), address)
}

#[tokio::test(start_paused = true)]
async fn a_connection_is_counted_and_closed_when_nobody_makes_a_call() {
    let (connections, mut incoming, address) = a_port(FEW).await;
    let mut peer = TcpStream::connect(address).await.unwrap();
    let mut connection = next(&mut incoming).await;
    let begun = Instant::now();
    peer.write_all(b"hello").await.unwrap();
    let mut bytes = [0; 5];
    connection.read_exact(&mut bytes).await.unwrap();
    assert_eq!(connections.traffic().received, 5);
    // a byte now and then is no call
    let trickles = async {
        loop {
            tokio::time::sleep(Duration::from_secs(3)).await;
            peer.write_all(b".").await.unwrap();
        }
    };
    let reads = async { while connection.read_u8().await.is_ok() {} };
    tokio::select! {
        () = reads => {}
        () = trickles => {}
    }
    assert!(begun.elapsed() < FEW.first_call + Duration::from_secs(1));
    assert!(begun.elapsed() >= FEW.first_call);
    let now = connections.traffic();
    assert_eq!((now.open, now.turned_away), (1, 1));
    drop(connection);
    assert_eq!(connections.traffic().open, 0);
}

#[tokio::test(start_paused = true)]
async fn who_was_let_in_may_be_silent_for_longer() {
    let (connections, mut incoming, address) = a_port(FEW).await;
    let peer = TcpStream::connect(address).await.unwrap();
    let mut connection = next(&mut incoming).await;
    connections.is_let_in(peer.local_addr().unwrap());
    let begun = Instant::now();
    let error = connection.read_u8().await.unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::TimedOut);
    assert!(begun.elapsed() > Duration::from_secs(100));
}

#[tokio::test]
async fn the_oldest_that_makes_no_call_gives_way() {
    let (connections, mut incoming, address) = a_port(FEW).await;
    let mut peers = Vec::new();
    let mut open = Vec::new();
    for _ in 0..3 {
        peers.push(TcpStream::connect(address).await.unwrap());
        open.push(next(&mut incoming).await);
    }
    connections.is_let_in(peers[0].local_addr().unwrap());
    let mut waits = open.remove(1);
    let reading = tokio::spawn(async move { waits.read_u8().await.unwrap_err().kind() });
    tokio::task::yield_now().await;
    let _fourth = TcpStream::connect(address).await.unwrap();
    open.push(next(&mut incoming).await);
    assert_eq!(reading.await.unwrap(), io::ErrorKind::ConnectionAborted);
    let now = connections.traffic();
    assert_eq!((now.open, now.turned_away), (3, 1));
}

#[test]
fn of_one_address_there_are_a_few_and_of_all_together_more() {
    let register = Register::default();
    let enters = |address: &str, let_in: bool| {
        let room = register.admit(at(address), &FEW);
        if let_in {
            register.with(at(address), Caller::is_let_in);
        }
        room
    };
    assert_eq!(enters("10.0.0.1:1", true), Room::Free(0));
    assert_eq!(enters("10.0.0.1:2", true), Room::Free(1));
    assert_eq!(enters("10.0.0.1:3", true), Room::Free(2));
    assert_eq!(enters("[::ffff:10.0.0.1]:4", true), Room::None);
    assert_eq!(enters("[2001:db8::1]:1", false), Room::Free(3));
    // the one stranger gives way, and then all that are there have been let in
    assert_eq!(enters("10.0.0.2:1", true), Room::OfAnother(4));
    assert_eq!(enters("[2001:db8::2]:1", true), Room::None);
    assert_eq!(register.count(), 4);
    let same = ConnectionLimits {
        of_an_address: 1,
        connections: 9,
        ..FEW
    };
    assert_eq!(
        register.admit(at("[2001:db8:0:1::1]:1"), &same),
        Room::Free(5)
    );
    assert_eq!(
        register.admit(at("[2001:db8:0:1:9::]:1"), &same),
        Room::OfAnother(6)
    );
}

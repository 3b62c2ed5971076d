//! Clients that mean no good, or take no care. They come from an address of their own.

use std::fmt;
use std::io::Write;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use nestrad_proto::v1::{self, scene_header::Geometry, scene_slice::Part};
use nestrad_tests::calls::one_leaf;
use nestrad_tests::random::Dice;
use tokio::sync::mpsc;
use tokio::time::{sleep, timeout};
use tokio_stream::wrappers::ReceiverStream;
use tonic::Status;

use crate::calls::{Client, connect, within};

/// What such a client does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ClientKind {
    /// Announces scenes of half a million triangles, and sends none.
    Announces,
    /// Sends slices without anything in them.
    EmptySlices,
    /// Starts solves as fast as it can, and watches none.
    Floods,
    /// Starts solves and cancels them.
    Cancels,
    /// Starts solves and never fetches what comes of them.
    NeverFetches,
    /// Watches and reads nothing.
    NeverReads,
    /// Many connections that say nothing.
    Silent,
    /// What is no protocol.
    Garbage,
}

impl ClientKind {
    pub(crate) const ALL: [Self; 8] = [
        Self::Announces,
        Self::EmptySlices,
        Self::Floods,
        Self::Cancels,
        Self::NeverFetches,
        Self::NeverReads,
        Self::Silent,
        Self::Garbage,
    ];
}

impl fmt::Display for ClientKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Announces => "announces a huge scene and sends none",
            Self::EmptySlices => "sends empty slices",
            Self::Floods => "floods the queue",
            Self::Cancels => "cancels its solves",
            Self::NeverFetches => "never fetches",
            Self::NeverReads => "never reads what it watches",
            Self::Silent => "connects and says nothing",
            Self::Garbage => "sends garbage",
        })
    }
}

/// Calls that went well, calls that were refused, and why the last one was.
#[derive(Default)]
struct Did {
    done: u32,
    refused: u32,
    why: String,
}

impl Did {
    fn count<T>(&mut self, answer: Result<T, Status>) -> Option<T> {
        match answer {
            Ok(answer) => {
                self.done += 1;
                Some(answer)
            }
            Err(status) => {
                self.refused += 1;
                self.why = format!("{:?}: {}", status.code(), status.message());
                None
            }
        }
    }
}

/// Does so for a time; says how far it came.
pub(crate) fn act(kind: ClientKind, master: SocketAddr, seed: u64, lasts: Duration) -> String {
    let until = Instant::now() + lasts;
    let mut did = Did::default();
    match kind {
        ClientKind::Silent | ClientKind::Garbage => {
            let sockets = if kind == ClientKind::Silent { 500 } else { 50 };
            let mut open = Vec::new();
            for _ in 0..sockets {
                let stream = TcpStream::connect_timeout(&master, Duration::from_secs(1));
                let stream = stream.map_err(|error| Status::unavailable(error.to_string()));
                open.extend(did.count(stream));
            }
            if kind == ClientKind::Garbage {
                // it may be closed already
                open.iter_mut()
                    .for_each(|stream| drop(stream.write_all(&[0x5a; 10_000])));
            }
            std::thread::sleep(until.saturating_duration_since(Instant::now()));
        }
        _ => {
            let time = lasts + Duration::from_secs(5);
            let ended = within(time, act_with_calls(kind, master, seed, until, &mut did));
            did.count(ended);
        }
    }
    let Did { done, refused, why } = did;
    format!("{done} done, {refused} refused: {why}")
}

async fn act_with_calls(
    kind: ClientKind,
    master: SocketAddr,
    seed: u64,
    until: Instant,
    did: &mut Did,
) -> Result<(), Status> {
    let from = IpAddr::V4(Ipv4Addr::new(127, 0, 0, 66));
    let mut client = connect(master, Some(from)).await?;
    let mut dice = Dice(seed);
    let mut kept = Vec::new();
    let most = match kind {
        ClientKind::Floods => 400,
        ClientKind::Announces => 40,
        _ => 200,
    };
    for _ in 0..most {
        if Instant::now() > until {
            break;
        }
        match kind {
            ClientKind::Announces => kept.push(announce(client.clone())),
            ClientKind::EmptySlices => {
                let time = until.saturating_duration_since(Instant::now());
                did.count(empty_slices(client.clone(), time).await);
            }
            _ => {
                let Some(solve_id) = did.count(start(&mut client, &mut dice).await) else {
                    sleep(Duration::from_millis(100)).await;
                    continue;
                };
                match kind {
                    ClientKind::Cancels => {
                        let request = v1::CancelSolveRequest { solve_id };
                        did.count(client.cancel_solve(request).await);
                    }
                    ClientKind::NeverReads => {
                        let request = v1::WatchSolveRequest { solve_id };
                        let watched = did.count(client.watch_solve(request).await);
                        // a stream that is kept and not read
                        std::mem::forget(watched);
                    }
                    _ => {}
                }
            }
        }
    }
    if kind == ClientKind::Announces {
        let answers: Vec<_> = kept.into_iter().map(tokio::spawn).collect();
        sleep(until.saturating_duration_since(Instant::now())).await;
        for answer in answers {
            if answer.is_finished() {
                if let Ok(answer) = answer.await {
                    did.count(answer);
                }
            } else {
                did.done += 1;
                answer.abort();
            }
        }
    }
    Ok(())
}

/// A leaf at any height: each another geometry.
fn scene(dice: &mut Dice) -> [v1::SceneSlice; 3] {
    let mut slices = one_leaf();
    if let Some(Part::Triangles(slice)) = &mut slices[2].part {
        slice.vertices_m[2] = 1.0 + dice.unit();
    }
    slices
}

async fn start(client: &mut Client, dice: &mut Dice) -> Result<String, Status> {
    let slices = tokio_stream::iter(scene(dice));
    let scene_id = client.upload_scene(slices).await?.into_inner().scene_id;
    let request = v1::StartSolveRequest {
        scene_id,
        sensors: None,
        options: Some(v1::SolveOptions {
            memory_gi_b: Some(crate::bounds::SOLVE_GIB),
            ..v1::SolveOptions::default()
        }),
    };
    Ok(client.start_solve(request).await?.into_inner().solve_id)
}

/// The header of a scene of half a million triangles, and then nothing for a while.
async fn announce(mut client: Client) -> Result<(), Status> {
    let [mut header, ..] = one_leaf();
    if let Some(Part::Header(header)) = &mut header.part
        && let Some(Geometry::NewGeometry(new)) = &mut header.geometry
    {
        new.triangles = 500_000;
    }
    let (sender, receiver) = mpsc::channel(1);
    // there is room for one
    let _ = sender.send(header).await;
    client.upload_scene(ReceiverStream::new(receiver)).await?;
    drop(sender);
    Ok(())
}

/// A header, and slices of nothing as fast as they go.
async fn empty_slices(mut client: Client, time: Duration) -> Result<(), Status> {
    let [header, ..] = one_leaf();
    let empty = v1::SceneSlice {
        part: Some(Part::Triangles(v1::TriangleSlice::default())),
    };
    let (sender, receiver) = mpsc::channel(64);
    let sends = tokio::spawn(async move {
        let _ = sender.send(header).await;
        while sender.send(empty.clone()).await.is_ok() {}
    });
    let answer = timeout(time, client.upload_scene(ReceiverStream::new(receiver))).await;
    sends.abort();
    match answer {
        Ok(answer) => answer.map(drop),
        Err(_) => Ok(()),
    }
}

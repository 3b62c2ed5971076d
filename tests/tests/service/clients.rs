//! Clients that disappear, cancel, or ask for what is not there.

use std::time::Duration;

use nestrad_proto::v1;
use nestrad_tests::calls::{block_on, client, ended, one_leaf, start, upload};
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{Master, nestrad, said, signal, until, wait_for};
use tonic::Code;

/// Takes some minutes to solve.
const LONG: [&str; 5] = ["solve", "maize/scene.toml", "--accuracy", "0.1", "--out"];

fn state_of(master: &Master, k: usize) -> Option<v1::SolveState> {
    let solves = block_on(async {
        let request = v1::ListSolvesRequest {};
        client(master)
            .list_solves(request)
            .await
            .unwrap()
            .into_inner()
            .solves
    });
    solves.get(k).map(|solve| solve.state())
}

#[test]
fn a_client_that_disappears_amid_an_upload_leaves_nothing() {
    let master = Master::start(&[]);
    block_on(async {
        let mut client = client(&master);
        let [header, organs, _] = one_leaf();
        // two slices, and then nothing more
        let (sender, receiver) = tokio::sync::mpsc::channel(4);
        for slice in [header, organs] {
            sender.send(slice).await.unwrap();
        }
        let call = client.upload_scene(tokio_stream::wrappers::ReceiverStream::new(receiver));
        let gone = tokio::time::timeout(Duration::from_millis(300), call).await;
        assert!(gone.is_err(), "{gone:?}");
    });
    until("memory is given back", || {
        master.metric("nestrad_scene_bytes") == 0.0
    });
    assert_eq!(master.metric("nestrad_scenes"), 0.0);
    let desk = Desk::new();
    desk.compare("scene.toml", &[], &master);
}

#[test]
fn a_watcher_that_disappears_does_not_stop_the_solve() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    desk.maize("maize", "1");
    let args = [
        "solve",
        "maize/scene.toml",
        "--accuracy",
        "1",
        "--out",
        "there",
    ];
    let url = master.url();
    let mut child = nestrad(desk.folder(), &[&args[..], &["--master", &url]].concat())
        .spawn()
        .unwrap();
    until("it runs", || {
        state_of(&master, 0) == Some(v1::SolveState::Running)
    });
    child.kill().unwrap();
    child.wait().unwrap();
    until("it finishes", || {
        state_of(&master, 0) == Some(v1::SolveState::Finished)
    });
    until("connections are closed", || {
        master.metric("nestrad_connections") == 0.0
    });
}

#[test]
fn ctrl_c_cancels_the_solve_at_the_master() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    desk.maize("maize", "1");
    let url = master.url();
    let args = [&LONG[..], &["there", "--master", &url]].concat();
    let child = nestrad(desk.folder(), &args).spawn().unwrap();
    until("it runs", || {
        state_of(&master, 0) == Some(v1::SolveState::Running)
    });
    signal(child.id(), "INT");
    let output = wait_for(child);
    assert_eq!(output.status.code(), Some(130));
    assert!(said(&output).contains("cancelled"), "{}", said(&output));
    assert!(!desk.path("there").exists());
    until("it stops", || {
        state_of(&master, 0) == Some(v1::SolveState::Cancelled)
    });
    // and the next one has its turn
    desk.compare("scene.toml", &[], &master);
}

#[test]
fn solves_that_wait_can_be_cancelled_too() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    desk.maize("maize", "1");
    let url = master.url();
    let args = [&LONG[..], &["there", "--master", &url]].concat();
    let mut first = nestrad(desk.folder(), &args).spawn().unwrap();
    until("it runs", || {
        state_of(&master, 0) == Some(v1::SolveState::Running)
    });
    block_on(async {
        let mut client = client(&master);
        let scene = upload(&mut client, one_leaf()).await.unwrap().scene_id;
        let id = start(&mut client, &scene, v1::SolveOptions::default()).await;
        let request = v1::WatchSolveRequest {
            solve_id: id.clone(),
        };
        let mut watched = client.watch_solve(request).await.unwrap().into_inner();
        let now = watched.message().await.unwrap().unwrap();
        assert_eq!((now.state(), now.ahead), (v1::SolveState::Queued, 1));
        let early = v1::FetchResultsRequest {
            solve_id: id.clone(),
            table: v1::ResultTable::Organs.into(),
        };
        let refused = client.fetch_results(early).await.unwrap_err();
        assert_eq!(refused.code(), Code::FailedPrecondition);
        let request = v1::CancelSolveRequest {
            solve_id: id.clone(),
        };
        let cancelled = client.cancel_solve(request).await.unwrap().into_inner();
        assert_eq!(cancelled.state(), v1::SolveState::Cancelled);
        assert_eq!(
            ended(&mut client, &id).await.state(),
            v1::SolveState::Cancelled
        );
        let running = client.list_solves(v1::ListSolvesRequest {}).await.unwrap();
        let solve_id = running.into_inner().solves[0].solve_id.clone();
        let request = v1::CancelSolveRequest {
            solve_id: solve_id.clone(),
        };
        client.cancel_solve(request).await.unwrap();
        let last = ended(&mut client, &solve_id).await;
        assert_eq!(last.state(), v1::SolveState::Cancelled);
    });
    let status = first.wait().unwrap();
    assert_eq!(status.code(), Some(130));
}

#[test]
fn what_is_not_there_is_named() {
    let master = Master::start(&[]);
    block_on(async {
        let mut client = client(&master);
        let id = "0123456789abcdef0123456789abcdef";
        let request = v1::StartSolveRequest {
            scene_id: id.to_owned(),
            options: None,
            sensors: None,
        };
        let status = client.start_solve(request).await.unwrap_err();
        assert_eq!(status.code(), Code::NotFound);
        assert!(status.message().contains(id), "{status}");
        for solve_id in [
            id.to_owned(),
            "../../etc/passwd".to_owned(),
            "\u{1b}[2J".repeat(99),
        ] {
            let request = v1::WatchSolveRequest { solve_id };
            let status = client.watch_solve(request).await.unwrap_err();
            assert_eq!(status.code(), Code::NotFound);
            assert!(status.message().len() < 200 && !status.message().contains('\u{1b}'));
        }
        let [mut header, ..] = one_leaf();
        if let Some(v1::scene_slice::Part::Header(header)) = &mut header.part {
            header.geometry = Some(v1::scene_header::Geometry::GeometryId(id.to_owned()));
        }
        let status = upload(&mut client, [header]).await.unwrap_err();
        assert_eq!(status.code(), Code::NotFound);
    });
}

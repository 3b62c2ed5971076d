//! Masters that stop, or are stopped.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use nestrad_proto::channel::{Credentials, connect};
use nestrad_proto::v1;
use nestrad_tests::calls::{block_on, client};
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{Master, nestrad, said, signal, until, wait_for};
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_check_response::ServingStatus;
use tonic_health::pb::health_client::HealthClient;

fn runs(master: &Master) -> bool {
    let solves = block_on(async {
        let list = client(master).list_solves(v1::ListSolvesRequest {}).await;
        list.unwrap().into_inner().solves
    });
    solves
        .iter()
        .any(|solve| solve.state() == v1::SolveState::Running)
}

/// Solves a canopy at a master that something happens to meanwhile; gives what the client said.
fn solve_while(desk: &Desk, master: Master, happens: impl FnOnce(Master)) -> (bool, String) {
    let url = master.url();
    let args = ["solve", "maize/scene.toml", "--accuracy", "0.5", "--out"];
    desk.done(&[&args[..], &["here"]].concat());
    let there = [&args[..], &["there", "--master", &url]].concat();
    let child = nestrad(desk.folder(), &there).spawn().unwrap();
    until("it runs", || runs(&master));
    happens(master);
    let output = wait_for(child);
    (output.status.success(), said(&output))
}

#[test]
fn a_master_that_is_told_to_stop_ends_what_it_began() {
    let desk = Desk::new();
    desk.maize("maize", "1");
    let (done, said) = solve_while(&desk, Master::start(&[]), |master| {
        assert_eq!(master.terminate().code(), Some(0));
    });
    assert!(done, "{said}");
    assert!(desk.tables("here") == desk.tables("there"));
}

#[test]
fn a_master_that_is_stopped_takes_nothing_new_and_says_so() {
    let (desk, master) = (Desk::new(), Master::start(&["--drain", "600"]));
    desk.maize("maize", "1");
    let url = master.url();
    let long = [
        "solve",
        "maize/scene.toml",
        "--accuracy",
        "0.1",
        "--out",
        "out",
        "--master",
        &url,
    ];
    let child = nestrad(desk.folder(), &long).spawn().unwrap();
    until("it runs", || runs(&master));
    signal(master.id(), "TERM");
    until("it drains", || {
        master.log().contains("the master accepts nothing new")
    });
    let refused = block_on(async {
        let mut client = client(&master);
        let scene = nestrad_tests::calls::one_leaf();
        nestrad_tests::calls::upload(&mut client, scene)
            .await
            .unwrap_err()
    });
    assert_eq!(refused.code(), tonic::Code::Unavailable);
    let health = block_on(async {
        let channel = connect(&master.url(), &Credentials::default()).unwrap();
        let request = HealthCheckRequest::default();
        HealthClient::new(channel)
            .check(request)
            .await
            .unwrap()
            .into_inner()
    });
    assert_eq!(health.status(), ServingStatus::NotServing);
    assert_eq!(refused.message(), "the master is about to stop");
    signal(child.id(), "TERM");
    assert_eq!(wait_for(child).status.code(), Some(130));
    assert_eq!(master.terminate().code(), Some(0));
}

#[test]
fn a_time_to_drain_that_is_over_cancels() {
    let (desk, master) = (Desk::new(), Master::start(&["--drain", "0"]));
    desk.maize("maize", "1");
    let url = master.url();
    let long = [
        "solve",
        "maize/scene.toml",
        "--accuracy",
        "0.1",
        "--out",
        "out",
        "--master",
        &url,
    ];
    let child = nestrad(desk.folder(), &long).spawn().unwrap();
    until("it runs", || runs(&master));
    assert_eq!(master.terminate().code(), Some(0));
    let output = wait_for(child);
    assert_eq!(output.status.code(), Some(130));
    assert!(!desk.path("out").exists());
}

/// A master that is killed in the middle of a solve, and started again with the same arguments.
fn killed_and_started_again(args: &[&str]) {
    let desk = Desk::new();
    desk.maize("maize", "1");
    let mut again = None;
    let (done, said) = solve_while(&desk, Master::start(args), |master| {
        let address = master.address.to_string();
        master.kill();
        again = Some(Master::start_at(&address, args));
    });
    assert!(done, "{said}");
    assert!(said.contains("trying again"), "{said}");
    assert!(desk.tables("here") == desk.tables("there"));
}

#[test]
fn a_master_that_is_killed_and_started_again_gives_the_same_bytes() {
    killed_and_started_again(&[]);
}

#[test]
fn a_master_that_is_killed_goes_on_from_its_state_to_the_same_bytes() {
    let state = Desk::new();
    let folder = state.path("state").display().to_string();
    killed_and_started_again(&["--state", &folder]);
    assert!(state.path("state").read_dir().unwrap().next().is_some());
}

#[test]
fn a_master_with_stdin_ends_with_the_process_that_holds_it() {
    let desk = Desk::new();
    let args = ["serve", "--listen", "127.0.0.1:0", "--with-stdin"];
    let mut serve = nestrad(desk.folder(), &args);
    let mut child = serve.stdin(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    assert!(lines.any(|line| line.unwrap().contains("serves address=")));
    assert!(child.try_wait().unwrap().is_none());
    drop(child.stdin.take());
    assert_eq!(wait_for(child).status.code(), Some(0));
}

#[test]
fn a_master_that_is_not_there_is_given_up() {
    let desk = Desk::new();
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}", free.local_addr().unwrap());
    drop(free);
    let output = desk.run(&["solve", "scene.toml", "--out", "out", "--master", &url]);
    assert_eq!(output.status.code(), Some(5));
    assert!(
        said(&output).contains("cannot be reached"),
        "{}",
        said(&output)
    );
    let output = desk.run(&["status", "--master", &url]);
    assert_eq!(output.status.code(), Some(5));
}

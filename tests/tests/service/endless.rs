//! Masters that are not quite ones: one tells of a solve again and again, and nothing new; one never takes a scene.

use std::process::Output;
use std::time::Instant;

use nestrad_proto::access::Access;
use nestrad_proto::connections::Connections;
use nestrad_proto::v1;
use nestrad_proto::v1::solve_service_server::{SolveService, SolveServiceServer};
use nestrad_tests::calls::block_on;
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{nestrad, said, wait_for};
use tokio::net::TcpListener;
use tokio_stream::{Iter, iter};
use tonic::{Request, Response, Status, Streaming};

#[derive(Clone, Copy, PartialEq, Eq)]
enum NotQuite {
    Endless,
    Mute,
}

type Answer<T> = Result<Response<T>, Status>;

#[tonic::async_trait]
impl SolveService for NotQuite {
    async fn upload_scene(
        &self,
        request: Request<Streaming<v1::SceneSlice>>,
    ) -> Answer<v1::UploadSceneResponse> {
        let mut slices = request.into_inner();
        while slices.message().await?.is_some() {}
        if *self == Self::Mute {
            std::future::pending::<()>().await;
        }
        Ok(Response::new(v1::UploadSceneResponse::default()))
    }

    async fn start_solve(
        &self,
        _: Request<v1::StartSolveRequest>,
    ) -> Answer<v1::StartSolveResponse> {
        let solve_id = "1".to_owned();
        Ok(Response::new(v1::StartSolveResponse { solve_id }))
    }

    type WatchSolveStream = Iter<std::vec::IntoIter<Result<v1::SolveProgress, Status>>>;

    async fn watch_solve(
        &self,
        _: Request<v1::WatchSolveRequest>,
    ) -> Answer<Self::WatchSolveStream> {
        let running = v1::SolveProgress {
            state: v1::SolveState::Running.into(),
            stage: "steers \u{1b}[2J".to_owned(),
            plan: vec!["a plan \u{1b}[2J".to_owned()],
            ..v1::SolveProgress::default()
        };
        Ok(Response::new(iter(vec![Ok(running)])))
    }

    type FetchResultsStream = Iter<std::vec::IntoIter<Result<v1::ResultSlice, Status>>>;

    async fn fetch_results(
        &self,
        _: Request<v1::FetchResultsRequest>,
    ) -> Answer<Self::FetchResultsStream> {
        Err(Status::unimplemented("nothing"))
    }

    async fn cancel_solve(
        &self,
        _: Request<v1::CancelSolveRequest>,
    ) -> Answer<v1::CancelSolveResponse> {
        Err(Status::unimplemented("nothing"))
    }

    async fn list_solves(
        &self,
        _: Request<v1::ListSolvesRequest>,
    ) -> Answer<v1::ListSolvesResponse> {
        Err(Status::unimplemented("nothing"))
    }

    async fn status(&self, _: Request<v1::StatusRequest>) -> Answer<v1::StatusResponse> {
        Err(Status::unimplemented("nothing"))
    }
}

/// How a client ends that solves there.
fn solved_at(master: NotQuite) -> Output {
    let desk = Desk::new();
    block_on(async {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let (url, connections) = (format!("http://{address}"), Connections::default());
        let mut server = Access::default().server(address, &connections).unwrap();
        let master = server.add_service(SolveServiceServer::new(master));
        let serving = tokio::spawn(master.serve_with_incoming(connections.incoming(listener)));
        let args = ["solve", "scene.toml", "--out", "out", "--master", &url];
        let client = nestrad(desk.folder(), &args).spawn().unwrap();
        let ended = tokio::task::spawn_blocking(|| wait_for(client)).await;
        serving.abort();
        ended.unwrap()
    })
}

#[test]
fn a_client_that_is_told_nothing_new_gives_up() {
    let output = solved_at(NotQuite::Endless);
    let said = said(&output);
    assert!(!output.status.success());
    assert!(
        said.contains("the stream of progress ended before the solve"),
        "{said}"
    );
    assert!(
        said.contains("a plan \\u{1b}[2J") && !said.contains('\u{1b}'),
        "{said}"
    );
}

#[test]
fn a_client_whose_scene_gets_no_answer_gives_up() {
    let begun = Instant::now();
    let output = solved_at(NotQuite::Mute);
    let (said, took) = (said(&output), begun.elapsed());
    assert_eq!(output.status.code(), Some(5), "{said}");
    assert!(
        said.contains("the master cannot be reached: no answer"),
        "{said}"
    );
    // a minute after this small scene was sent
    assert!((55..100).contains(&took.as_secs()), "{took:?}");
}

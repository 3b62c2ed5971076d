//! Results of an earlier round, for a finer one failed: who asked for more is told, whatever else is kept quiet.

use std::net::SocketAddr;

use nestrad_proto::channel::{Credentials, connect};
use nestrad_proto::v1;
use nestrad_proto::v1::solve_service_server::{SolveService, SolveServiceServer};
use nestrad_service::client::{Client, client};
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{Master, said};
use tokio::net::TcpListener;
use tonic::codec::Streaming;
use tonic::transport::server::TcpIncoming;
use tonic::{Request, Response, Status};
use v1::result_slice::Part;

/// A master whose every solve had a finer round that failed: another does the work.
struct Unlucky(Client);

impl Unlucky {
    /// Serves at a free port, for as long as the runtime lives.
    async fn serve(behind: &Master) -> SocketAddr {
        let other = client(connect(&behind.url(), &Credentials::default()).unwrap());
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let serving = tonic::transport::Server::builder()
            .add_service(SolveServiceServer::new(Self(other)))
            .serve_with_incoming(TcpIncoming::from(listener));
        tokio::spawn(serving);
        address
    }
}

fn unlucky(mut slice: v1::ResultSlice) -> v1::ResultSlice {
    if let Some(Part::Summary(summary)) = &mut slice.part {
        let mut plan: serde_json::Value = serde_json::from_str(&summary.plan_json).unwrap();
        plan["accuracy"]["ended"] = "failed".into();
        plan["accuracy"]["failure"] = "out of paper".into();
        summary.plan_json = plan.to_string();
    }
    slice
}

type Answer<T> = Result<Response<T>, Status>;
type Slices = tokio_stream::Iter<std::vec::IntoIter<Result<v1::ResultSlice, Status>>>;

#[tonic::async_trait]
impl SolveService for Unlucky {
    async fn upload_scene(
        &self,
        request: Request<Streaming<v1::SceneSlice>>,
    ) -> Answer<v1::UploadSceneResponse> {
        let (mut stream, mut slices) = (request.into_inner(), Vec::new());
        while let Some(slice) = stream.message().await? {
            slices.push(slice);
        }
        self.0
            .clone()
            .upload_scene(tokio_stream::iter(slices))
            .await
    }

    async fn start_solve(
        &self,
        request: Request<v1::StartSolveRequest>,
    ) -> Answer<v1::StartSolveResponse> {
        self.0.clone().start_solve(request.into_inner()).await
    }

    type WatchSolveStream = Streaming<v1::SolveProgress>;

    async fn watch_solve(
        &self,
        request: Request<v1::WatchSolveRequest>,
    ) -> Answer<Self::WatchSolveStream> {
        self.0.clone().watch_solve(request.into_inner()).await
    }

    type FetchResultsStream = Slices;

    async fn fetch_results(
        &self,
        request: Request<v1::FetchResultsRequest>,
    ) -> Answer<Self::FetchResultsStream> {
        let answer = self.0.clone().fetch_results(request.into_inner()).await;
        let (mut stream, mut slices) = (answer?.into_inner(), Vec::new());
        while let Some(slice) = stream.message().await? {
            slices.push(Ok(unlucky(slice)));
        }
        Ok(Response::new(tokio_stream::iter(slices)))
    }

    async fn cancel_solve(
        &self,
        request: Request<v1::CancelSolveRequest>,
    ) -> Answer<v1::CancelSolveResponse> {
        self.0.clone().cancel_solve(request.into_inner()).await
    }

    async fn list_solves(
        &self,
        request: Request<v1::ListSolvesRequest>,
    ) -> Answer<v1::ListSolvesResponse> {
        self.0.clone().list_solves(request.into_inner()).await
    }

    async fn status(&self, request: Request<v1::StatusRequest>) -> Answer<v1::StatusResponse> {
        self.0.clone().status(request.into_inner()).await
    }
}

#[test]
fn results_of_an_earlier_round_have_an_exit_code_of_their_own() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let address = runtime.block_on(Unlucky::serve(&master));
    let url = format!("http://{address}");
    let solve = ["solve", "scene.toml", "--accuracy", "0.7", "--master", &url];
    let output = desk.run(&[&solve[..], &["--out", "out", "--quiet"]].concat());
    let text = said(&output);
    assert_eq!(output.status.code(), Some(3), "{text}");
    let expected = "error: the target error of 0.7 % was missed, because a finer round failed: out of paper; out has \
                    the results of the round before";
    assert!(text.starts_with(expected), "{text}");
    let summary = std::fs::read(desk.path("out").join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    assert_eq!(summary["plan"]["accuracy"]["failure"], "out of paper");
    assert!(desk.path("out/organs.csv").exists());
}

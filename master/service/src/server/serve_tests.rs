use nestrad_proto::access::Access;
use nestrad_proto::connections::ConnectionLimits;
use nestrad_proto::v1;
use nestrad_proto::v1::solve_service_client::SolveServiceClient;
use tonic::Code;
use tonic::transport::Channel;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_check_response::ServingStatus;
use tonic_health::pb::health_client::HealthClient;

use super::*;

/// Nothing that is waited for here takes longer.
const PATIENCE: Duration = Duration::from_secs(60);

/// A leaf over a pattern, black, under a sun.
fn one_leaf() -> [v1::SceneSlice; 3] {
    use v1::scene_slice::Part;
    let geometry = v1::GeometryHeader {
        triangles: 1,
        organs: 1,
        materials: vec![v1::SceneMaterial {
            name: "leaf".to_owned(),
            kind: v1::scene_material::Kind::Leaf.into(),
            solid: None,
        }],
        pattern: Some(v1::PatternRectangle {
            max_x_m: 1.0,
            max_y_m: 1.0,
            ..v1::PatternRectangle::default()
        }),
        soil_z_m: None,
    };
    let header = v1::SceneHeader {
        geometry: Some(v1::scene_header::Geometry::NewGeometry(geometry)),
        bands: vec![v1::BandOptics {
            name: "PAR".to_owned(),
            soil_albedo: 0.0,
            materials: vec![v1::MaterialOptics::default()],
        }],
        sky: None,
        sources: vec![v1::ParallelSource {
            direction_z: -1.0,
            irradiance_w_m2: vec![100.0],
            ..v1::ParallelSource::default()
        }],
    };
    let organs = v1::OrganSlice {
        first: 0,
        id: vec!["blade".to_owned()],
        plant: vec!["plant".to_owned()],
        species: vec!["maize".to_owned()],
    };
    let triangles = v1::TriangleSlice {
        first: 0,
        vertices_m: vec![0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0],
        organ: vec![0],
        material: vec![0],
    };
    [
        Part::Header(header),
        Part::Organs(organs),
        Part::Triangles(triangles),
    ]
    .map(|part| v1::SceneSlice { part: Some(part) })
}

async fn health(channel: Channel) -> ServingStatus {
    let request = HealthCheckRequest::default();
    let answer = HealthClient::new(channel).check(request).await;
    answer.unwrap().into_inner().status()
}

/// A master in this process, of which one part dies as soon as it does something.
async fn of_which_dies(
    part: &str,
) -> (
    Service,
    Channel,
    tokio::task::JoinHandle<Result<(), ServeError>>,
) {
    let limits = ServiceLimits {
        scene_bytes: 1 << 20,
        result_bytes: 1 << 20,
        resident_bytes: 1 << 20,
        solve_GiB: 1.0,
        solves: 1,
        queue: 10,
        drain_s: 60,
    };
    let connections = Connections::new(ConnectionLimits::default());
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let server = Access::default().server(address, &connections).unwrap();
    let service = Service::new(limits, WorkerLimits::default(), None, 1, connections).unwrap();
    service.serve_metrics(TcpListener::bind("127.0.0.1:0").await.unwrap());
    let channel = Channel::from_shared(format!("http://{address}")).unwrap();
    let this = service.clone();
    let runs = async move { this.run(listener, server, std::future::pending()).await };
    let running = tokio::spawn(runs);
    let channel = channel.connect().await.unwrap();
    assert_eq!(health(channel.clone()).await, ServingStatus::Serving);
    service.supervisor.kill(part);
    (service, channel, running)
}

async fn ends_with_a_fault(part: &str, running: tokio::task::JoinHandle<Result<(), ServeError>>) {
    let ended = timeout(PATIENCE, running).await.unwrap().unwrap();
    let expected = format!("internal fault: '{part}' has ended: killed by a test");
    assert_eq!(ended.unwrap_err().to_string(), expected);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_thread_that_solves_and_dies_is_said_and_its_solves_fail_with_a_reason() {
    let (service, channel, running) = of_which_dies("solve-0").await;
    let mut client = SolveServiceClient::new(channel.clone());
    let slices = tokio_stream::iter(one_leaf());
    let scene_id = client
        .upload_scene(slices)
        .await
        .unwrap()
        .into_inner()
        .scene_id;
    let request = v1::StartSolveRequest {
        scene_id,
        options: None,
        sensors: None,
    };
    // one that is computed, and one that waits or comes too late
    let first = client
        .start_solve(request.clone())
        .await
        .unwrap()
        .into_inner();
    let second = client.start_solve(request).await;
    assert!(second.is_ok() || second.unwrap_err().code() == Code::Unavailable);
    let watched = v1::WatchSolveRequest {
        solve_id: first.solve_id,
    };
    let mut progress = client.watch_solve(watched).await.unwrap().into_inner();
    let mut last = v1::SolveProgress::default();
    while let Some(message) = progress.message().await.unwrap() {
        last = message;
    }
    assert_eq!(last.state(), v1::SolveState::Failed);
    assert!(last.reason.contains("internal fault"), "{}", last.reason);
    timeout(PATIENCE, until(|| service.solves.is_idle()))
        .await
        .unwrap();
    // before it goes, or it is gone
    if let Ok(answer) = HealthClient::new(channel)
        .check(HealthCheckRequest::default())
        .await
    {
        assert_eq!(answer.into_inner().status(), ServingStatus::NotServing);
    }
    assert!(service.metrics_text().contains("outcome=\"failed\"} "));
    ends_with_a_fault("solve-0", running).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn every_task_that_dies_stops_the_master_with_its_name() {
    for part in [WATCH, METRICS] {
        let (_, _, running) = of_which_dies(part).await;
        ends_with_a_fault(part, running).await;
    }
}

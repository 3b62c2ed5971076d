//! Calls of a master's client service, each of which is answered within a bounded time.

use std::future::Future;

use nestrad_common::scene::Scene;
use nestrad_engine::plan::Settings;
use nestrad_proto::channel::{Credentials, connect};
use nestrad_proto::v1;
use nestrad_service::client::{self, Client, SolvedThere};

use crate::processes::{Master, PATIENCE};

/// Runs a future to its end, but no longer than [`PATIENCE`].
pub fn block_on<T>(future: impl Future<Output = T>) -> T {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
    let bounded = async { tokio::time::timeout(PATIENCE, future).await };
    runtime.block_on(bounded).unwrap()
}

/// A client without credentials. To be called within a runtime.
pub fn client(master: &Master) -> Client {
    client::client(connect(&master.url(), &Credentials::default()).unwrap())
}

/// A material of that kind.
pub fn material(name: &str, kind: v1::scene_material::Kind) -> v1::SceneMaterial {
    v1::SceneMaterial {
        name: name.to_owned(),
        kind: kind.into(),
        solid: None,
    }
}

/// A scene of one horizontal leaf of 0.5 m² over a pattern of 1 m², black, under 100 W m⁻² from above.
pub fn one_leaf() -> [v1::SceneSlice; 3] {
    use v1::scene_slice::Part;
    let header = v1::SceneHeader {
        geometry: Some(v1::scene_header::Geometry::NewGeometry(
            v1::GeometryHeader {
                triangles: 1,
                organs: 1,
                materials: vec![material("leaf", v1::scene_material::Kind::Leaf)],
                pattern: Some(v1::PatternRectangle {
                    min_x_m: 0.0,
                    min_y_m: 0.0,
                    max_x_m: 1.0,
                    max_y_m: 1.0,
                }),
                soil_z_m: None,
            },
        )),
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

/// Hands in a scene.
pub async fn upload(
    client: &mut Client,
    slices: impl IntoIterator<Item = v1::SceneSlice, IntoIter: Send + 'static>,
) -> Result<v1::UploadSceneResponse, tonic::Status> {
    let slices = tokio_stream::iter(slices);
    Ok(client.upload_scene(slices).await?.into_inner())
}

/// Starts a solve of an uploaded scene.
pub async fn start(client: &mut Client, scene_id: &str, options: v1::SolveOptions) -> String {
    let request = v1::StartSolveRequest {
        scene_id: scene_id.to_owned(),
        options: Some(options),
        sensors: None,
    };
    client
        .start_solve(request)
        .await
        .unwrap()
        .into_inner()
        .solve_id
}

/// Watches a solve until it has ended; gives the last message.
pub async fn ended(client: &mut Client, solve_id: &str) -> v1::SolveProgress {
    let request = v1::WatchSolveRequest {
        solve_id: solve_id.to_owned(),
    };
    let mut progress = client.watch_solve(request).await.unwrap().into_inner();
    let mut last = v1::SolveProgress::default();
    while let Some(message) = progress.message().await.unwrap() {
        last = message;
    }
    last
}

/// Takes all results of a solve, as `nestrad solve --master` does.
pub async fn fetch(client: &mut Client, solve_id: &str) -> Result<(), tonic::Status> {
    for table in [
        v1::ResultTable::Organs,
        v1::ResultTable::Triangles,
        v1::ResultTable::Soil,
        v1::ResultTable::Summary,
    ] {
        let request = v1::FetchResultsRequest {
            solve_id: solve_id.to_owned(),
            table: table.into(),
        };
        let mut slices = client.fetch_results(request).await?.into_inner();
        while slices.message().await?.is_some() {}
    }
    Ok(())
}

/// A whole solve.
pub async fn solve(client: Client, scene: Scene, settings: &Settings) -> SolvedThere {
    let solved = client::solve(client, scene, settings, |_| {}, std::future::pending());
    solved.await.unwrap()
}

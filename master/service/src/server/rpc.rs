//! The methods of the client service.

use std::pin::Pin;
use std::sync::Arc;
use std::time::{Duration, Instant};

use nestrad_proto::v1;
use nestrad_proto::v1::solve_service_server::SolveService;
use tokio::sync::mpsc;
use tokio::time::timeout;
use tokio_stream::wrappers::ReceiverStream;
use tokio_stream::{Stream, StreamExt};
use tonic::{Request, Response, Status, Streaming};
use v1::scene_header::Geometry;
use v1::scene_slice::Part;

use super::caller::Caller;
use super::error::{ErrorCode, ServiceError};
use super::held::HeldCanopy;
use super::identity::Id;
use super::intake::{Upload, lighting, organ_bytes, sensors, settings, triangle_bytes};
use super::metrics::Metrics;
use super::residents::Residents;
use super::scenes::Scenes;
use super::slices;
use super::solve::{Phase, Solve};
use super::solves::{Solves, stopping};
use super::uploads::{Pace, Uploads};
use nestrad_cluster::Cluster;
use nestrad_cluster::scheduler::WorkerCounts;
use nestrad_engine::traced::FailureKind;

/// A client that is awaited is looked after so often.
const LOOK: Duration = Duration::from_secs(1);

/// Watchers are told so often at most.
const TELL_EVERY: Duration = Duration::from_millis(200);

/// All that the methods work on.
#[derive(Debug)]
pub(super) struct Rpc {
    pub(super) scenes: Arc<Scenes>,
    pub(super) solves: Arc<Solves>,
    pub(super) residents: Arc<Residents>,
    pub(super) metrics: Arc<Metrics>,
    pub(super) uploads: Uploads,
    pub(super) workers: Cluster,
    pub(super) most_GiB: f64,
    pub(super) started: Instant,
}

type Answers<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

#[tonic::async_trait]
impl SolveService for Rpc {
    async fn upload_scene(
        &self,
        request: Request<Streaming<v1::SceneSlice>>,
    ) -> Result<Response<v1::UploadSceneResponse>, Status> {
        if self.solves.is_stopping() {
            return Err(stopping().into());
        }
        let caller = Caller::of(&request);
        let mut pace = Pace::begin(self.uploads.place(caller).await?);
        let mut slices = request.into_inner();
        let Some(Part::Header(header)) = next(&mut slices, &mut pace).await? else {
            let message = "the first slice: expected a header, found something else";
            return Err(ServiceError::new(ErrorCode::Invalid, message).into());
        };
        let (geometry, lighting) = match &header.geometry {
            Some(Geometry::NewGeometry(new)) => {
                let upload = Upload::begin(new)?;
                // what is wrong with the light should not wait for a canopy to arrive
                let lighting = lighting(&header, upload.surfaces())?;
                (
                    self.receive(caller, upload, &mut slices, &mut pace).await?,
                    lighting,
                )
            }
            Some(Geometry::GeometryId(id)) => {
                if next(&mut slices, &mut pace).await?.is_some() {
                    let message = "after a header with a geometry_id: expected nothing more";
                    return Err(ServiceError::new(ErrorCode::Invalid, message).into());
                }
                let id = parse(id, "geometry_id")?;
                let surfaces = self.scenes.surfaces(id)?;
                (id, lighting(&header, &surfaces)?)
            }
            None => {
                let message = "header: expected new_geometry or geometry_id, found neither";
                return Err(ServiceError::new(ErrorCode::Invalid, message).into());
            }
        };
        let of_light = lighting.light.warnings(&lighting.optics.names());
        let scene = self.scenes.keep_scene(caller, geometry, lighting)?;
        let facts = facts(scene.geometry());
        let mut warnings = scene.geometry().inspection.warnings.clone();
        warnings.extend(of_light);
        tracing::info!(scene = %scene.id, triangles = facts.triangles, "scene uploaded");
        Ok(Response::new(v1::UploadSceneResponse {
            scene_id: scene.id.to_string(),
            geometry_id: geometry.to_string(),
            facts: Some(facts),
            warnings,
        }))
    }

    async fn start_solve(
        &self,
        request: Request<v1::StartSolveRequest>,
    ) -> Result<Response<v1::StartSolveResponse>, Status> {
        let caller = Caller::of(&request);
        let request = request.into_inner();
        let settings = settings(&request.options.unwrap_or_default(), self.most_GiB)?;
        let scene = self.scenes.scene(parse(&request.scene_id, "scene_id")?)?;
        let sensors = sensors(request.sensors, &scene.geometry().canopy)?;
        let solve = self.solves.start(caller, scene.with(sensors), settings)?;
        Ok(Response::new(v1::StartSolveResponse {
            solve_id: solve.id.to_string(),
        }))
    }

    type WatchSolveStream = ReceiverStream<Result<v1::SolveProgress, Status>>;

    async fn watch_solve(
        &self,
        request: Request<v1::WatchSolveRequest>,
    ) -> Result<Response<Self::WatchSolveStream>, Status> {
        let solve = self.solves.get(&request.into_inner().solve_id)?;
        let (progress, receiver) = mpsc::channel(1);
        tokio::spawn(tell(self.solves.clone(), solve, progress));
        Ok(Response::new(ReceiverStream::new(receiver)))
    }

    type FetchResultsStream = Answers<v1::ResultSlice>;

    async fn fetch_results(
        &self,
        request: Request<v1::FetchResultsRequest>,
    ) -> Result<Response<Self::FetchResultsStream>, Status> {
        let v1::FetchResultsRequest { solve_id, table } = request.into_inner();
        let solve = self.solves.get(&solve_id)?;
        let Phase::Finished(outcome) = solve.phase() else {
            let state = solve.phase().message().as_str_name();
            let message = format!(
                "solve {}: expected a finished solve, found {state}",
                solve.id
            );
            return Err(ServiceError::new(ErrorCode::NotReady, message).into());
        };
        let table = v1::ResultTable::try_from(table).unwrap_or_default();
        let slices = slices::of(outcome, table)?;
        solve.is_fetched();
        let all = solve.clone();
        let slices = slices.inspect(move |_| solve.is_fetched());
        // asked for more after the last slice: it is on its way
        let end = std::iter::from_fn(move || {
            all.has_fetched(table);
            None
        });
        let slices = slices.chain(end).map(Ok);
        Ok(Response::new(Box::pin(tokio_stream::iter(slices))))
    }

    async fn cancel_solve(
        &self,
        request: Request<v1::CancelSolveRequest>,
    ) -> Result<Response<v1::CancelSolveResponse>, Status> {
        let solve = self.solves.get(&request.into_inner().solve_id)?;
        let was_queued = matches!(solve.phase(), Phase::Queued);
        let state = self.solves.cancel(&solve);
        if was_queued && matches!(state, Phase::Cancelled) {
            self.metrics.ended(&state);
        }
        Ok(Response::new(v1::CancelSolveResponse {
            state: state.message().into(),
        }))
    }

    async fn list_solves(
        &self,
        _: Request<v1::ListSolvesRequest>,
    ) -> Result<Response<v1::ListSolvesResponse>, Status> {
        let solves = self.solves.all().iter().map(|solve| solve.info()).collect();
        Ok(Response::new(v1::ListSolvesResponse { solves }))
    }

    async fn status(
        &self,
        _: Request<v1::StatusRequest>,
    ) -> Result<Response<v1::StatusResponse>, Status> {
        let (segments_per_s, rays_per_s) = self.metrics.rates();
        let cluster = self.workers.status();
        let solves = self.solves.all();
        let (traced_canopies, traced_canopy_bytes) = self.residents.count_and_bytes();
        Ok(Response::new(v1::StatusResponse {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            uptime_s: self.started.elapsed().as_secs_f64(),
            workers: cluster.workers.iter().map(worker_info).collect(),
            jobs_waiting: cluster.jobs.waiting as u64,
            jobs_leased: cluster.jobs.leased as u64,
            jobs_done: cluster.jobs.done as u64,
            solves: solves.iter().map(|solve| solve.info()).collect(),
            segments_per_s,
            rays_per_s,
            eta_s: cluster.eta_s(),
            scenes: self.scenes.count() as u64,
            scene_bytes: self.scenes.bytes(),
            result_bytes: self.solves.result_bytes(),
            jobs_audited: cluster.audited,
            traced_canopies: traced_canopies as u64,
            traced_canopy_bytes,
            untrusted_workers: cluster.untrusted.iter().map(|w| w.to_string()).collect(),
        }))
    }
}

fn GiB(bytes: u64) -> f64 {
    bytes as f64 / (1u64 << 30) as f64
}

fn worker_info(worker: &WorkerCounts) -> v1::WorkerInfo {
    v1::WorkerInfo {
        name: worker.facts.name.clone(),
        threads: worker.facts.threads,
        memory_gi_b: GiB(worker.facts.memory_bytes),
        leased: worker.leased as u32,
        done: worker.done,
        lost: worker.lost,
        silent_s: worker.silent.as_secs_f64(),
        needs_memory_gi_b: worker.too_small_for.map(GiB),
    }
}

impl Rpc {
    /// Takes in a geometry that is not held yet; gives its name. Room is made for what has come, never for what was
    /// only announced.
    async fn receive(
        &self,
        caller: Caller,
        mut upload: Upload,
        slices: &mut Streaming<v1::SceneSlice>,
        pace: &mut Pace,
    ) -> Result<Id, ServiceError> {
        self.scenes.could_hold(upload.announced_bytes())?;
        let mut memory = self.scenes.reserve(caller, 0)?;
        while !upload.is_complete() {
            match next(slices, pace).await? {
                Some(Part::Organs(slice)) => {
                    memory.join(self.scenes.reserve(caller, organ_bytes(&slice))?);
                    upload.organs(slice)?;
                }
                Some(Part::Triangles(slice)) => {
                    memory.join(self.scenes.reserve(caller, triangle_bytes(&slice))?);
                    upload.triangles(&slice)?;
                }
                Some(Part::Header(_)) => {
                    let message = "after the header: expected organs or triangles, found a header";
                    return Err(ServiceError::new(ErrorCode::Invalid, message));
                }
                None => break,
            }
        }
        let checked = tokio::task::spawn_blocking(move || upload.finish()).await;
        let geometry =
            checked.map_err(|_| ServiceError::new(ErrorCode::Internal, "internal fault"))??;
        let id = geometry.id;
        self.scenes.keep_geometry(geometry, memory);
        Ok(id)
    }
}

/// The next part of a scene; none at its end.
async fn next(
    slices: &mut Streaming<v1::SceneSlice>,
    pace: &mut Pace,
) -> Result<Option<Part>, ServiceError> {
    let slice = loop {
        pace.check()?;
        if let Ok(slice) = timeout(LOOK, slices.next()).await {
            break slice;
        }
    };
    let slice = slice.transpose().map_err(|status| {
        // an encoding that cannot be read, a message that is too large, a client that is gone
        ServiceError::new(ErrorCode::Invalid, status.message())
    })?;
    let part = match slice.map(|slice| slice.part) {
        Some(None) => {
            let message = "slice: expected organs or triangles, found nothing";
            return Err(ServiceError::new(ErrorCode::Invalid, message));
        }
        part => part.flatten(),
    };
    pace.arrived(match &part {
        Some(Part::Organs(slice)) => organ_bytes(slice),
        Some(Part::Triangles(slice)) => triangle_bytes(slice),
        Some(Part::Header(_)) | None => 0,
    });
    Ok(part)
}

/// Tells a watcher how a solve goes on, until it has ended or nobody listens.
async fn tell(
    solves: Arc<Solves>,
    solve: Arc<Solve>,
    watcher: mpsc::Sender<Result<v1::SolveProgress, Status>>,
) {
    let mut states = solve.watch();
    let mut told_plan = false;
    let mut last = v1::SolveProgress::default();
    loop {
        let state = states.borrow_and_update().clone();
        let stage = solve.progress.now();
        let mut now = v1::SolveProgress {
            state: state.message().into(),
            ahead: match state {
                Phase::Queued => solves.ahead_of(&solve),
                _ => 0,
            },
            stage: stage.name,
            done: stage.done,
            total: stage.total,
            plan: Vec::new(),
            reason: match &state {
                Phase::Failed(_, reason) => reason.clone(),
                _ => String::new(),
            },
            failure: match &state {
                Phase::Failed(kind, _) => failure(*kind).into(),
                _ => v1::SolveFailure::Unspecified.into(),
            },
        };
        if !told_plan {
            now.plan = solve.plan();
            told_plan = !now.plan.is_empty();
        }
        if now != last {
            last = v1::SolveProgress {
                plan: Vec::new(),
                ..now.clone()
            };
            if watcher.send(Ok(now)).await.is_err() {
                return;
            }
        }
        if matches!(state, Phase::Failed(..)) {
            solve.is_told();
        }
        if state.has_ended() {
            return;
        }
        tokio::select! {
            changed = states.changed() => {
                if changed.is_err() {
                    return;
                }
            }
            () = tokio::time::sleep(TELL_EVERY) => {}
            () = watcher.closed() => return,
        }
    }
}

fn failure(kind: FailureKind) -> v1::SolveFailure {
    match kind {
        FailureKind::Input => v1::SolveFailure::Input,
        FailureKind::Limit => v1::SolveFailure::Limit,
        FailureKind::Fault => v1::SolveFailure::Fault,
        // told as a state of its own
        FailureKind::Cancelled => v1::SolveFailure::Unspecified,
    }
}

fn parse(text: &str, field: &str) -> Result<Id, ServiceError> {
    Id::parse(text).ok_or_else(|| {
        let found: String = text.chars().take(40).flat_map(char::escape_debug).collect();
        let found = format!("'{found}'");
        ServiceError::invalid(field, "32 hexadecimal digits", found)
    })
}

fn facts(held: &HeldCanopy) -> v1::SceneFacts {
    let facts = &held.inspection;
    let vector = |[x, y, z]: [f64; 3]| Some(v1::Vector { x, y, z });
    v1::SceneFacts {
        triangles: facts.triangles as u64,
        organs: facts.organs as u64,
        plants: facts.plants as u64,
        lower_m: vector(facts.lower_m),
        upper_m: vector(facts.upper_m),
        area_index: facts.area_index,
        degenerate: facts.degenerate as u64,
        duplicates: facts.duplicates as u64,
        below_soil: facts.below_soil as u64,
        overhang_m: facts.overhang_m,
    }
}

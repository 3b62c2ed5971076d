//! A solve at a master elsewhere: it is handed the scene, watched, and asked for the results, which are
//! the same to the last bit as if they were computed here.
//!
//! A master that is lost is looked for again; one that has forgotten scene or solve (it was started
//! anew, or had no room) gets them once more. Both end after a time, or after a few rounds. One that has no room for
//! the scene or the solve is asked again when it says, for a longer time.

mod error;
mod on_the_way;
mod results;
mod sensors;
mod setback;
mod solved;
mod upload;

use std::time::{Duration, Instant};

use nestrad_common::options::{Diameter, Scatter};
use nestrad_common::scene::Scene;
use nestrad_engine::plan::{DEFAULT_ACCURACY_PERCENT, Estimator, Settings};
use nestrad_engine::progress::StageProgress;
use nestrad_engine::traced::FailureKind;
use nestrad_proto::channel::Authorized;
use nestrad_proto::v1::solve_service_client::SolveServiceClient;
use nestrad_proto::{MAX_MESSAGE_BYTES, reason, v1};
use tokio::time::{sleep, timeout};
use tonic::{Code, Status};

pub use error::{RefusalKind, RemoteError};
use on_the_way::OnTheWay;
use results::Arriving;
use setback::{Setback, retry_after};
pub use solved::SolvedThere;

/// A master that was never reached is given up after this.
const FIRST_PATIENCE: Duration = Duration::from_secs(10);

/// A master that was reached is given up when it was away for so long.
const PATIENCE: Duration = Duration::from_secs(60);

/// A master that has no room is asked for so long. Longer than it keeps results that nobody fetches.
const BUSY_PATIENCE: Duration = Duration::from_secs(15 * 60);

/// It is asked again after this at most, whatever it says.
const LONGEST_PAUSE: Duration = Duration::from_secs(60);

/// Pause between two tries.
const PAUSE: Duration = Duration::from_millis(500);

/// An answer that comes at once, but for the network, comes within this.
const ANSWER: Duration = Duration::from_secs(60);

/// A master that took the scene, or was about to give the results, so often and then failed will fail
/// the next time.
const MOST_ROUNDS: u32 = 8;

/// A stream of progress that ends sooner than this, and tells nothing new, is no good.
const SHORT: Duration = Duration::from_secs(10);

/// So many of them after one another, and so will be the next.
const MOST_SHORT: u32 = 10;

/// A master.
pub type Client = SolveServiceClient<Authorized>;

/// The client service at the other end of a channel.
pub fn client(channel: Authorized) -> Client {
    SolveServiceClient::new(channel)
        .max_decoding_message_size(MAX_MESSAGE_BYTES)
        .max_encoding_message_size(MAX_MESSAGE_BYTES)
}

/// What is to be told while a solve goes on.
#[derive(Clone, Debug)]
pub enum Event {
    /// A line of the plan.
    Plan(String),
    /// Something that the user may want to know.
    Note(String),
    /// How far it is.
    Stage(StageProgress),
}

/// Solves at a master, and cancels the solve there when `stop` comes first.
pub async fn solve(
    master: Client,
    scene: Scene,
    settings: &Settings,
    mut tell: impl FnMut(Event),
    stop: impl Future<Output = ()>,
) -> Result<SolvedThere, RemoteError> {
    let mut session = Session {
        master,
        scene,
        options: options(settings),
        geometry_id: None,
        scene_id: None,
        solve_id: None,
        heard: None,
        busy: None,
        rounds: 0,
        told: None,
        short: 0,
    };
    tokio::select! {
        outcome = session.solve(&mut tell) => outcome,
        () = stop => {
            session.cancel().await;
            Err(RemoteError::Cancelled)
        }
    }
}

fn options(settings: &Settings) -> v1::SolveOptions {
    let estimator = match settings.estimator {
        Estimator::Lines => v1::Estimator::Lines,
        Estimator::Rays => v1::Estimator::Rays,
    };
    let scatter = match settings.scatter {
        Scatter::All => v1::Scatter::All,
        Scatter::None => v1::Scatter::None,
    };
    v1::SolveOptions {
        diameter_m: match settings.diameter {
            Diameter::Auto => None,
            Diameter::Infinite => Some(f64::INFINITY),
            Diameter::Metres(metres) => Some(metres),
        },
        // what is asked for is reached in rounds
        accuracy_percent: Some(settings.accuracy_percent)
            .filter(|&a| settings.in_rounds || a != DEFAULT_ACCURACY_PERCENT),
        memory_gi_b: Some(settings.memory_GiB),
        seed: Some(settings.seed),
        estimator: estimator.into(),
        budget_s: settings.budget_s,
        scatter: scatter.into(),
    }
}

/// What kind of thing went wrong at the master; one of an earlier version does not say.
fn kind(sent: v1::SolveFailure) -> FailureKind {
    match sent {
        v1::SolveFailure::Input => FailureKind::Input,
        v1::SolveFailure::Limit => FailureKind::Limit,
        v1::SolveFailure::Fault | v1::SolveFailure::Unspecified => FailureKind::Fault,
    }
}

/// What is known of the solve at the master.
struct Session {
    master: Client,
    scene: Scene,
    options: v1::SolveOptions,
    geometry_id: Option<String>,
    scene_id: Option<String>,
    solve_id: Option<String>,
    /// When the master last answered.
    heard: Option<Instant>,
    /// Since when it has had no room.
    busy: Option<Instant>,
    /// How often it took the scene, or was about to give the results.
    rounds: u32,
    /// What was last told of the solve.
    told: Option<v1::SolveProgress>,
    /// How many streams of progress ended soon, without telling anything new, since one did.
    short: u32,
}

impl Session {
    async fn solve(&mut self, tell: &mut impl FnMut(Event)) -> Result<SolvedThere, RemoteError> {
        let begun = Instant::now();
        let (mut told, mut told_busy) = (false, false);
        loop {
            let status = match self.attempt(tell).await {
                Ok(solved) => return Ok(solved),
                Err(Setback::Final(error)) => return Err(error),
                Err(Setback::Busy {
                    doing,
                    status,
                    wait,
                }) => {
                    self.wait(doing, &status, wait, |note| {
                        if !std::mem::replace(&mut told_busy, true) {
                            tell(Event::Note(note));
                        }
                    })
                    .await?;
                    continue;
                }
                Err(Setback::Forgotten(status)) => {
                    (self.scene_id, self.solve_id) = (None, None);
                    status
                }
                Err(Setback::Away(status)) => status,
            };
            let message = reason::of(&status);
            let (since, patience) = match self.heard {
                Some(heard) => (heard, PATIENCE),
                None => (begun, FIRST_PATIENCE),
            };
            if since.elapsed() > patience || self.rounds > MOST_ROUNDS || self.short > MOST_SHORT {
                return Err(RemoteError::Lost { message });
            }
            if !told {
                told = true;
                tell(Event::Note(format!(
                    "the master cannot be reached ({message}): trying again"
                )));
            }
            sleep(PAUSE).await;
        }
    }

    /// Waits for a master that has no room, if it is not asked for too long.
    async fn wait(
        &mut self,
        doing: &'static str,
        status: &Status,
        wait: Duration,
        tell: impl FnOnce(String),
    ) -> Result<(), RemoteError> {
        let since = *self.busy.get_or_insert_with(Instant::now);
        // what it forgets meanwhile is no fault of its
        self.rounds = 0;
        // clients that were refused together do not come back together
        let apart = Duration::from_millis(u64::from(std::process::id() % 1000));
        let wait = wait.min(LONGEST_PAUSE) + apart;
        let message = status.message().to_owned();
        if since.elapsed() + wait > BUSY_PATIENCE {
            let waited_s = since.elapsed().as_secs();
            return Err(RemoteError::Busy {
                doing,
                message,
                waited_s,
            });
        }
        let minutes = BUSY_PATIENCE.as_secs() / 60;
        tell(format!(
            "the master has no room ({message}): trying again for {minutes} minutes"
        ));
        sleep(wait).await;
        Ok(())
    }

    async fn attempt(&mut self, tell: &mut impl FnMut(Event)) -> Result<SolvedThere, Setback> {
        let solve_id = match &self.solve_id {
            Some(id) => id.clone(),
            None => {
                let scene_id = match &self.scene_id {
                    Some(id) => id.clone(),
                    None => {
                        let id = self.upload().await?;
                        self.rounds += 1;
                        self.scene_id.insert(id).clone()
                    }
                };
                let id = self.start(scene_id).await?;
                self.busy = None;
                self.solve_id.insert(id).clone()
            }
        };
        self.watch(&solve_id, tell).await?;
        self.rounds += 1;
        self.fetch(&solve_id).await
    }

    async fn upload(&mut self) -> Result<String, Setback> {
        let way = OnTheWay::begin();
        let answer = match &self.geometry_id {
            Some(id) => {
                let slice = upload::known(&self.scene, id);
                let slices = tokio_stream::once(slice);
                way.answer(self.master.upload_scene(slices)).await
            }
            None => {
                let goes = way.clone();
                let slices = upload::slices(&self.scene).inspect(move |slice| goes.goes(slice));
                let slices = tokio_stream::iter(slices);
                way.answer(self.master.upload_scene(slices)).await
            }
        };
        match self.answered("take the scene", answer) {
            Ok(response) => {
                let response = response.into_inner();
                self.geometry_id = Some(response.geometry_id);
                Ok(response.scene_id)
            }
            Err(setback) => {
                if matches!(setback, Setback::Forgotten(_)) {
                    self.geometry_id = None;
                }
                Err(setback)
            }
        }
    }

    async fn start(&mut self, scene_id: String) -> Result<String, Setback> {
        let request = v1::StartSolveRequest {
            scene_id,
            options: Some(self.options),
            sensors: sensors::list(&self.scene.sensors),
        };
        let answer = timeout(ANSWER, self.master.start_solve(request)).await;
        let response = self.answered("start the solve", answer)?;
        Ok(response.into_inner().solve_id)
    }

    /// Until it has finished.
    async fn watch(&mut self, id: &str, tell: &mut impl FnMut(Event)) -> Result<(), Setback> {
        let doing = "watch the solve";
        let request = v1::WatchSolveRequest {
            solve_id: id.to_owned(),
        };
        let answer = timeout(ANSWER, self.master.watch_solve(request)).await;
        let mut progress = self.answered(doing, answer)?.into_inner();
        let (begun, mut news) = (Instant::now(), false);
        loop {
            let message = progress.message().await;
            if !matches!(message, Ok(Some(_))) {
                let is_short = !news && begun.elapsed() < SHORT;
                self.short = if is_short { self.short + 1 } else { 0 };
            }
            let message = match message {
                Ok(Some(message)) => message,
                Ok(None) => {
                    return Err(Setback::Away(Status::unavailable(
                        "the stream of progress ended before the solve",
                    )));
                }
                Err(status) => return Err(self.setback(doing, status)),
            };
            self.heard = Some(Instant::now());
            let (state, failure) = (message.state(), message.failure());
            let told = v1::SolveProgress {
                // told at the beginning of every stream
                plan: Vec::new(),
                ..message.clone()
            };
            news |= self.told.as_ref() != Some(&told);
            self.told = Some(told);
            for line in message.plan {
                tell(Event::Plan(line));
            }
            match state {
                v1::SolveState::Finished => return Ok(()),
                v1::SolveState::Failed => {
                    let kind = kind(failure);
                    let reason = message.reason;
                    return Err(RemoteError::Failed { reason, kind }.into());
                }
                v1::SolveState::Cancelled => return Err(RemoteError::Cancelled.into()),
                _ => tell(Event::Stage(StageProgress {
                    name: message.stage,
                    done: message.done,
                    total: message.total,
                })),
            }
        }
    }

    async fn fetch(&mut self, id: &str) -> Result<SolvedThere, Setback> {
        let doing = "give out the results";
        let scene = self.scene.clone();
        let mut arriving = Arriving::new(&scene);
        let tables = [
            v1::ResultTable::Organs,
            v1::ResultTable::Triangles,
            v1::ResultTable::Soil,
            v1::ResultTable::Sensors,
            v1::ResultTable::Summary,
        ];
        // a master of an earlier version knows no sensors
        let wanted = |table: &v1::ResultTable| {
            *table != v1::ResultTable::Sensors || !scene.sensors.is_empty()
        };
        for table in tables.into_iter().filter(wanted) {
            let request = v1::FetchResultsRequest {
                solve_id: id.to_owned(),
                table: table.into(),
            };
            let answer = timeout(ANSWER, self.master.fetch_results(request)).await;
            let mut slices = self.answered(doing, answer)?.into_inner();
            loop {
                let answer = timeout(ANSWER, slices.message()).await;
                let Some(slice) = self.answered(doing, answer)? else {
                    break;
                };
                arriving.take(slice)?;
            }
        }
        Ok(arriving.finish()?)
    }

    /// Says that the solve is not wanted any more. Whether that arrives makes no difference here.
    async fn cancel(&mut self) {
        if let Some(solve_id) = self.solve_id.take() {
            let request = v1::CancelSolveRequest { solve_id };
            let _ = timeout(FIRST_PATIENCE, self.master.cancel_solve(request)).await;
        }
    }

    fn answered<T>(
        &mut self,
        doing: &'static str,
        answer: Result<Result<T, Status>, tokio::time::error::Elapsed>,
    ) -> Result<T, Setback> {
        match answer {
            Ok(Ok(response)) => {
                self.heard = Some(Instant::now());
                Ok(response)
            }
            Ok(Err(status)) => Err(self.setback(doing, status)),
            Err(_) => Err(Setback::Away(Status::unavailable("no answer"))),
        }
    }

    fn setback(&mut self, doing: &'static str, status: Status) -> Setback {
        if let Some(message) = reason::of_credentials(&status) {
            return Setback::Final(RemoteError::Credentials { message });
        }
        match status.code() {
            // what the transport says of a connection that broke
            Code::Unavailable | Code::Unknown | Code::Cancelled | Code::Internal => {
                Setback::Away(status)
            }
            Code::NotFound => {
                self.heard = Some(Instant::now());
                Setback::Forgotten(status)
            }
            _ => match retry_after(&status) {
                Some(wait) => {
                    self.heard = Some(Instant::now());
                    Setback::Busy {
                        doing,
                        status,
                        wait,
                    }
                }
                None => Setback::Final(RemoteError::Refused {
                    doing,
                    kind: RefusalKind::of(status.code()),
                    message: status.message().to_owned(),
                }),
            },
        }
    }
}

//! What operators watch: counters that go up as things happen, gauges that are read when asked for.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use nestrad_proto::connections::Traffic;
use nestrad_proto::{log, v1};
use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::Registry;

use super::solve::Phase;
use nestrad_cluster::ClusterStatus;

/// Rates are means over this time.
const RATE_OVER: Duration = Duration::from_secs(60);

/// All metrics of a master.
#[derive(Debug)]
pub struct Metrics {
    registry: Registry,
    solves: Family<OfOutcome, Counter>,
    lines: Counter,
    segments: Counter,
    rays: Counter,
    stage_s: Family<OfStage, Counter<f64, AtomicU64>>,
    held: Held,
    recent: Mutex<VecDeque<TracedJobs>>,
}

/// Set when they are asked for.
#[derive(Debug, Default)]
struct Held {
    solves: Family<OfState, Gauge>,
    scenes: Gauge,
    scene_bytes: Gauge,
    traced_canopies: Gauge,
    traced_canopy_bytes: Gauge,
    result_bytes: Gauge,
    workers: Gauge,
    worker_threads: Gauge,
    jobs: Family<OfState, Gauge>,
    worker_results: Counter,
    worker_results_refused: Counter,
    leases_lost: Counter,
    jobs_audited: Counter,
    workers_untrusted: Gauge,
    row_bytes: Counter,
    block_bytes: Counter,
    memory_bytes: Gauge,
    open_files: Gauge<i64, AtomicI64>,
    network_bytes: Family<OfDirection, Counter>,
    connections: Gauge,
    turned_away: Counter,
    log_lines_dropped: Counter,
}

/// What is held at a moment.
#[derive(Clone, Debug, Default)]
pub(super) struct Now {
    pub(super) queued: usize,
    pub(super) running: usize,
    pub(super) ended: usize,
    pub(super) scenes: usize,
    pub(super) scene_bytes: u64,
    pub(super) traced_canopies: usize,
    pub(super) traced_canopy_bytes: u64,
    pub(super) result_bytes: u64,
    pub(super) workers: ClusterStatus,
    pub(super) traffic: Traffic,
}

#[derive(Clone, Copy, Debug)]
struct TracedJobs {
    at: Instant,
    segments: u64,
    rays: u64,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct OfOutcome {
    outcome: &'static str,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct OfState {
    state: &'static str,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct OfStage {
    stage: String,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct OfDirection {
    direction: &'static str,
}

impl Default for Metrics {
    fn default() -> Self {
        let mut metrics = Self {
            registry: Registry::with_prefix("nestrad"),
            solves: Family::default(),
            lines: Counter::default(),
            segments: Counter::default(),
            rays: Counter::default(),
            stage_s: Family::default(),
            held: Held::default(),
            recent: Mutex::default(),
        };
        metrics.register();
        metrics
    }
}

impl Metrics {
    fn register(&mut self) {
        let registry = &mut self.registry;
        let held = &self.held;
        registry.register(
            "solves_ended",
            "Solves that have ended",
            self.solves.clone(),
        );
        registry.register("solves", "Solves that are known", held.solves.clone());
        registry.register(
            "lines",
            "Parallel lines that were traced",
            self.lines.clone(),
        );
        registry.register(
            "segments",
            "Segments between hits that were traced",
            self.segments.clone(),
        );
        registry.register("rays", "Rays that were cast", self.rays.clone());
        registry.register(
            "stage_seconds",
            "Wall clock of the stages of finished solves",
            self.stage_s.clone(),
        );
        registry.register(
            "network_bytes",
            "Bytes on connections, encryption included",
            held.network_bytes.clone(),
        );
        registry.register("connections", "Open connections", held.connections.clone());
        registry.register(
            "connections_turned_away",
            "Connections that were closed before a call was let in",
            held.turned_away.clone(),
        );
        registry.register(
            "log_lines_dropped",
            "Lines of the log that could not be written",
            held.log_lines_dropped.clone(),
        );
        registry.register("scenes", "Scenes that are held", held.scenes.clone());
        registry.register(
            "scene_bytes",
            "Memory of all scenes that are held or in use",
            held.scene_bytes.clone(),
        );
        registry.register(
            "traced_canopies",
            "Canopies that stay traced for another light",
            held.traced_canopies.clone(),
        );
        registry.register(
            "traced_canopy_bytes",
            "Memory of all canopies that stay traced",
            held.traced_canopy_bytes.clone(),
        );
        registry.register(
            "result_bytes",
            "Memory of all results that are held",
            held.result_bytes.clone(),
        );
        registry.register(
            "workers",
            "Workers that are connected",
            held.workers.clone(),
        );
        registry.register(
            "worker_threads",
            "Jobs that all workers compute at a time",
            held.worker_threads.clone(),
        );
        registry.register(
            "jobs",
            "Near-field jobs of running solves",
            held.jobs.clone(),
        );
        registry.register(
            "worker_results",
            "Results of workers that were used",
            held.worker_results.clone(),
        );
        registry.register(
            "worker_results_refused",
            "Results of workers that were refused",
            held.worker_results_refused.clone(),
        );
        registry.register(
            "leases_lost",
            "Jobs that workers lost or failed",
            held.leases_lost.clone(),
        );
        registry.register(
            "jobs_audited",
            "Jobs of workers that the master computed again",
            held.jobs_audited.clone(),
        );
        registry.register(
            "workers_untrusted",
            "Workers that returned wrong rows, and are refused",
            held.workers_untrusted.clone(),
        );
        registry.register(
            "row_bytes",
            "Packed rows that came from workers",
            held.row_bytes.clone(),
        );
        registry.register(
            "block_bytes",
            "Blocks that were sent to workers",
            held.block_bytes.clone(),
        );
        registry.register(
            "resident_memory_bytes",
            "Resident memory of the master",
            held.memory_bytes.clone(),
        );
        registry.register(
            "open_files",
            "Open files and sockets",
            held.open_files.clone(),
        );
    }

    /// A solve has ended.
    pub(super) fn ended(&self, state: &Phase) {
        let outcome = match state {
            Phase::Finished(_) => "finished",
            Phase::Failed(..) => "failed",
            Phase::Queued | Phase::Running | Phase::Cancelled => "cancelled",
        };
        self.solves.get_or_create(&OfOutcome { outcome }).inc();
    }

    /// A solve has finished.
    pub(super) fn solved(&self, summary: &v1::SolveSummary) {
        self.lines.inc_by(summary.lines);
        self.segments.inc_by(summary.segments);
        self.rays.inc_by(summary.rays);
        for cost in &summary.stages {
            let stage = cost.name.clone();
            self.stage_s
                .get_or_create(&OfStage { stage })
                .inc_by(cost.wall_s);
        }
        let mut recent = self.recent();
        recent.push_back(TracedJobs {
            at: Instant::now(),
            segments: summary.segments,
            rays: summary.rays,
        });
    }

    /// Segments and rays per second, over the last minute.
    pub(super) fn rates(&self) -> (f64, f64) {
        let recent = self.recent();
        let per_s = |of: fn(&TracedJobs) -> u64| {
            recent.iter().map(of).sum::<u64>() as f64 / RATE_OVER.as_secs_f64()
        };
        (per_s(|traced| traced.segments), per_s(|traced| traced.rays))
    }

    fn recent(&self) -> std::sync::MutexGuard<'_, VecDeque<TracedJobs>> {
        let mut recent = self.recent.lock().unwrap_or_else(PoisonError::into_inner);
        while recent
            .front()
            .is_some_and(|traced| traced.at.elapsed() > RATE_OVER)
        {
            recent.pop_front();
        }
        recent
    }

    /// All of it as Prometheus reads it.
    pub(super) fn text(&self, now: &Now) -> String {
        let held = &self.held;
        for (state, count) in [
            ("queued", now.queued),
            ("running", now.running),
            ("ended", now.ended),
        ] {
            let gauge = held.solves.get_or_create(&OfState { state });
            gauge.set(count as i64);
        }
        held.scenes.set(now.scenes as i64);
        held.scene_bytes.set(now.scene_bytes as i64);
        held.traced_canopies.set(now.traced_canopies as i64);
        let bytes = now.traced_canopy_bytes as i64;
        held.traced_canopy_bytes.set(bytes);
        held.result_bytes.set(now.result_bytes as i64);
        held.cluster(&now.workers);
        held.traffic(&now.traffic);
        set(&held.log_lines_dropped, log::dropped_lines());
        held.memory_bytes.set(resident_bytes().unwrap_or(0));
        held.open_files.set(open_files().unwrap_or(0));
        let mut text = String::new();
        // writing to a string does not fail
        let _ = encode(&mut text, &self.registry);
        text
    }
}

impl Held {
    fn cluster(&self, now: &ClusterStatus) {
        self.workers.set(now.workers.len() as i64);
        let threads: i64 = now.workers.iter().map(|w| i64::from(w.facts.threads)).sum();
        self.worker_threads.set(threads);
        self.workers_untrusted.set(now.untrusted.len() as i64);
        for (state, count) in [
            ("waiting", now.jobs.waiting),
            ("leased", now.jobs.leased),
            ("done", now.jobs.done),
        ] {
            let gauge = self.jobs.get_or_create(&OfState { state });
            gauge.set(count as i64);
        }
        for (counter, total) in [
            (&self.worker_results, now.results),
            (&self.worker_results_refused, now.refused),
            (&self.leases_lost, now.lost),
            (&self.jobs_audited, now.audited),
            (&self.row_bytes, now.bytes_in),
            (&self.block_bytes, now.bytes_out),
        ] {
            set(counter, total);
        }
    }

    fn traffic(&self, now: &Traffic) {
        self.connections.set(now.open as i64);
        set(&self.turned_away, now.turned_away);
        for (direction, total) in [("received", now.received), ("sent", now.sent)] {
            let of = OfDirection { direction };
            set(&self.network_bytes.get_or_create(&of), total);
        }
    }
}

/// What is counted elsewhere.
fn set(counter: &Counter, total: u64) {
    counter.inner().store(total, Ordering::Relaxed);
}

/// Memory of this process that is resident now.
fn resident_bytes() -> Option<i64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kibibytes: i64 = line.trim().strip_suffix("kB")?.trim_end().parse().ok()?;
    kibibytes.checked_mul(1024)
}

/// Files and sockets that this process has open.
fn open_files() -> Option<i64> {
    let entries = std::fs::read_dir("/proc/self/fd").ok()?;
    i64::try_from(entries.count()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_has_what_happened() {
        let metrics = Metrics::default();
        metrics.solved(&v1::SolveSummary {
            segments: 120,
            stages: vec![v1::StageCost {
                name: "direct light".to_owned(),
                wall_s: 1.5,
                cpu_s: 2.0,
            }],
            ..v1::SolveSummary::default()
        });
        metrics.ended(&Phase::Cancelled);
        let text = metrics.text(&Now {
            queued: 3,
            ..Now::default()
        });
        for line in [
            "nestrad_segments_total 120",
            "nestrad_stage_seconds_total{stage=\"direct light\"} 1.5",
            "nestrad_solves_ended_total{outcome=\"cancelled\"} 1",
            "nestrad_solves{state=\"queued\"} 3",
        ] {
            assert!(text.contains(line), "{line}: {text}");
        }
        assert_eq!(metrics.rates(), (2.0, 0.0));
    }
}

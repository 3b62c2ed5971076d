//! What a run costs: wall clock, processor time and memory of this process.

use std::time::Instant;

use serde::{Deserialize, Serialize};

/// The cost of a named stage of a run.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Stage {
    /// What was done.
    pub name: String,
    /// Seconds that passed.
    pub wall_s: f64,
    /// Processor seconds, user and system, of all threads.
    pub cpu_s: f64,
}

/// Cost so far of a whole run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Usage {
    /// Seconds that passed.
    pub wall_s: f64,
    /// Processor seconds, user and system, of all threads.
    pub cpu_s: f64,
    /// The most memory that was resident at any time, bytes; absent where the system does not tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_memory_bytes: Option<u64>,
}

/// Measures stages that follow one another.
#[derive(Debug)]
pub struct Stopwatch {
    begun: Moment,
    last: Moment,
    stages: Vec<Stage>,
}

#[derive(Clone, Copy, Debug)]
struct Moment {
    wall: Instant,
    cpu_s: f64,
}

impl Moment {
    fn now() -> Self {
        Self {
            wall: Instant::now(),
            cpu_s: cpu_seconds(),
        }
    }
}

impl Stopwatch {
    /// Starts the first stage.
    pub fn start() -> Self {
        let now = Moment::now();
        Self {
            begun: now,
            last: now,
            stages: Vec::new(),
        }
    }

    /// Ends the running stage, which is now known as `name`, and starts the next.
    pub fn lap(&mut self, name: impl Into<String>) {
        let now = Moment::now();
        self.stages.push(Stage {
            name: name.into(),
            wall_s: (now.wall - self.last.wall).as_secs_f64(),
            cpu_s: now.cpu_s - self.last.cpu_s,
        });
        self.last = now;
    }

    /// The stages that have ended.
    pub fn stages(&self) -> &[Stage] {
        &self.stages
    }

    /// All since the start, and the peak memory of the process.
    pub fn usage(&self) -> Usage {
        let now = Moment::now();
        Usage {
            wall_s: (now.wall - self.begun.wall).as_secs_f64(),
            cpu_s: now.cpu_s - self.begun.cpu_s,
            peak_memory_bytes: peak_memory_bytes(),
        }
    }
}

/// Processor seconds, user and system, that all threads of this process have used; 0 where the
/// system does not tell.
pub fn cpu_seconds() -> f64 {
    #[cfg(unix)]
    {
        // nanoseconds, where /proc/self/stat counts hundredths of a second
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
    }
    #[cfg(not(unix))]
    {
        0.0
    }
}

/// The most memory that this process ever had resident, bytes.
pub fn peak_memory_bytes() -> Option<u64> {
    peak_in(&std::fs::read_to_string("/proc/self/status").ok()?)
}

/// Begins the peak anew with what is resident now, or says that the system does not do so.
pub fn forget_peak_memory() -> bool {
    // see clear_refs in proc(5)
    std::fs::write("/proc/self/clear_refs", "5").is_ok()
}

fn peak_in(status: &str) -> Option<u64> {
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim_end().parse().ok()?;
    kibibytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peak_memory_is_read_from_the_status_page() {
        let status = "Name:\tnestrad\nVmPeak:\t  900 kB\nVmHWM:\t    1234 kB\nVmRSS:\t 1 kB\n";
        assert_eq!(peak_in(status), Some(1234 * 1024));
        assert_eq!(peak_in("Name:\tnestrad\n"), None);
        assert_eq!(peak_in("VmHWM:\tmuch\n"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn work_takes_time_and_memory() {
        let mut watch = Stopwatch::start();
        let mut sum = 0_u64;
        while watch.usage().cpu_s < 0.02 {
            sum = std::hint::black_box(sum.wrapping_add(1));
        }
        watch.lap("work");
        watch.lap("nothing");
        let [work, nothing] = watch.stages() else {
            panic!("two stages")
        };
        assert_eq!(work.name, "work");
        assert!(work.cpu_s >= 0.02 && work.wall_s > 0.0);
        assert!(nothing.wall_s < work.wall_s);
        assert!(
            watch
                .usage()
                .peak_memory_bytes
                .is_some_and(|bytes| bytes > 1 << 20)
        );
    }
}

//! How many threads a process computes with: what is asked for, but no more than are of use on this machine.

use std::num::NonZero;
use std::thread::available_parallelism;

/// More than this for each processor take memory and save no time.
pub const FOR_EACH_PROCESSOR: usize = 4;

/// No machine has more: what is larger is refused.
pub const MOST_THREADS: usize = 4096;

/// Processors that this process may use.
pub fn processors() -> usize {
    available_parallelism().map_or(1, NonZero::get)
}

/// Threads of a process.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Threads {
    /// As many as are to be started, at least 1.
    pub count: usize,
    /// What to tell the user where more were asked for.
    pub warning: Option<String>,
}

impl Threads {
    /// For a process that is asked to have so many threads, 0 for one per processor.
    pub fn asked(asked: usize) -> Self {
        Self::on(processors(), asked)
    }

    fn on(processors: usize, asked: usize) -> Self {
        let most = processors * FOR_EACH_PROCESSOR;
        let warning = (asked > most).then(|| {
            format!(
                "{asked} threads are more than {FOR_EACH_PROCESSOR} for each of {processors} processors: \
                 {most} are used"
            )
        });
        let count = if asked == 0 { processors } else { asked };
        Self {
            count: count.min(most),
            warning,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_that_are_of_no_use_are_not_started() {
        let count = |asked| Threads::on(2, asked).count;
        assert_eq!([0, 1, 8, 9, 70_000].map(count), [2, 1, 8, 8, 8]);
        let warning = Threads::on(2, 70_000).warning.unwrap();
        assert!(warning.starts_with("70000 threads") && warning.ends_with("8 are used"));
        assert_eq!(Threads::on(2, 8).warning, None);
    }
}

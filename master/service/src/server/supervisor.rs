//! The threads and tasks without which a master is of no use. Each is guarded where it begins: if one ends before it
//! is told to, the master says that it is not well, and stops as it does on SIGTERM.

use std::fmt;
use std::io;
use std::sync::Arc;
use std::thread;

use nestrad_common::panics::{self, Panic};
use thiserror::Error;
use tokio::sync::watch;
use tokio::task::JoinError;

/// A part of the master has ended that should not have.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("internal fault: '{part}' has ended: {reason}")]
pub struct Fault {
    /// The thread or task.
    pub part: String,
    /// What it said.
    pub reason: String,
}

/// Watches over the parts of a master; clones are the same.
#[derive(Clone, Debug)]
pub(super) struct Supervisor {
    fault: Arc<watch::Sender<Option<Fault>>>,
    #[cfg(test)]
    dies: Arc<watch::Sender<String>>,
}

impl Default for Supervisor {
    fn default() -> Self {
        Self {
            fault: Arc::new(watch::Sender::new(None)),
            #[cfg(test)]
            dies: Arc::new(watch::Sender::new(String::new())),
        }
    }
}

impl Supervisor {
    /// Starts a thread that ends when the master stops.
    pub(super) fn thread(
        &self,
        part: String,
        run: impl FnOnce() + Send + 'static,
    ) -> io::Result<()> {
        let this = self.clone();
        thread::Builder::new().name(part.clone()).spawn(move || {
            if let Err(panic) = panics::caught(run) {
                this.has_ended(part, &panic);
            }
        })?;
        Ok(())
    }

    /// Starts a task that has no end.
    pub(super) fn task<T: fmt::Debug + Send + 'static>(
        &self,
        part: &'static str,
        run: impl Future<Output = T> + Send + 'static,
    ) {
        let this = self.clone();
        let guarded = tokio::spawn(self.mortal(part, run));
        tokio::spawn(async move {
            match guarded.await {
                Ok(end) => this.has_ended(part.to_owned(), &format!("{end:?}")),
                Err(error) if error.is_panic() => this.has_ended(part.to_owned(), &words(error)),
                // the master is gone
                Err(_) => {}
            }
        });
    }

    fn has_ended(&self, part: String, reason: &impl fmt::Display) {
        let reason = reason.to_string();
        let fault = Fault { part, reason };
        // before the log, which may be what is broken
        self.fault.send_if_modified(|first| {
            let is_first = first.is_none();
            first.get_or_insert_with(|| fault.clone());
            is_first
        });
        tracing::error!("{fault}");
    }

    /// Waits for the first fault, for ever if there is none.
    pub(super) async fn first_fault(&self) -> Fault {
        let mut faults = self.fault.subscribe();
        let fault = faults.wait_for(Option::is_some).await;
        match fault.ok().and_then(|fault| fault.clone()) {
            Some(fault) => fault,
            // who waits has a sender
            None => std::future::pending().await,
        }
    }

    /// What has ended, if anything has.
    pub(super) fn fault(&self) -> Option<Fault> {
        self.fault.borrow().clone()
    }

    /// A place where a part dies if a test says so.
    #[cfg(not(test))]
    pub(super) fn may_die(&self, _: &str) {}

    #[cfg(not(test))]
    fn mortal<F>(&self, _: &'static str, run: F) -> F {
        run
    }
}

fn words(error: JoinError) -> String {
    match error.try_into_panic() {
        Ok(payload) => Panic::of(&*payload).to_string(),
        Err(error) => error.to_string(),
    }
}

#[cfg(test)]
impl Supervisor {
    /// Has a part die, as soon as it does something.
    pub(super) fn kill(&self, part: &str) {
        self.dies.send_replace(part.to_owned());
    }

    pub(super) fn may_die(&self, part: &str) {
        assert!(*self.dies.borrow() != part, "killed by a test");
    }

    fn mortal<T, F: Future<Output = T>>(
        &self,
        part: &'static str,
        run: F,
    ) -> impl Future<Output = T> + use<T, F> {
        let mut dies = self.dies.subscribe();
        async move {
            tokio::select! {
                end = run => end,
                _ = dies.wait_for(|who| who == part) => panic!("killed by a test"),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn the_first_part_that_ends_is_named_with_its_reason() {
        let supervisor = Supervisor::default();
        assert_eq!(supervisor.fault(), None);
        supervisor
            .thread("solve-0".to_owned(), || panic!("row 7"))
            .unwrap();
        let fault = supervisor.first_fault().await;
        assert_eq!(
            fault.to_string(),
            "internal fault: 'solve-0' has ended: row 7"
        );
        supervisor.task("watch", async { 5 });
        assert_eq!(supervisor.first_fault().await, fault);
    }

    #[tokio::test]
    async fn a_task_that_ends_or_panics_is_a_fault_and_a_thread_that_is_told_to_end_is_none() {
        let supervisor = Supervisor::default();
        let (told, ends) = std::sync::mpsc::channel::<()>();
        let run = move || drop(told);
        supervisor.thread("solve-1".to_owned(), run).unwrap();
        assert!(ends.recv().is_err());
        assert_eq!(supervisor.fault(), None);
        supervisor.task("watch", async { "closed" });
        let fault = supervisor.first_fault().await;
        assert_eq!((&*fault.part, &*fault.reason), ("watch", "\"closed\""));
        let supervisor = Supervisor::default();
        supervisor.task("watch", std::future::pending::<()>());
        supervisor.kill("watch");
        assert_eq!(supervisor.first_fault().await.reason, "killed by a test");
    }
}

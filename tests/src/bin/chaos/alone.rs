//! A place of its own for a run: what it mounts and starts is gone when it ends, however it ends.

use std::env;
use std::io;
use std::os::unix::process::CommandExt;
use std::process::{Command, Stdio};
use std::thread;

use tokio::signal::unix::{SignalKind, signal};

use crate::Args;

/// Set inside.
const INSIDE: &str = "NESTRAD_CHAOS_INSIDE";

/// Runs this command again in namespaces of its own, and there `run`. Where the system has none for us, `run` is
/// run here.
pub(crate) fn run_here_or_inside(
    args: &Args,
    run: impl FnOnce(&Args) -> io::Result<bool>,
) -> io::Result<bool> {
    // others share this machine
    let unshare = ["--mount", "--pid", "--fork", "--kill-child", "--mount-proc"];
    let can = || {
        let tried = Command::new("unshare").args(unshare).arg("true").output();
        tried.is_ok_and(|output| output.status.success())
    };
    if env::var_os(INSIDE).is_some() {
        end_when_told()?;
        // libfaketime leaves files there, named by processes
        let mount = ["-t", "tmpfs", "chaos", "/dev/shm"];
        let _ = Command::new("mount").args(mount).output();
        return run(args);
    }
    if !can() {
        return run(args);
    }
    let error = Command::new("unshare")
        .args(unshare)
        .args(["nice", "-n", "10"])
        .arg(env::current_exe()?)
        .args(env::args_os().skip(1))
        .env(INSIDE, "1")
        .stdin(Stdio::null())
        .exec();
    Err(error)
}

/// Ends this program on SIGINT and SIGTERM, and with it all that it started: it is the first process of its
/// namespace, which hears of no signal that it does not ask for.
fn end_when_told() -> io::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let guard = runtime.enter();
    let (mut terminate, mut interrupt) = (
        signal(SignalKind::terminate())?,
        signal(SignalKind::interrupt())?,
    );
    drop(guard);
    thread::spawn(move || {
        runtime.block_on(async {
            tokio::select! {
                _ = terminate.recv() => {}
                _ = interrupt.recv() => {}
            }
        });
        std::process::exit(130);
    });
    Ok(())
}

//! The real programs as processes, with every wait bounded.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

/// Nothing that is waited for here takes longer, on a machine that is busy with other tests too.
pub const PATIENCE: Duration = Duration::from_secs(120);

/// A program of the workspace, built as the tests are.
pub fn program(name: &str) -> PathBuf {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    let folder = BUILT.get_or_init(|| {
        // without cargo, the programs are those that lie beside the tests
        if let Some(cargo) = std::env::var_os("CARGO") {
            let mut build = Command::new(cargo);
            build
                .args([
                    "build",
                    "--workspace",
                    "--bins",
                    "--profile",
                    "test",
                    "--quiet",
                ])
                .args([
                    "--manifest-path",
                    concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml"),
                ]);
            // what cargo says of this package would make it build others anew
            for (name, _) in std::env::vars_os() {
                let text = name.to_string_lossy();
                if text.starts_with("CARGO_PKG_") || text.starts_with("CARGO_MANIFEST_") {
                    build.env_remove(&name);
                }
            }
            let built = build.status();
            assert!(built.unwrap().success());
        }
        let tests = std::env::current_exe().unwrap();
        tests.ancestors().nth(2).unwrap().to_owned()
    });
    folder.join(name)
}

/// `nestrad`, to be run in a folder.
pub fn nestrad(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(program("nestrad"));
    command
        .args(args)
        .current_dir(folder)
        .env_remove("RUST_BACKTRACE")
        .env_remove("NESTRAD_TOKEN")
        .env_remove("NESTRAD_LOG")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Runs a command to its end.
pub fn finish(mut command: Command) -> Output {
    wait_for(command.spawn().unwrap())
}

/// The output of a process that ends by itself.
pub fn wait_for(child: Child) -> Output {
    let id = child.id();
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || sender.send(child.wait_with_output()));
    match receiver.recv_timeout(PATIENCE) {
        Ok(output) => output.unwrap(),
        Err(_) => {
            signal(id, "KILL");
            panic!("a process did not end within {PATIENCE:?}");
        }
    }
}

/// Sends a signal to a process.
pub fn signal(id: u32, name: &str) {
    let kill = ["-s", name, &id.to_string()];
    let sent = Command::new("kill").args(kill).status();
    assert!(sent.unwrap().success(), "kill {kill:?}");
}

/// What a process said on stderr.
pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Waits until something is so.
pub fn until(what: &str, mut so: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !so() {
        assert!(begun.elapsed() < PATIENCE, "{what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A master in a process of its own, which goes when this does.
pub struct Master {
    child: Child,
    /// Where clients and workers come in.
    pub address: SocketAddr,
    /// Where its metrics are.
    pub metrics: SocketAddr,
    log: Arc<Mutex<String>>,
}

impl Master {
    /// Starts a master on free ports of the loopback, with these arguments besides.
    pub fn start(args: &[&str]) -> Self {
        Self::start_at("127.0.0.1:0", args)
    }

    /// Starts a master at an address.
    pub fn start_at(address: &str, args: &[&str]) -> Self {
        let mut command = nestrad(Path::new("."), &["serve", "--listen", address]);
        // all that it could ever say
        command.env("NESTRAD_LOG", "trace");
        command.args(["--metrics", "127.0.0.1:0"]).args(args);
        let mut child = command.stdout(Stdio::null()).spawn().unwrap();
        let (log, lines) = follow(child.stderr.take().unwrap());
        let place = |what: &str| -> SocketAddr {
            loop {
                let line = lines.recv_timeout(PATIENCE);
                let line = line.unwrap_or_else(|_| panic!("{}", log.lock().unwrap()));
                if let Some((_, address)) = line.split_once(&format!("{what} address=")) {
                    return address.trim().parse().unwrap();
                }
            }
        };
        let (metrics, address) = (place("metrics"), place("serves"));
        Self {
            child,
            address,
            metrics,
            log,
        }
    }

    /// Starts a master that says everything it could say to a place that may not take it.
    pub fn start_without_log(stderr: Stdio, args: &[&str]) -> Self {
        let free = [(); 2].map(|()| TcpListener::bind("127.0.0.1:0").unwrap());
        let [address, metrics] = free.each_ref().map(|port| port.local_addr().unwrap());
        drop(free);
        let places = [address, metrics].map(|place| place.to_string());
        let places = ["serve", "--listen", &places[0], "--metrics", &places[1]];
        let mut command = nestrad(Path::new("."), &[&places, args].concat());
        command.env("NESTRAD_LOG", "trace");
        let mut child = command
            .stdout(Stdio::null())
            .stderr(stderr)
            .spawn()
            .unwrap();
        until("a master listens", || {
            assert!(child.try_wait().unwrap().is_none(), "the master has ended");
            TcpStream::connect(metrics).is_ok() && TcpStream::connect(address).is_ok()
        });
        Self {
            child,
            address,
            metrics,
            log: Arc::default(),
        }
    }

    /// For clients.
    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Number of the process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// All that it said so far.
    pub fn log(&self) -> String {
        self.log.lock().unwrap().clone()
    }

    /// All metrics.
    pub fn metrics_text(&self) -> String {
        let mut stream = TcpStream::connect(self.metrics).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let request = "GET /metrics HTTP/1.1\r\nHost: master\r\nConnection: close\r\n\r\n";
        stream.write_all(request.as_bytes()).unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        assert!(text.starts_with("HTTP/1.1 200"), "{text}");
        text
    }

    /// One metric, by its name and labels.
    pub fn metric(&self, name: &str) -> f64 {
        let text = self.metrics_text();
        let mut lines = text.lines();
        let value = lines.find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
        let value = value.unwrap_or_else(|| panic!("{name}: {text}"));
        value.parse().unwrap()
    }

    /// As a power failure would.
    pub fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Tells it to stop, and waits until it has.
    pub fn terminate(mut self) -> ExitStatus {
        signal(self.child.id(), "TERM");
        let mut status = None;
        until("the master stops", || {
            status = self.child.try_wait().unwrap();
            status.is_some()
        });
        status.unwrap()
    }
}

impl Drop for Master {
    fn drop(&mut self) {
        // it may have ended already
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Keeps what a process says, and hands it on line by line.
pub(crate) fn follow(stderr: impl Read + Send + 'static) -> (Arc<Mutex<String>>, Receiver<String>) {
    let log = Arc::new(Mutex::new(String::new()));
    let (sender, lines) = mpsc::channel();
    let kept = log.clone();
    std::thread::spawn(move || {
        for line in BufReader::new(stderr).lines().map_while(Result::ok) {
            let mut log = kept.lock().unwrap();
            log.push_str(&line);
            log.push('\n');
            drop(log);
            // nobody listens once the addresses are known
            let _ = sender.send(line);
        }
    });
    (log, lines)
}

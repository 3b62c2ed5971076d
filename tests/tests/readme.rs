//! The commands of README.md do what it says, as they are written there: they run one after the other, in the
//! folder that it names.

#![allow(clippy::unwrap_used, reason = "what cannot be set up fails the test")]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use nestrad_tests::processes::{Master, program};

const README: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../README.md");
/// The programs that commands begin with.
const PROGRAMS: [&str; 5] = ["nestrad", "cargo", "cd", "python3", "venv/bin/"];
/// What is built already is not built again in another way.
const RELEASE: &str = "cargo run --release --bin nestrad --";
/// Where the service of the README listens, which may be taken here.
const SERVICE: &str = "127.0.0.1:7410";
/// Beginnings of commands that are not run, and why.
const SKIPPED: [(&str, &str); 3] = [
    ("cargo test", "it is what runs this test"),
    (
        "python3 -m venv",
        "it needs a network, for packages: proto/python/tests/wheel does it",
    ),
    (
        "venv/bin/python",
        "it needs the package: proto/python/tests/test_pages.py does it",
    ),
];

/// Beginnings of commands, and what they leave behind.
const LEFT: [(&str, &str); 4] = [
    ("cargo run", "demo/out/organs.csv"),
    ("nestrad solve", "demo/out/summary.json"),
    ("nestrad report", "demo/out/report.html"),
    ("nestrad trade", "demo/trade/trade.html"),
];

/// The commands in the indented blocks of a text, in their order, with lines that a backslash joins as one.
fn commands(text: &str) -> Vec<String> {
    let text = text.replace("\\\n", " ");
    let indented = text.lines().filter_map(|line| line.strip_prefix("    "));
    let command = |line: &&str| PROGRAMS.iter().any(|program| line.starts_with(program));
    let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
    indented.filter(command).map(words).collect()
}

/// One folder, a shell, and `nestrad` on its path.
struct Reader {
    folder: tempfile::TempDir,
    /// Below it.
    at: PathBuf,
    master: Option<Master>,
}

impl Reader {
    fn run(&mut self, command: &str) {
        let command = command.replace(RELEASE, "nestrad");
        if let Some(place) = command.strip_prefix("cd ") {
            self.at = self.at.join(place.split(' ').next().unwrap());
            return;
        }
        if command.starts_with("nestrad serve") {
            // a command that goes on until it is stopped
            self.master = Some(Master::start(&[]));
            return;
        }
        let address = self
            .master
            .as_ref()
            .map(|master| master.address.to_string());
        assert!(address.is_some() || !command.contains(SERVICE), "{command}");
        let command = command.replace(SERVICE, &address.unwrap_or_default());
        let programs = program("nestrad").parent().unwrap().to_owned();
        let path = std::env::var_os("PATH").unwrap_or_default();
        let path = std::iter::once(programs).chain(std::env::split_paths(&path));
        let mut shell = Command::new("sh");
        shell
            .args(["-e", "-c", &command])
            .current_dir(self.folder.path().join(&self.at))
            .env("PATH", std::env::join_paths(path).unwrap())
            .env_remove("NESTRAD_TOKEN")
            .stdin(Stdio::null());
        let output = shell.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command}: {said}");
    }

    fn has(&self, name: &str) -> bool {
        self.folder.path().join(name).exists()
    }
}

#[test]
fn commands_of_the_readme_did_not_run_as_written() {
    let commands = commands(&fs::read_to_string(README).unwrap());
    let mut reader = Reader {
        folder: tempfile::tempdir().unwrap(),
        at: PathBuf::new(),
        master: None,
    };
    let mut run = Vec::new();
    for command in &commands {
        match SKIPPED.iter().find(|(begin, _)| command.starts_with(begin)) {
            // libtest shows what is printed with --nocapture only: this goes past it
            Some((_, why)) => {
                let line = format!("\nSKIPPED: {command}: {why}\n");
                std::io::stderr().write_all(line.as_bytes()).unwrap();
            }
            None => {
                reader.run(command);
                for (_, file) in LEFT.iter().filter(|(begin, _)| command.starts_with(begin)) {
                    assert!(reader.has(file), "{command}: {file}");
                }
                run.push(command.as_str());
            }
        }
    }
    // every command of the program is shown
    for name in [
        "generate", "solve", "check", "report", "trade", "serve", "status",
    ] {
        let shown = |command: &&str| command.split(' ').any(|word| word == name);
        assert!(run.iter().any(shown), "{name}: {run:?}");
    }
}

#[test]
fn commands_are_found() {
    let text = "\
Text with `nestrad solve`.

    nestrad solve a.can \\
            --out b     # why
    n 1
    cd demo

nestrad is no command here.
";
    assert_eq!(
        commands(text),
        ["nestrad solve a.can --out b # why", "cd demo"]
    );
    assert!(Path::new(README).exists());
}

/// All that the Rust files of a folder say.
fn rust_of(folder: &Path, text: &mut String) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") {
            rust_of(&path, text);
        } else if path.extension().is_some_and(|kind| kind == "rs") {
            text.push_str(&fs::read_to_string(&path).unwrap());
        }
    }
}

/// The page for operators says what nobody can do to whom, and which test shows it.
#[test]
fn each_test_that_the_page_for_operators_names_is_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = fs::read_to_string(root.join("master/docs/operators.md")).unwrap();
    let mut code = String::new();
    for folder in ["common", "master", "proto", "tests", "worker"] {
        rust_of(&root.join(folder), &mut code);
    }
    let is_word = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let is_test = |name: &&str| {
        // metrics are not sentences
        name.matches('_').count() >= 3
            && name.chars().all(is_word)
            && !name.starts_with('_')
            && !name.starts_with("nestrad_")
    };
    let named: Vec<&str> = page.split('`').filter(is_test).collect();
    assert!(named.len() > 25, "{named:?}");
    for name in named {
        assert!(code.contains(&format!("fn {name}(")), "{name}");
    }
}

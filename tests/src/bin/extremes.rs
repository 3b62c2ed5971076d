//! Runs every row of the table of extremes and writes it to `master/docs/extremes.md`.

#![allow(clippy::print_stderr, reason = "a command that says how far it is")]

use std::process::ExitCode;
use std::{env, fs, io};

use nestrad_tests::extremes::{cases, run, table};

fn main() -> io::Result<ExitCode> {
    // rows whose name or axis has this in it, to look into one; the page is then left alone
    let only = env::args().nth(1);
    let mut rows = Vec::new();
    for case in cases() {
        let wanted = |word: &String| case.name.contains(word) || case.axis.contains(word);
        if !only.as_ref().is_none_or(wanted) {
            continue;
        }
        eprint!("{}: {} ... ", case.axis, case.name);
        let row = run(case);
        match &row.verdict {
            Ok(seen) => eprintln!("{} ({}) in {:.1?}", seen.happens, seen.figure, row.took),
            Err(fault) => eprintln!("WRONG in {:.1?}: {fault}", row.took),
        }
        rows.push(row);
    }
    if only.is_none() {
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../master/docs/extremes.md");
        fs::write(page, table::page(&rows))?;
    }
    let failed = rows.iter().filter(|row| row.verdict.is_err()).count();
    eprintln!("{} rows, {failed} failed", rows.len());
    Ok(ExitCode::from(u8::from(failed > 0)))
}

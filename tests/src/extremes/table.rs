//! The table as a page of the documentation.

use std::fmt::Write;

use super::Row;

/// The page. What is in it depends on nothing but the program: no times, no machine.
pub fn page(rows: &[Row]) -> String {
    let failed = rows.iter().filter(|row| row.verdict.is_err()).count();
    let mut page = format!(
        "# At the extremes\n\n\
         Every parameter driven to its end: the right limit within its stated error, or a refusal that names \
         the cause. Written by\n\n    cargo run --release -p nestrad-tests --bin extremes\n\n\
         which runs every row ({} of them, {failed} failed); `cargo test` runs them too. Every solve is \
         also checked for what must hold of any: no number that is not finite, nothing below zero, nothing \
         absorbed that did not come in, a balance that closes within its stated error. Expectations come \
         from closed forms, limits, conservation, or the neighbouring case that is not extreme. ± is one \
         standard error as the program states it.\n\n\
         What no list would have thought of comes from random scenes, `fuzz_scenes SECONDS [FIRST SEED]`: \
         what that found is in `tests/tests/wild_scenes.rs`, by seed.\n",
        rows.len()
    );
    let mut axis = "";
    for row in rows {
        if row.axis != axis {
            axis = row.axis;
            // writing to a string cannot fail
            let _ = write!(
                page,
                "\n## {axis}\n\n| case | expected | what happens | figure | |\n|---|---|---|---|---|\n"
            );
        }
        let (happens, figure, mark) = match &row.verdict {
            Ok(seen) => (seen.happens, seen.figure.as_str(), "pass"),
            Err(fault) => ("wrong", fault.as_str(), "**fail**"),
        };
        let _ = writeln!(
            page,
            "| {} | {} | {happens} | {} | {mark} |",
            row.name,
            row.expected,
            figure.replace('|', "\\|").replace('\n', " ")
        );
    }
    page
}

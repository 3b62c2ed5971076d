//! The whole table of extremes (`master/docs/extremes.md`).

use nestrad_tests::extremes::{Row, cases, run};

#[test]
fn every_row_of_the_table_of_extremes_holds() {
    let failed: Vec<String> = cases()
        .into_iter()
        .map(run)
        .filter_map(
            |Row {
                 axis,
                 name,
                 verdict,
                 ..
             }| {
                verdict
                    .err()
                    .map(|fault| format!("{axis}, {name}: {fault}"))
            },
        )
        .collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

//! Records of comma-separated text.

use std::borrow::Cow;

/// Takes one record off the text: RFC 4180, as [`crate::csv`] writes it.
pub(super) fn record<'a>(rest: &mut &'a str, cells: &mut Vec<Cow<'a, str>>) {
    cells.clear();
    loop {
        let (cell, after) = match rest.strip_prefix('"') {
            Some(quoted) => in_quotes(quoted),
            None => {
                let end = rest.find([',', '\n']).unwrap_or(rest.len());
                (rest[..end].trim_end_matches('\r').into(), &rest[end..])
            }
        };
        cells.push(cell);
        let more = after.starts_with(',');
        *rest = after.get(1..).unwrap_or("");
        if !more {
            return;
        }
    }
}

/// The text up to the closing quote, and what comes after it.
fn in_quotes(text: &str) -> (Cow<'_, str>, &str) {
    let mut from = 0;
    loop {
        let Some(at) = text[from..].find('"').map(|at| from + at) else {
            return (text.replace("\"\"", "\"").into(), "");
        };
        if !text[at + 1..].starts_with('"') {
            let after = text[at + 1..].trim_start_matches('\r');
            return (text[..at].replace("\"\"", "\"").into(), after);
        }
        from = at + 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_names_come_back() {
        let mut rest = "plain,\"a,b\",\"say \"\"so\"\"\",\"two\nlines\",,é\nnext";
        let mut cells = Vec::new();
        record(&mut rest, &mut cells);
        assert_eq!(cells, ["plain", "a,b", "say \"so\"", "two\nlines", "", "é"]);
        assert_eq!(rest, "next");
    }
}

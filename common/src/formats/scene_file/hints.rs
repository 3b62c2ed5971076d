//! What the TOML parser says, in words that say how to write it.

use std::ops::Range;

/// The message for an error at `span` of `text`.
pub(super) fn message(said: &str, text: &str, span: Option<&Range<usize>>) -> String {
    let hint = span.and_then(|span| hint(said, text, span.start));
    hint.unwrap_or_else(|| in_plain_words(said))
}

/// serde has names for types that are Rust's, and lines that are not one.
fn in_plain_words(said: &str) -> String {
    let mut said = said.replace('\n', ", ");
    for (rust, plain) in [
        ("expected f64", "expected a number"),
        ("expected usize", "expected a whole number, 0 or more"),
        ("expected u64", "expected a whole number, 0 or more"),
    ] {
        said = said.replace(rust, plain);
    }
    said
}

fn hint(said: &str, text: &str, at: usize) -> Option<String> {
    // what is longer is garbled, and no message
    let found = word_and_line(text, at).filter(|(_, line)| line.len() <= 400);
    let (word, line) = found?;
    if let Some(number) = number(word, line) {
        let (right, wrong) = number;
        return Some(format!(
            "expected a number written as in TOML, {right}, found {wrong}"
        ));
    }
    let lower = word.to_lowercase();
    if (lower == "true" || lower == "false") && lower != word {
        return Some(format!("expected {lower}, in lower case, found {word}"));
    }
    if said.contains("must be quoted") && !word.is_empty() {
        return Some(format!("expected text in quotes, \"{word}\", found {word}"));
    }
    if said.starts_with("key with no value") && line.contains('=') {
        let name = line.split('=').next().unwrap_or_default().trim();
        return Some(format!(
            "expected a name with blanks in quotes, \"{name}\", found {name}"
        ));
    }
    let escape = ["unicode value digits", "escape", "unicode"];
    if escape.iter().any(|of| said.contains(of)) && line.contains('\\') {
        return Some(
            "expected a path with / or in single quotes, found a \\, which begins an escape sequence in double quotes"
                .to_owned(),
        );
    }
    None
}

/// A number that TOML writes in another way: so, and as it was found.
fn number<'a>(word: &'a str, line: &'a str) -> Option<(String, &'a str)> {
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let (sign, rest) = match word.strip_prefix(['+', '-']) {
        Some(rest) => word.split_at(word.len() - rest.len()),
        None => ("", word),
    };
    // a point with digits on one side only, before a possible exponent
    let end = rest.find(['e', 'E']).unwrap_or(rest.len());
    let (mantissa, exponent) = rest.split_at(end);
    match mantissa.split_once('.') {
        Some(("", after)) if digits(after) => {
            return Some((format!("{sign}0.{after}{exponent}"), word));
        }
        Some((before, "")) if digits(before) => {
            return Some((format!("{sign}{before}.0{exponent}"), word));
        }
        _ => {}
    }
    let whole = mantissa.split('.').next().unwrap_or_default();
    let short = whole.trim_start_matches('0');
    if digits(whole) && whole.len() > 1 && short.len() < whole.len() {
        let short = if short.is_empty() { "0" } else { short };
        return Some((format!("{sign}{short}{}", &rest[whole.len()..]), word));
    }
    // a comma for the decimal point
    let value = line.split_once('=')?.1.split('#').next()?.trim();
    let (before, after) = value.split_once(',')?;
    let comma = digits(before.trim_start_matches(['+', '-'])) && digits(after);
    comma.then(|| (format!("{before}.{after}"), value))
}

/// The word around a position, and its line.
fn word_and_line(text: &str, at: usize) -> Option<(&str, &str)> {
    let (before, after) = text.split_at_checked(at.min(text.len()))?;
    let line_start = before.rfind('\n').map_or(0, |end| end + 1);
    let line_end = after.find('\n').map_or(text.len(), |end| at + end);
    let line = text[line_start..line_end].trim_end_matches('\r');
    let parts = |c: char| c.is_whitespace() || ",=[]{}#\"'".contains(c);
    let start = before.rfind(parts);
    let start = start.map_or(0, |start| {
        start + before[start..].chars().next().map_or(0, char::len_utf8)
    });
    let end = after.find(parts).map_or(text.len(), |end| at + end);
    Some((&text[start..end], line))
}

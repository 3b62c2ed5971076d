//! Text for a terminal or a log. Names come from files and from peers: nothing in them may steer a terminal, hide
//! text, or look like a line of the program's own.

use std::borrow::Cow;

/// A line, in which control characters are written out: `\u{1b}`, `\n`.
pub fn line(text: &str) -> Cow<'_, str> {
    written_out(text, steers)
}

/// Several lines: their ends are kept.
pub fn lines(text: &str) -> Cow<'_, str> {
    written_out(text, |c| c != '\n' && steers(c))
}

fn written_out(text: &str, what: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&what) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if what(c) {
            out.extend(c.escape_default());
        } else {
            out.push(c);
        }
    }
    Cow::Owned(out)
}

/// Control characters, ends of lines, and marks that change the direction in which text is shown.
fn steers(c: char) -> bool {
    c.is_control()
        || matches!(
            c,
            '\u{61c}'
                | '\u{200e}'
                | '\u{200f}'
                | '\u{2028}'..='\u{202e}'
                | '\u{2066}'..='\u{2069}'
                | '\u{feff}'
        )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_steer_a_terminal_is_written_out_and_all_else_is_kept() {
        assert_eq!(line("a\u{1b}[2J\nb\u{7}"), "a\\u{1b}[2J\\nb\\u{7}");
        assert_eq!(lines("a\u{9b}2J\nb\r"), "a\\u{9b}2J\nb\\r");
        assert_eq!(line("x\u{202e}y\u{2028}"), "x\\u{202e}y\\u{2028}");
        let plain = "Blätter 'é' \\ 葉 ± \"m\" 👩‍🌾";
        assert!(matches!(line(plain), Cow::Borrowed(text) if text == plain));
    }
}

//! Numbers as people read them.

/// A number with a fixed count of decimals. What rounds to zero has no sign: `-0.00` says nothing that
/// `0.00` does not.
///
/// ```
/// # use nestrad_common::figures::fixed;
/// assert_eq!(fixed(-0.004, 2), "0.00");
/// assert_eq!(fixed(-0.006, 2), "-0.01");
/// ```
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|byte| matches!(byte, b'0' | b'.')) => zero.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minus_zero_was_printed() {
        for (value, decimals, text) in [
            (-0.0, 0, "0"),
            (-0.0, 3, "0.000"),
            (-0.000_49, 3, "0.000"),
            (-0.000_51, 3, "-0.001"),
            (0.5, 1, "0.5"),
            (-1.0, 2, "-1.00"),
            (f64::NEG_INFINITY, 2, "-inf"),
        ] {
            assert_eq!(fixed(value, decimals), text);
        }
    }
}

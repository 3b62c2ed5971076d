//! Numbers as they are written: rounded in a way that is the same everywhere.
//!
//! Results carry nine significant digits. Their standard errors are of the order of 1e-3 of the
//! value, so a rounding of 5e-9 is far below anything that can be told apart, while it shortens the
//! text of a table by almost half. Rounding uses only exactly rounded operations (no logarithm, whose
//! last bit differs between systems), so that the same result gives the same file on every machine.

/// Powers of ten that are exact in f64.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// The f64 nearest to `x` at nine significant decimal digits.
///
/// Idempotent, relative error below 1e-8; `-0` becomes `0`. What is not finite, and what is too
/// small to have nine digits (subnormal), stays as it is.
pub(crate) fn round_to_nine_digits(x: f64) -> f64 {
    if !x.is_normal() {
        return x + 0.0;
    }
    scaled(x).unwrap_or_else(|| format!("{x:.8e}").parse().unwrap_or(x))
}

/// The quick way: where the power of ten that makes `x` a nine-digit integer is exact, integer and
/// power are both exact and the one division gives the f64 nearest to the decimal number.
fn scaled(x: f64) -> Option<f64> {
    let binary_exponent = ((x.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    // floor(binary_exponent * log10(2)): the decimal exponent, or one less
    let decimal_exponent = (binary_exponent * 78_913) >> 18;
    let shift = 8 - decimal_exponent;
    let nine_digits = |shift: i32| {
        let power = *POWERS.get(usize::try_from(shift.abs()).ok()?)?;
        Some((if shift >= 0 { x * power } else { x / power }, power))
    };
    let (mut integer, mut power) = nine_digits(shift)?;
    let mut down = shift >= 0;
    if integer.abs() >= 1e9 {
        (integer, power) = nine_digits(shift - 1)?;
        down = shift > 0;
    }
    let integer = integer.round();
    Some(if down {
        integer / power
    } else {
        integer * power
    })
}

/// A coordinate in metres, to the micrometre.
///
/// Coordinates may be national grid coordinates of seven digits before the point: a fixed number of
/// significant digits would move them, a fixed number of decimals does not.
pub(crate) fn round_to_micrometre(x_m: f64) -> f64 {
    // beyond this an f64 has no micrometres
    if x_m.abs() < 1e9 {
        (x_m * 1e6).round() / 1e6 + 0.0
    } else {
        x_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn known_values() {
        for (x, rounded) in [
            (0.0, 0.0),
            (-0.0, 0.0),
            (1.0, 1.0),
            (123_456_789.4, 123_456_789.0),
            (0.123_456_789_4, 0.123_456_789),
            (-0.123_456_789_6, -0.123_456_79),
            (0.1 + 0.2, 0.3),
            (999_999_999.6, 1e9),
            (9.999_999_999e-6, 1e-5),
            (1.234_567_891_2e-40, 1.234_567_89e-40),
            (1.234_567_891_2e40, 1.234_567_89e40),
            (f64::MAX, 1.797_693_13e308),
            (5e-324, 5e-324),
        ] {
            assert_eq!(
                round_to_nine_digits(x).to_bits(),
                f64::to_bits(rounded),
                "{x}"
            );
        }
        assert!(round_to_nine_digits(f64::NAN).is_nan());
    }

    #[test]
    fn micrometres() {
        assert_eq!(round_to_micrometre(0.1 + 0.2), 0.3);
        assert_eq!(round_to_micrometre(5_432_100.123_456_7), 5_432_100.123_457);
        assert_eq!(round_to_micrometre(-1e-9).to_bits(), 0);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn close_idempotent_and_short(x in prop_oneof![
            proptest::num::f64::NORMAL, -1e3..1e3_f64, 0.0..1e-3_f64, 1e8..1e10_f64,
        ]) {
            let rounded = round_to_nine_digits(x);
            // written as a quotient: a tolerance relative to a tiny x would vanish
            prop_assert!(x == 0.0 || (rounded / x - 1.0).abs() < 1e-8);
            prop_assert_eq!(round_to_nine_digits(rounded).to_bits(), rounded.to_bits());
            let text = format!("{rounded:e}");
            let digits = text.split('e').next().unwrap_or_default();
            prop_assert!(digits.bytes().filter(u8::is_ascii_digit).count() <= 9, "{}", text);
        }
    }
}

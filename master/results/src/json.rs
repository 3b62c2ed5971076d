//! JSON in which no number is `-0.0`: a zero has no sign that means anything here.

use std::io::{self, Write};

use serde::Serialize;
use serde_json::Serializer;
use serde_json::ser::{CompactFormatter, Formatter, PrettyFormatter};

/// Writes a value over many lines.
pub(crate) fn write_indented(
    value: &impl Serialize,
    out: &mut impl Write,
) -> serde_json::Result<()> {
    let formatter = Unsigned(PrettyFormatter::new());
    value.serialize(&mut Serializer::with_formatter(out, formatter))
}

/// A value in one line.
pub(crate) fn compact(value: &impl Serialize) -> serde_json::Result<String> {
    let mut out = Vec::new();
    let formatter = Unsigned(CompactFormatter);
    value.serialize(&mut Serializer::with_formatter(&mut out, formatter))?;
    String::from_utf8(out).map_err(serde::ser::Error::custom)
}

/// Another formatter, whose zeros have no sign.
struct Unsigned<F>(F);

macro_rules! as_inside {
    ($($method:ident($($name:ident: $kind:ty),*);)*) => {
        $(fn $method<W: ?Sized + Write>(&mut self, out: &mut W, $($name: $kind),*) -> io::Result<()> {
            self.0.$method(out, $($name),*)
        })*
    };
}

impl<F: Formatter> Formatter for Unsigned<F> {
    fn write_f64<W: ?Sized + Write>(&mut self, out: &mut W, value: f64) -> io::Result<()> {
        // adding zero turns -0 into 0
        self.0.write_f64(out, value + 0.0)
    }

    fn write_f32<W: ?Sized + Write>(&mut self, out: &mut W, value: f32) -> io::Result<()> {
        self.0.write_f32(out, value + 0.0)
    }

    as_inside! {
        begin_array();
        end_array();
        begin_array_value(first: bool);
        end_array_value();
        begin_object();
        end_object();
        begin_object_key(first: bool);
        end_object_key();
        begin_object_value();
        end_object_value();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minus_zero_was_in_the_summary() {
        let value = serde_json::json!({ "a": -0.0, "b": [-0.0, -1.5, { "c": -0.0 }] });
        let text = compact(&(value, -0.0_f32)).expect("written");
        assert_eq!(text, r#"[{"a":0.0,"b":[0.0,-1.5,{"c":0.0}]},0.0]"#);
    }

    #[test]
    fn the_rest_is_as_serde_json_writes_it() {
        let value = serde_json::json!({ "a": [], "b": { "é\n": null }, "c": [true, 1, 2.5e-9] });
        let mut indented = Vec::new();
        write_indented(&value, &mut indented).expect("written");
        let expected = serde_json::to_string_pretty(&value).expect("written");
        assert_eq!(String::from_utf8_lossy(&indented), expected);
        assert_eq!(compact(&value).expect("written"), value.to_string());
    }
}

//! The parts of a VTK XML file with appended raw data: arrays, and the text that describes them.

use std::io::Write;

use crate::error::Fault;

/// A named array: its values by index.
pub(crate) struct Array<'a> {
    pub(crate) name: String,
    pub(crate) components: usize,
    count: usize,
    values: Values<'a>,
}

type ByIndex<'a, T> = Box<dyn Fn(usize) -> T + 'a>;

/// Values by index, which are computed as they are written.
pub(crate) enum Values<'a> {
    F64(ByIndex<'a, f64>),
    F32(ByIndex<'a, f32>),
    I64(ByIndex<'a, i64>),
    /// Each ends with a zero byte in the file.
    Text(ByIndex<'a, &'a str>),
}

impl<'a> Array<'a> {
    pub(crate) fn new(name: impl Into<String>, count: usize, values: Values<'a>) -> Self {
        let name = name.into();
        Self {
            name,
            components: 1,
            count,
            values,
        }
    }

    /// VTK's names of the element and of the type.
    fn kind(&self) -> (&'static str, &'static str) {
        match self.values {
            Values::F64(_) => ("DataArray", "Float64"),
            Values::F32(_) => ("DataArray", "Float32"),
            Values::I64(_) => ("DataArray", "Int64"),
            Values::Text(_) => ("Array", "String"),
        }
    }

    fn bytes(&self) -> usize {
        match &self.values {
            Values::F64(_) | Values::I64(_) => self.count * 8,
            Values::F32(_) => self.count * 4,
            Values::Text(value) => (0..self.count).map(|i| value(i).len() + 1).sum(),
        }
    }

    /// The block that the XML's offset points to: length in bytes, then the values.
    pub(crate) fn append(&self, out: &mut impl Write) -> Result<(), Fault> {
        out.write_all(&(self.bytes() as u64).to_le_bytes())?;
        let indices = 0..self.count;
        match &self.values {
            Values::F64(value) => indices.map(value).try_for_each(|v| {
                self.finite(v)?;
                // adding zero turns -0 into 0
                Ok(out.write_all(&(v + 0.0).to_le_bytes())?)
            }),
            Values::F32(value) => indices.map(value).try_for_each(|v| {
                self.finite(v.into())?;
                Ok(out.write_all(&(v + 0.0).to_le_bytes())?)
            }),
            Values::I64(value) => indices
                .map(value)
                .try_for_each(|v| Ok(out.write_all(&v.to_le_bytes())?)),
            Values::Text(value) => indices.map(value).try_for_each(|text| {
                out.write_all(text.as_bytes())?;
                Ok(out.write_all(&[0])?)
            }),
        }
    }

    fn finite(&self, value: f64) -> Result<(), Fault> {
        if value.is_finite() {
            return Ok(());
        }
        let place = format!("a value of {}", self.name);
        Err(Fault::NotFinite { place, value })
    }
}

/// The head of the file, and where the next array will begin after it.
#[derive(Default)]
pub(crate) struct Xml {
    pub(crate) text: String,
    offset: usize,
}

impl Xml {
    pub(crate) fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// Describes an array that is appended after those described before it.
    pub(crate) fn array(&mut self, array: &Array<'_>) {
        let (element, kind) = array.kind();
        self.line(&format!(
            "<{element} type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>",
            kind,
            escaped(&array.name),
            array.components,
            self.offset,
        ));
        self.offset += size_of::<u64>() + array.bytes();
    }
}

/// Text for an XML attribute. XML has no control characters, not even escaped.
pub(crate) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\u{fffe}' | '\u{ffff}' => out.push(char::REPLACEMENT_CHARACTER),
            c if c.is_control() => out.push(char::REPLACEMENT_CHARACTER),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped() {
        assert_eq!(
            escaped("a<b>\"c\"&\u{1}\u{ffff}é\n"),
            "a&lt;b&gt;&quot;c&quot;&amp;\u{fffd}\u{fffd}é\u{fffd}"
        );
    }
}

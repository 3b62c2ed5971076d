//! What the pages have in common: how they look, and how text and numbers get into them.

use std::io::Write;

use serde::Serialize;

use crate::error::Fault;
use crate::json;

/// The look of all pages, in the light and in the dark.
pub(crate) const STYLE: &str = include_str!("page.css");

/// Writes a template, whose `{{names}}` are put in by `put`.
pub(crate) fn fill<W: Write>(
    template: &str,
    out: &mut W,
    mut put: impl FnMut(&str, &mut W) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        out.write_all(before.as_bytes())?;
        put(name, out)?;
        rest = after;
    }
    out.write_all(rest.as_bytes())?;
    Ok(())
}

/// JSON that cannot end the element that it stands in, whatever names hold.
pub(crate) fn json(facts: &impl Serialize) -> Result<String, Fault> {
    Ok(json::compact(facts)?
        .replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('&', "\\u0026"))
}

/// Text as HTML.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_reads_back_and_holds_no_tag() {
        let evil = "</script><script>alert(1)</script>&<!--\"";
        let text = json(&evil).expect("written");
        assert!(!text.contains(['<', '>', '&']), "{text}");
        assert_eq!(serde_json::from_str::<String>(&text).expect("read"), evil);
    }

    #[test]
    fn names_are_put_in_and_the_rest_is_kept() {
        let mut out = Vec::new();
        fill("a {{b}} c{{d}}", &mut out, |name, out| {
            Ok(out.write_all(name.to_uppercase().as_bytes())?)
        })
        .expect("written");
        assert_eq!(out, b"a B cD");
    }
}

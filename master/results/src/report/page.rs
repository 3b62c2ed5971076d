//! One HTML page of many parts: template, style, scripts, data. It loads nothing, from anywhere.

use std::io::Write;

use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;
use serde::Serialize;

use crate::error::Fault;
use crate::html;

const PAGE: &str = include_str!("page.html");
/// In the order in which they need one another.
const SCRIPTS: [&str; 6] = [
    include_str!("matrix.js"),
    include_str!("shaders.js"),
    include_str!("view.js"),
    include_str!("charts.js"),
    include_str!("scale.js"),
    include_str!("page.js"),
];

/// Numbers that are too many for JSON, little-endian.
#[derive(Debug)]
pub(crate) struct Blob {
    /// Id of the element that has them.
    pub(crate) name: String,
    pub(crate) bytes: Vec<u8>,
}

/// Writes the page.
pub(crate) fn write(
    title: &str,
    facts: &impl Serialize,
    blobs: &[Blob],
    out: &mut impl Write,
) -> Result<(), Fault> {
    html::fill(PAGE, out, |name, out| {
        match name {
            "title" => out.write_all(html::escaped(title).as_bytes())?,
            "style" => out.write_all(html::STYLE.as_bytes())?,
            "scripts" => SCRIPTS
                .iter()
                .try_for_each(|script| out.write_all(script.as_bytes()))?,
            "facts" => out.write_all(html::json(facts)?.as_bytes())?,
            _ => blobs.iter().try_for_each(|blob| embed(blob, out))?,
        }
        Ok(())
    })
}

fn embed(blob: &Blob, out: &mut impl Write) -> Result<(), Fault> {
    let name = html::escaped(&blob.name);
    write!(out, "<script type=\"text/plain\" id=\"{name}\">")?;
    let mut base64 = EncoderWriter::new(&mut *out, &STANDARD);
    base64.write_all(&blob.bytes)?;
    base64.finish()?;
    drop(base64);
    out.write_all(b"</script>\n")?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine;

    fn page(title: &str, fact: &str, bytes: &[u8]) -> String {
        let blob = Blob {
            name: "numbers".to_owned(),
            bytes: bytes.to_vec(),
        };
        let mut out = Vec::new();
        write(title, &fact, &[blob], &mut out).expect("written");
        String::from_utf8(out).expect("text")
    }

    #[test]
    fn names_cannot_break_out() {
        let evil = "</script><script>alert(1)</script>&<!--\"";
        let plain = page("plain", "plain", b"").matches("<script").count();
        let text = page(evil, evil, b"");
        assert_eq!(text.matches("<script").count(), plain);
        assert_eq!(text.matches("</script").count(), plain);
        assert!(text.contains("&lt;/script&gt;"));
        assert!(!text.contains("alert(1)</"));
    }

    #[test]
    fn numbers_come_back() {
        for length in 0..10 {
            let bytes: Vec<u8> = (0..length).map(|k| k * 27 + 3).collect();
            let text = page("t", "f", &bytes);
            let (_, after) = text.split_once("id=\"numbers\">").expect("embedded");
            let (base64, _) = after.split_once('<').expect("ended");
            assert_eq!(STANDARD.decode(base64).expect("base64"), bytes);
        }
    }

    #[test]
    fn nothing_is_loaded() {
        let text = page("t", "f", b"");
        for outside in ["http:", "https:", "src=", "@import", "url(", "fetch(", "{{"] {
            assert!(!text.contains(outside), "{outside}");
        }
        assert!(text.contains("default-src 'none'"));
    }
}

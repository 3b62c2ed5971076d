//! What makes a series the same one.

use std::fmt::{self, Debug, Write};

/// A hash of all that the results depend on, each in the words of `Debug`: those of a number name its very bits, and no
/// field is left out.
pub fn key(parts: &[&dyn Debug]) -> [u8; 32] {
    let mut hash = Hash(blake3::Hasher::new());
    for part in parts {
        // a hash takes all that it is given
        let _ = write!(hash, "{part:?}\0");
    }
    hash.0.finalize().into()
}

struct Hash(blake3::Hasher);

impl Write for Hash {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_bit_is_another_series() {
        let a = key(&[&0.3, &"x"]);
        assert_eq!(a, key(&[&0.3, &"x"]));
        assert_ne!(a, key(&[&(0.1 + 0.2), &"x"]));
        assert_ne!(key(&[&"a", &"b"]), key(&[&"ab", &""]));
    }
}

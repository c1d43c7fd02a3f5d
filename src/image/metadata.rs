//! What a file says about how its image was made.

use std::fmt::Display;

use crate::image::ImageError;

/// An ordered list of (key, value): settings, seed, device, version.
///
/// PNG keeps them as tEXt or iTXt chunks, OpenEXR as string attributes `photolith.KEY`, Radiance HDR
/// as comment lines; PFM has no place for them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Metadata(Vec<(String, String)>);

impl Metadata {
    /// No entries.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an entry at the end. Whether a file can carry it is checked on writing.
    pub fn push(&mut self, key: impl Into<String>, value: impl Display) {
        self.0.push((key.into(), value.to_string()));
    }

    /// The value of the first entry with this key.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.iter().find(|(k, _)| *k == key).map(|(_, value)| value)
    }

    /// All entries in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.0.iter().map(|(key, value)| (key.as_str(), value.as_str()))
    }

    /// Checks that every format can carry every entry: keys of 1..=64 letters, digits, `_`, `-` and `.`,
    /// each used once, and values without NUL.
    pub(super) fn check(&self) -> Result<(), ImageError> {
        for (i, (key, value)) in self.0.iter().enumerate() {
            let fail = |problem| Err(ImageError::Metadata { key: key.clone(), problem });
            if !is_key(key) {
                return fail("a key has 1 to 64 letters, digits, '_', '-' or '.'");
            }
            if self.0[..i].iter().any(|(earlier, _)| earlier == key) {
                return fail("the key is there twice");
            }
            if value.contains('\0') {
                return fail("the value contains a NUL character");
            }
        }
        Ok(())
    }
}

/// Whether `text` is a key that every format can carry.
pub(super) fn is_key(text: &str) -> bool {
    (1..=64).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_alphanumeric() || b"_-.".contains(&b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_that_no_file_can_carry_are_refused() {
        for (key, value) in [("", "x"), ("a b", "x"), ("a:b", "x"), ("é", "x"), ("a", "x\0")] {
            let mut metadata = Metadata::new();
            metadata.push(key, value);
            assert!(matches!(metadata.check(), Err(ImageError::Metadata { .. })), "{key:?} {value:?}");
        }
        let mut twice = Metadata::new();
        twice.push("seed", 1);
        twice.push("seed", 2);
        assert!(twice.check().unwrap_err().to_string().contains("twice"));
        let mut good = Metadata::new();
        good.push("seed", 1);
        good.push("scene.file", "a: b\nc é");
        assert!(good.check().is_ok());
        assert_eq!(good.get("scene.file"), Some("a: b\nc é"));
    }
}

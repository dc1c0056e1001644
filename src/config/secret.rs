//! The secret that signs what is sent to a webhook.

use super::word_file::{self, WordFileError, WordKind};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt;
use std::path::Path;

/// What it begins with.
const PREFIX: &str = "whsec_";
/// How many bytes it has; Standard Webhooks.
const LENGTHS: std::ops::RangeInclusive<usize> = 24..=64;
const SECRET: WordKind = WordKind {
    name: "secret",
    expected: "whsec_ and 24 to 64 bytes in base64, as from: echo whsec_$(openssl rand -base64 32)",
};

/// A secret; nothing prints it.
#[derive(Clone)]
pub struct Secret(Vec<u8>);

impl Secret {
    /// Reads the one word in `file`.
    ///
    /// # Errors
    /// [`WordFileError`].
    pub fn read(file: &Path) -> Result<Self, WordFileError> {
        word_file::read(file, &SECRET, |word| {
            let encoded = word.strip_prefix(PREFIX)?;
            let key = STANDARD.decode(encoded).ok()?;
            LENGTHS.contains(&key.len()).then_some(Self(key))
        })
    }

    /// The key itself.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(..)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_secret_is_long_enough_and_says_what_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("secret");
        for (text, is_good) in [
            ("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw\n", true),
            ("MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw", false),
            ("whsec_MfKQ", false),
            ("whsec_", false),
        ] {
            std::fs::write(&file, text).unwrap();
            assert_eq!(Secret::read(&file).is_ok(), is_good, "{text}");
        }
        assert!(Secret::read(&folder.path().join("none")).is_err());
    }
}

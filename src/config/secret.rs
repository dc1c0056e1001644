//! The secret that signs what is sent to a webhook.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// What it begins with.
const PREFIX: &str = "whsec_";
/// How many bytes it has; Standard Webhooks.
const LENGTHS: std::ops::RangeInclusive<usize> = 24..=64;

/// A secret; nothing prints it.
#[derive(Clone)]
pub struct Secret(Vec<u8>);

/// A file that holds no usable secret.
#[derive(Debug, thiserror::Error)]
pub enum SecretError {
    /// It cannot be read.
    #[error("cannot read the secret file {}: {source}", .file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// What it holds cannot be a secret.
    #[error(
        "the secret file {} must hold whsec_ and 24 to 64 bytes in base64, as from: echo whsec_$(openssl rand -base64 32)",
        .file.display()
    )]
    Unusable {
        /// The file.
        file: PathBuf,
    },
}

impl Secret {
    /// Reads the one word in `file`.
    ///
    /// # Errors
    /// [`SecretError`].
    pub fn read(file: &Path) -> Result<Self, SecretError> {
        let text = std::fs::read_to_string(file).map_err(|source| SecretError::Unreadable {
            file: file.to_owned(),
            source,
        })?;
        let encoded = text.trim().strip_prefix(PREFIX);
        let key = encoded.and_then(|encoded| STANDARD.decode(encoded).ok());
        key.filter(|key| LENGTHS.contains(&key.len()))
            .map(Self)
            .ok_or_else(|| SecretError::Unusable {
                file: file.to_owned(),
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

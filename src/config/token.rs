//! The secret that a caller from elsewhere must know.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use subtle::ConstantTimeEq;

/// A shorter one can be guessed.
const SHORTEST: usize = 16;

/// A secret; nothing prints it.
#[derive(Clone)]
pub struct Token(String);

/// A file that holds no usable token.
#[derive(Debug, thiserror::Error)]
pub enum TokenError {
    /// It cannot be read.
    #[error("cannot read the token file {}: {source}", .file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// What it holds cannot be a token.
    #[error(
        "the token file {} must hold one word of {SHORTEST} characters or more, as from: openssl rand -hex 32",
        .file.display()
    )]
    Unusable {
        /// The file.
        file: PathBuf,
    },
}

impl Token {
    /// Reads the one word in `file`.
    ///
    /// # Errors
    /// [`TokenError`].
    pub fn read(file: &Path) -> Result<Self, TokenError> {
        let text = std::fs::read_to_string(file).map_err(|source| TokenError::Unreadable {
            file: file.to_owned(),
            source,
        })?;
        let word = text.trim();
        let is_word = word.len() >= SHORTEST && word.bytes().all(|byte| byte.is_ascii_graphic());
        is_word
            .then(|| Self(word.to_owned()))
            .ok_or_else(|| TokenError::Unusable {
                file: file.to_owned(),
            })
    }

    /// Whether `given` is the secret, in a time that says nothing of where it differs.
    pub fn is(&self, given: &[u8]) -> bool {
        self.0.as_bytes().ct_eq(given).into()
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(..)")
    }
}

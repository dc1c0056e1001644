//! The secret that a caller from elsewhere must know.

use super::word_file::{self, WordFileError, WordKind};
use std::fmt;
use std::path::Path;
use subtle::ConstantTimeEq;

/// A shorter one can be guessed.
const SHORTEST: usize = 16;
const TOKEN: WordKind = WordKind {
    name: "token",
    expected: "one word of 16 characters or more, as from: openssl rand -hex 32",
};

/// A secret; nothing prints it.
#[derive(Clone)]
pub struct Token(String);

impl Token {
    /// Reads the one word in `file`.
    ///
    /// # Errors
    /// [`WordFileError`].
    pub fn read(file: &Path) -> Result<Self, WordFileError> {
        word_file::read(file, &TOKEN, |word| {
            let is_plain = word.bytes().all(|byte| byte.is_ascii_graphic());
            (word.len() >= SHORTEST && is_plain).then(|| Self(word.to_owned()))
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

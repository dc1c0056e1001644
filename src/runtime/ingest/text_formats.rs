//! The table of the formats of text files.

use super::csv::CSV;
use super::ndjson::NDJSON;
use super::text_format::TextFormat;
use super::toa5::TOA5;

/// All of them. A text whose name is not known is of the first one that it begins as; the last takes every text.
pub static TEXT_FORMATS: [&TextFormat; 3] = [&NDJSON, &TOA5, &CSV];

impl TextFormat {
    /// The format of this name; `None` of what is no text.
    pub fn named(name: &str) -> Option<&'static Self> {
        TEXT_FORMATS.into_iter().find(|one| one.name == name)
    }

    /// The format of the files with this ending, in lower case.
    pub fn of_extension(extension: &str) -> Option<&'static Self> {
        let mut all = TEXT_FORMATS.into_iter();
        all.find(|one| one.extensions.contains(&extension))
    }
}

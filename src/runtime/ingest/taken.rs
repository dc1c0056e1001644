//! What came of one line of a text file.

use super::{IngestError, Item};

/// What came of one line.
#[derive(Debug, Default)]
pub struct LineResult {
    /// What it holds.
    pub items: Vec<Item>,
    /// What of it cannot be used, and why.
    pub fault: Option<IngestError>,
    /// What has been found out about the file, each once.
    pub remarks: Vec<Remark>,
}

/// Something that a person should know of a file of which nothing is lost by it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remark {
    /// The column, or what else it is about; one remark about each is enough.
    pub about: String,
    /// What there is to know.
    pub text: String,
}

impl From<Result<Vec<Item>, IngestError>> for LineResult {
    fn from(taken: Result<Vec<Item>, IngestError>) -> Self {
        match taken {
            Ok(items) => Self {
                items,
                ..Self::default()
            },
            Err(fault) => Self {
                fault: Some(fault),
                ..Self::default()
            },
        }
    }
}

//! What came of one line of a text file.

use super::remark::Remark;
use super::{IngestError, Item};
use std::fmt;

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

/// What becomes of a row or message that cannot be used.
pub(super) enum BadRows<'a> {
    /// The whole file is refused.
    Refuse,
    /// It is handed on, and the rest is read.
    SetAside(&'a mut dyn FnMut(IngestError)),
}

impl BadRows<'_> {
    /// Meets one that cannot be used.
    pub(super) fn meet(&mut self, fault: IngestError) -> Result<(), IngestError> {
        match self {
            Self::Refuse => Err(fault),
            Self::SetAside(aside) => {
                aside(fault);
                Ok(())
            }
        }
    }

    pub(super) fn are_set_aside(&self) -> bool {
        matches!(self, Self::SetAside(_))
    }
}

impl fmt::Debug for BadRows<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.are_set_aside() {
            "SetAside"
        } else {
            "Refuse"
        })
    }
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

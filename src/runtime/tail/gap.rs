//! What may be missing of a file, and whether others are to wait for it.

use super::decode::Arrival;
use super::file::{Content, FileTail, VALUELESS_BYTES, read_at};
use crate::monitor::Input;
use crate::reading::Timestamp;
use std::fs::File;
use std::path::Path;

impl FileTail {
    /// Whether others are to wait until more of it has been read.
    pub(super) fn is_awaited(&self) -> bool {
        self.has_more && self.valueless < VALUELESS_BYTES
    }

    /// It is no longer under its name, nor in its folder: whether something may have been written to it after the last
    /// look, and what was read of it is not in the file at `path` either.
    pub(super) fn is_lost(&self, path: &Path) -> bool {
        let is_read = self.at > 0 && !matches!(self.content, Content::Refused | Content::Complete);
        let goes_on = || {
            let length = self.at - self.mark_start();
            let file = File::open(path).ok()?;
            Some(read_at(&file, self.mark_start(), length).ok()? == self.mark)
        };
        self.is_restored && is_read && !goes_on().unwrap_or(false)
    }

    /// That readings of it may be missing.
    pub(super) fn lost(&self) -> Arrival {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let at = self.at;
        tracing::warn!(file = %self.path.display(), at, "gone since the last stop: what was written to it after that may be missing");
        let text = format!(
            "{name}: gone since the last stop, after {at} bytes had been read; what was written to it after that may be missing"
        );
        self.gap(text)
    }

    pub(super) fn gap(&self, text: String) -> Arrival {
        let time = self.newest.unwrap_or(Timestamp::MIN);
        let kind = "possible-gap".to_owned();
        let input = Input::Trouble { kind, text };
        Arrival { time, input }
    }
}

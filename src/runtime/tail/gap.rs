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

    /// Nobody knows where it is: whether something may have been written to it after the last look that is not in the
    /// file at `path` either, as in a copy that was put in its place.
    pub(super) fn is_lost(&self, path: &Path) -> bool {
        let is_known = self.at > 0 || self.origin != self.path;
        is_known && self.may_grow() && !self.goes_on(path)
    }

    /// Whether more may come: a file that has not been written to for days has ended. How it stands with one that has
    /// not been looked at since a restart is not known.
    pub(super) fn may_grow(&self) -> bool {
        !matches!(self.content, Content::Refused(_) | Content::Complete)
            && (self.is_restored || !self.is_old())
    }

    /// Whether what was read last stands in the file at `path`, in its place. What is no file is not opened: a pipe without a writer keeps
    /// whoever opens it waiting.
    pub(super) fn goes_on(&self, path: &Path) -> bool {
        if !path.is_file() {
            return false;
        }
        let length = self.at - self.mark_start();
        let bytes = File::open(path).and_then(|file| read_at(&file, self.mark_start(), length));
        bytes.is_ok_and(|bytes| bytes == self.mark)
    }

    /// That readings of it may be missing: `what` has become of it.
    pub(super) fn lost(&self, what: &str) -> Arrival {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let at = self.at;
        tracing::warn!(file = %self.path.display(), at, "{what}: what was written to it after that may be missing");
        let text = format!(
            "{name}: {what}, after {at} bytes had been read; what was written to it after that may be missing"
        );
        self.gap(text)
    }

    /// The same file, and what we have read of it is no longer there: what was written after our last look and cut
    /// off before this one cannot be known.
    pub(super) fn report_cut(&mut self, size: u64) {
        let (file, at) = (self.path.display(), self.at);
        tracing::warn!(%file, at, size, "cut off while it was followed: read from its start, readings may be missing");
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let text = format!(
            "{name}: cut off at {size} bytes after {at} had been read; what was written just before may be missing"
        );
        let gap = self.gap(text);
        self.pending.push_back(gap);
    }

    pub(super) fn gap(&self, text: String) -> Arrival {
        let time = self.newest.unwrap_or(Timestamp::MIN);
        let kind = "possible-gap".to_owned();
        let input = Input::Trouble { kind, text };
        Arrival { time, input }
    }
}

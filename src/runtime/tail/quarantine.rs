//! Lines of a file that cannot be used, and files that are refused.

use super::file::{Content, FileTail};
use super::text::{BadLine, LinesRead};
use crate::runtime::ingest::IngestError;
use crate::runtime::log::is_logged;

/// Characters of a line that are logged of it.
const SHOWN: usize = 200;

impl FileTail {
    /// Takes what came of some bytes.
    pub(super) fn take(&mut self, fed: LinesRead) {
        self.refused_rows.note(&fed);
        for remark in fed.remarks {
            if self.decoder.is_news(&remark) {
                let file = self.path.display();
                if remark.is_loss {
                    tracing::warn!(%file, "{remark}");
                } else {
                    tracing::info!(%file, "{remark}");
                }
            }
        }
        for (_, item) in fed.items {
            self.expect(item);
        }
        let mut bad = fed.bad.into_iter();
        let last = fed.is_lost.then(|| bad.next_back()).flatten();
        for line in bad {
            self.quarantine_line(&line);
        }
        if let Some(last) = last {
            self.refuse(&*last.error);
        }
    }

    fn quarantine_line(&mut self, line: &BadLine) {
        self.quarantined += 1;
        let (file, total) = (self.path.display(), self.quarantined);
        if !is_logged(total) {
            return;
        }
        let BadLine {
            number,
            text,
            error,
        } = line;
        if error.is::<IngestError>() {
            // Names the file, the line and what stands there.
            tracing::warn!(%error, total, "line quarantined");
        } else {
            let text: String = text.chars().take(SHOWN).collect();
            tracing::warn!(%file, line = number, text, %error, total, "line quarantined");
        }
    }

    pub(super) fn refuse(&mut self, error: &dyn std::error::Error) {
        self.quarantined += 1;
        tracing::warn!(file = %self.path.display(), %error, "file refused until it is replaced");
        self.content = Content::Refused(error.to_string());
    }
}

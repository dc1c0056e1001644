//! Lines on their way to a journal; while the disk is full they wait here, and not without bound.

use super::journal::{self, Journal};
use std::collections::VecDeque;
use std::io;

/// Lines that may wait.
const MOST: usize = 20_000;

/// What a line is worth when there are too many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Worth {
    /// Dropped first.
    Little,
    /// Dropped when nothing of little worth is left.
    Much,
}

/// Lines that wait for a journal, in order.
#[derive(Debug, Default)]
pub(super) struct Backlog {
    lines: VecDeque<(Worth, String)>,
    is_full: bool,
    dropped: u64,
}

impl Backlog {
    pub(super) fn add(&mut self, worth: Worth, line: String) {
        self.lines.push_back((worth, line));
    }

    /// Lines dropped so far.
    pub(super) fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Appends everything that waits. On a full disk it goes on waiting, which is logged and no
    /// error; `false` then.
    pub(super) fn append_to(&mut self, journal: &mut Journal, what: &str) -> io::Result<bool> {
        let lines: Vec<String> = self.lines.iter().map(|(_, line)| line.clone()).collect();
        match journal.append(&lines) {
            Ok(()) => {
                if std::mem::take(&mut self.is_full) {
                    let (written, dropped) = (lines.len(), self.dropped);
                    tracing::info!(what, written, dropped, "there is room on the disk again");
                }
                self.lines.clear();
                Ok(true)
            }
            Err(error) if journal::is_full(&error) => {
                let dropped = self.shorten(MOST);
                if !self.is_full || dropped > 0 {
                    let (waiting, dropped) = (self.lines.len(), self.dropped);
                    tracing::error!(what, %error, waiting, dropped, "no room on the disk: lines wait");
                }
                self.is_full = true;
                Ok(false)
            }
            Err(error) => {
                self.lines.clear();
                Err(error)
            }
        }
    }

    /// Drops the oldest lines beyond `most`, those of little worth first; says how many.
    fn shorten(&mut self, most: usize) -> usize {
        let mut excess = self.lines.len().saturating_sub(most);
        let dropped = excess;
        for dispensable in [Worth::Little, Worth::Much] {
            self.lines.retain(|(worth, _)| {
                let goes = excess > 0 && *worth == dispensable;
                excess -= usize::from(goes);
                !goes
            });
        }
        self.dropped += dropped as u64;
        dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_lines_of_little_worth_go_first() {
        let mut backlog = Backlog::default();
        for (worth, line) in [
            (Worth::Much, "alert"),
            (Worth::Little, "refit 1"),
            (Worth::Little, "refit 2"),
            (Worth::Much, "flip"),
        ] {
            backlog.add(worth, line.to_owned());
        }
        let kept = |backlog: &Backlog| -> Vec<String> {
            backlog.lines.iter().map(|(_, line)| line.clone()).collect()
        };
        assert_eq!(backlog.shorten(3), 1);
        assert_eq!(kept(&backlog), ["alert", "refit 2", "flip"]);
        assert_eq!(backlog.shorten(1), 2);
        assert_eq!(kept(&backlog), ["flip"]);
        assert_eq!(backlog.dropped(), 3);
    }
}

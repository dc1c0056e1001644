//! Cuts a growing text into lines: bytes in, whole lines out, a partial last one held; but where whoever writes ends each line only before the next
//! one, the last one is whole too.

use crate::runtime::ingest::{Transcoder, latin1};
use serde::{Deserialize, Serialize};

/// Longest line that is read, bytes.
pub const LONGEST_LINE: usize = 64 * 1024;

/// So many lines in a row are ended by what is written next before the last one counts as whole without its newline.
const ENDED_LATER: u8 = 3;

/// A whole line, without its newline.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TailLine {
    /// Its number, from 1.
    pub number: u64,
    /// Its text, or why it cannot be one.
    pub text: Result<String, LineFault>,
}

/// Why a line is no text.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LineFault {
    /// Longer than [`LONGEST_LINE`].
    #[error("longer than {LONGEST_LINE} bytes")]
    TooLong,
    /// Not UTF-8.
    #[error("not UTF-8: {shown:?}")]
    NotUtf8 {
        /// What can be shown of it.
        shown: String,
        /// The line, were it in Latin-1.
        latin1: Option<String>,
    },
    /// It has NUL bytes, as a file has that was not synced before the power failed.
    #[error("has NUL bytes")]
    Nul,
}

/// The state between two reads; memory is bounded by [`LONGEST_LINE`].
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lines {
    /// Absent in what was kept before there was one.
    #[serde(default)]
    transcoder: Transcoder,
    partial: Vec<u8>,
    too_long: bool,
    number: u64,
    /// How many times in a row what was written next began by ending the line that was held.
    #[serde(default)]
    ended_later: u8,
    /// Whether the line that is held has been returned.
    #[serde(default)]
    is_returned: bool,
    /// Whether NUL bytes stand before the line that is held: a block that was not synced before the power failed, or the hole that a writer leaves
    /// who goes on where he was after the file was truncated. They take nothing from what is written behind them.
    #[serde(default)]
    is_behind_nul: bool,
}

impl Lines {
    /// The writer of this text is known to end each line only before the next one.
    pub fn expect_ended_later(&mut self) {
        self.ended_later = self.ended_later.max(ENDED_LATER);
    }

    /// Of the text that the same writer puts in place of this one: it may leave its last line without an end as well.
    #[must_use]
    pub fn written_anew(&self) -> Self {
        let ended_later = if self.is_unended() {
            self.ended_later.saturating_add(1)
        } else {
            0
        };
        Self {
            ended_later,
            ..Self::default()
        }
    }

    /// Whether nothing ends the last line so far, returned or not.
    fn is_unended(&self) -> bool {
        self.too_long || !self.partial.is_empty()
    }

    /// Whether the writer has been seen to end each line only before the next one.
    pub fn are_ended_later(&self) -> bool {
        self.ended_later >= ENDED_LATER
    }

    /// Takes the next bytes of the file and returns the lines that they complete.
    pub fn feed(&mut self, bytes: &[u8]) -> Vec<TailLine> {
        if self.number > 0 || !self.partial.is_empty() {
            self.transcoder.go_on();
        }
        let bytes = self.transcoder.feed(bytes);
        let mut lines = Vec::new();
        let mut rest = self.after_the_held(&bytes);
        while let Some(end) = rest.iter().position(|byte| *byte == b'\n') {
            self.hold(&rest[..end]);
            lines.push(self.complete());
            rest = &rest[end + 1..];
        }
        self.hold(rest);
        lines
    }

    /// What is to be read of `bytes` where the line that is held may have been returned. Where they do not end it, it was no whole line: it comes
    /// again, with its rest.
    fn after_the_held<'a>(&mut self, bytes: &'a [u8]) -> &'a [u8] {
        let mut end = [&b"\n"[..], b"\r\n"].into_iter();
        let rest = end.find_map(|end| bytes.strip_prefix(end));
        let rest = rest.filter(|_| !self.partial.is_empty());
        let ends_one = u8::from(rest.is_some());
        self.ended_later = self.ended_later.saturating_add(ends_one);
        // Who writes a row with its end does not end it with the next one.
        if rest.unwrap_or(bytes).ends_with(b"\n") {
            self.ended_later = 0;
        }
        if bytes.is_empty() || !std::mem::take(&mut self.is_returned) {
            return bytes;
        }
        if let Some(rest) = rest {
            self.partial.clear();
            return rest;
        }
        self.number -= 1;
        self.ended_later = 0;
        bytes
    }

    /// The line that is held, where it is whole although no newline follows it: whoever writes ends each line only before the next one, and has
    /// written nothing for some time.
    pub fn unended(&mut self) -> Option<TailLine> {
        if !self.are_ended_later() || self.is_returned || self.partial.is_empty() {
            return None;
        }
        let held = self.partial.clone();
        let line = self.complete();
        (self.partial, self.is_returned) = (held, true);
        Some(line)
    }

    /// The number of the last whole line.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// Whether the text is in UTF-16.
    pub fn is_utf16(&self) -> bool {
        self.transcoder.is_utf16()
    }

    /// Whether the text ends within a line.
    pub fn is_within_a_line(&self) -> bool {
        self.is_unended() && !self.is_returned
    }

    fn hold(&mut self, mut bytes: &[u8]) {
        if self.partial.is_empty() && !self.too_long {
            let nul = bytes.iter().take_while(|byte| **byte == 0).count();
            self.is_behind_nul |= nul > 0;
            bytes = &bytes[nul..];
        }
        if self.too_long || self.partial.len() + bytes.len() > LONGEST_LINE {
            self.too_long = true;
            self.partial = Vec::new();
        } else {
            self.partial.extend_from_slice(bytes);
        }
    }

    fn complete(&mut self) -> TailLine {
        self.number += 1;
        let bytes = std::mem::take(&mut self.partial);
        let is_nul_alone = std::mem::take(&mut self.is_behind_nul) && bytes.is_empty();
        let text = if std::mem::take(&mut self.too_long) {
            Err(LineFault::TooLong)
        } else if is_nul_alone || bytes.contains(&0) {
            Err(LineFault::Nul)
        } else {
            String::from_utf8(bytes).map_err(|error| LineFault::NotUtf8 {
                shown: shown(error.as_bytes()),
                latin1: latin1(error.as_bytes()),
            })
        };
        TailLine {
            number: self.number,
            text: text.map(|text| text.trim_end_matches('\r').to_owned()),
        }
    }
}

fn shown(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).chars().take(200).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(lines: Vec<TailLine>) -> Vec<String> {
        lines.into_iter().map(|line| line.text.unwrap()).collect()
    }

    #[test]
    fn the_lines_are_the_same_however_the_bytes_are_split() {
        let text = "time,é\r\n1,2\n\n3,4\n5,";
        let whole = Lines::default().feed(text.as_bytes());
        for step in 1..text.len() {
            let mut lines = Lines::default();
            let split: Vec<TailLine> = text
                .as_bytes()
                .chunks(step)
                .flat_map(|part| lines.feed(part))
                .collect();
            assert_eq!(split, whole, "{step} bytes a read");
        }
        assert_eq!(texts(whole), ["time,é", "1,2", "", "3,4"]);
    }

    #[test]
    fn a_partial_line_is_held_until_its_newline() {
        let mut lines = Lines::default();
        assert_eq!(texts(lines.feed(b"a\n2017-06-0")), ["a"]);
        assert!(lines.feed(b"6,12").is_empty());
        let line = lines.feed(b".5\n").remove(0);
        assert_eq!(
            (line.number, line.text.unwrap().as_str()),
            (2, "2017-06-06,12.5")
        );
    }

    #[test]
    fn a_last_line_is_whole_where_three_before_it_were_ended_by_what_came_next() {
        let mut lines = Lines::default();
        assert_eq!(texts(lines.feed(b"a\n1,2")), ["a"]);
        for (next, ended) in [("\n2,3", "1,2"), ("\r\n3,4", "2,3")] {
            assert_eq!(texts(lines.feed(next.as_bytes())), [ended]);
            assert_eq!(lines.unended(), None, "{next}");
        }
        assert_eq!(texts(lines.feed(b"\n4,5")), ["3,4"]);
        let whole = lines.unended().unwrap();
        assert_eq!((whole.number, whole.text.as_deref()), (5, Ok("4,5")));
        assert!(lines.unended().is_none() && !lines.is_within_a_line());
        // It was returned; what comes next is the sixth line.
        assert!(lines.feed(b"\n5,6").is_empty());
        assert_eq!(lines.unended().unwrap().number, 6);
        // It had not been whole: it comes again.
        assert!(lines.feed(b"7").is_empty());
        assert_eq!(lines.unended(), None, "no more");
        let again = lines.feed(b"8\n").remove(0);
        assert_eq!((again.number, again.text.as_deref()), (6, Ok("5,678")));
        assert_eq!(lines.feed(b"6,7\n").remove(0).number, 7);
    }

    #[test]
    fn a_line_that_is_no_text_spoils_no_other() {
        let mut lines = Lines::default();
        let got = lines.feed(b"a\n\xff\xfe\nb\n\0\0\nc\n");
        assert_eq!(got[2].text.as_deref(), Ok("b"));
        assert_eq!(got[4].text.as_deref(), Ok("c"));
        assert!(matches!(got[1].text, Err(LineFault::NotUtf8 { .. })));
        assert_eq!(got[3].text, Err(LineFault::Nul));
    }

    #[test]
    fn what_stands_behind_nul_bytes_is_read() {
        let mut lines = Lines::default();
        let mut text = b"a\n".to_vec();
        text.extend(vec![0; 3 * LONGEST_LINE]);
        text.extend(b"1,2\n3,4\n5\0,6\n");
        let got: Vec<TailLine> = text
            .chunks(1000)
            .flat_map(|part| lines.feed(part))
            .collect();
        let (last, others) = got.split_last().unwrap();
        assert_eq!(texts(others.to_vec()), ["a", "1,2", "3,4"]);
        assert_eq!(last.text, Err(LineFault::Nul));
    }

    #[test]
    fn a_line_without_end_takes_no_more_memory_than_the_longest_line() {
        let mut lines = Lines::default();
        for _ in 0..1000 {
            assert!(lines.feed(&[b'x'; 10_000]).is_empty());
            assert!(lines.partial.capacity() <= 2 * LONGEST_LINE);
        }
        let got = lines.feed(b"\nnext\n");
        assert_eq!(got[0].text, Err(LineFault::TooLong));
        assert_eq!(got[1].text.as_deref(), Ok("next"));
    }
}

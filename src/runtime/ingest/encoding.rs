//! Text that is not in UTF-8: UTF-16 by its byte order mark, and lines in Latin-1.

use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// How a file's text is encoded, as its first bytes say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Encoding {
    /// UTF-8, or what extends ASCII.
    Bytes,
    Utf16Le,
    Utf16Be,
}

/// Turns the bytes of one file into UTF-8, piece by piece, where it begins with the mark of UTF-16;
/// every other file is passed on as it is.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Transcoder {
    encoding: Option<Encoding>,
    /// The beginning of a character, whose rest comes with the next bytes.
    held: Vec<u8>,
}

impl Transcoder {
    /// For a file whose beginning has been read before.
    pub fn go_on(&mut self) {
        self.encoding.get_or_insert(Encoding::Bytes);
    }

    /// Whether the file is in UTF-16.
    pub fn is_utf16(&self) -> bool {
        matches!(self.encoding, Some(Encoding::Utf16Le | Encoding::Utf16Be))
    }

    /// The next bytes, in UTF-8.
    pub fn feed<'a>(&mut self, bytes: &'a [u8]) -> Cow<'a, [u8]> {
        let encoding = match (self.encoding, &self.held[..], bytes) {
            (Some(encoding), ..) => encoding,
            (None, [], [0xff, 0xfe, ..]) | (None, [0xff], [0xfe, ..]) => Encoding::Utf16Le,
            (None, [], [0xfe, 0xff, ..]) | (None, [0xfe], [0xff, ..]) => Encoding::Utf16Be,
            (None, [], [] | [0xff | 0xfe]) => {
                self.held.extend_from_slice(bytes);
                return Cow::Borrowed(&[]);
            }
            (None, ..) => Encoding::Bytes,
        };
        self.encoding = Some(encoding);
        let joined = if self.held.is_empty() {
            Cow::Borrowed(bytes)
        } else {
            let mut joined = std::mem::take(&mut self.held);
            joined.extend_from_slice(bytes);
            Cow::Owned(joined)
        };
        let unit: fn([u8; 2]) -> u16 = match encoding {
            Encoding::Bytes => return joined,
            Encoding::Utf16Le => u16::from_le_bytes,
            Encoding::Utf16Be => u16::from_be_bytes,
        };
        let mut pairs = joined.chunks_exact(2);
        let mut units: Vec<u16> = pairs
            .by_ref()
            .map(|pair| unit([pair[0], pair[1]]))
            .collect();
        let mut whole = joined.len() - pairs.remainder().len();
        if units
            .last()
            .is_some_and(|last| (0xd800..0xdc00).contains(last))
        {
            units.pop();
            whole -= 2;
        }
        self.held = joined[whole..].to_vec();
        Cow::Owned(String::from_utf16_lossy(&units).into_bytes())
    }
}

/// A line in Latin-1 (ISO 8859-1); `None` where its control characters show that it is no text. What
/// Windows has in their upper range becomes a replacement character.
pub fn latin1(line: &[u8]) -> Option<String> {
    let letter = |byte: &u8| match byte {
        b'\t' | b'\r' | 0x20..=0x7e | 0xa0..=0xff => Some(char::from(*byte)),
        0x80..=0x9f => Some(char::REPLACEMENT_CHARACTER),
        0x00..=0x1f | 0x7f => None,
    };
    line.iter().map(letter).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn utf16(text: &str, bytes: fn(u16) -> [u8; 2]) -> Vec<u8> {
        let units = std::iter::once(0xfeff).chain(text.encode_utf16());
        units.flat_map(bytes).collect()
    }

    #[test]
    fn utf_16_is_the_same_text_however_its_bytes_are_split() {
        let text = "time,é\n1,𝄞\n";
        for bytes in [utf16(text, u16::to_le_bytes), utf16(text, u16::to_be_bytes)] {
            for step in 1..bytes.len() {
                let mut transcoder = Transcoder::default();
                let parts = bytes.chunks(step);
                let whole: Vec<u8> = parts
                    .flat_map(|part| transcoder.feed(part).into_owned())
                    .collect();
                assert_eq!(String::from_utf8(whole).unwrap(), format!("\u{feff}{text}"));
                assert!(transcoder.is_utf16());
            }
        }
    }

    #[test]
    fn what_has_no_mark_of_utf_16_is_passed_on_as_it_is() {
        for bytes in [&b"time,\xe9\n"[..], b"\xff\n", b"\xff", b"x"] {
            let mut transcoder = Transcoder::default();
            let mut whole: Vec<u8> = bytes
                .chunks(1)
                .flat_map(|part| transcoder.feed(part).into_owned())
                .collect();
            whole.extend(transcoder.feed(b"!").iter());
            assert_eq!(whole, [bytes, b"!"].concat());
        }
    }

    #[test]
    fn latin_1_is_text_and_control_characters_are_not() {
        assert_eq!(latin1(b"B\xf6schung").as_deref(), Some("Böschung"));
        assert_eq!(latin1(b"a\x00b"), None);
    }
}

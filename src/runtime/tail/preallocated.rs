//! Files of a fixed size that are filled from their front: NUL bytes stand where nothing has been written yet.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

/// Fewer are no room that waits to be written to: UTF-16 has some.
const FEWEST_NUL: usize = 8;
/// More are not looked through at once.
const MOST_NUL: u64 = 64 << 20;
/// Bytes that are looked through at once.
const PIECE: usize = 256 * 1024;

/// How much of what was read of a text counts as read.
pub(super) struct ReadSpan {
    /// Of the bytes that were read, from the first on.
    pub(super) count: usize,
    /// Where the next read begins, bytes from the start of the file.
    pub(super) next: u64,
}

impl ReadSpan {
    /// Of `bytes`, which stand in `file` from `at` on. NUL bytes up to the end of the file do not count: they may still be written over. Those with
    /// something behind them are passed by, as a block that was not synced before the power failed.
    pub(super) fn of(bytes: &[u8], file: &File, at: u64) -> io::Result<Self> {
        let end = at + bytes.len() as u64;
        let last = bytes.iter().rposition(|byte| *byte != 0);
        let written = last.map_or(0, |last| last + 1);
        let mut passed = 0;
        if bytes.len() - written >= FEWEST_NUL {
            let mut piece = vec![0; PIECE];
            while passed < MOST_NUL {
                let count = file.read_at(&mut piece, end + passed)?;
                if count == 0 {
                    return Ok(Self {
                        count: written,
                        next: at + written as u64,
                    });
                }
                let next = piece[..count].iter().position(|byte| *byte != 0);
                passed += next.unwrap_or(count) as u64;
                if next.is_some() {
                    break;
                }
            }
        }
        Ok(Self {
            count: bytes.len(),
            // Two bytes of UTF-16 stay together.
            next: end + passed - passed % 2,
        })
    }
}

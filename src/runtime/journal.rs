//! An append-only file of lines: synced after each batch, healed after a torn write.
//!
//! A full disk is no end: what could not be appended is cut off again, and whoever keeps the lines
//! can append them later.

use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, ErrorKind, Write};
use std::path::Path;

/// An open file of lines.
#[derive(Debug)]
pub struct Journal {
    file: File,
    /// After a failed append: how long the file was before it.
    torn_at: Option<u64>,
}

/// Whether `error` says that there is no room: on the disk, in the quota, or up to the longest
/// file allowed.
pub(super) fn is_full(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge
    )
}

impl Journal {
    /// Opens or creates `path` and hands every whole line in it to `each`. A last line without its
    /// newline was torn by a crash and is cut off: it was never acknowledged.
    ///
    /// # Errors
    /// When the file cannot be read or written.
    pub fn open(path: &Path, mut each: impl FnMut(&str)) -> io::Result<Self> {
        let file = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .open(path)?;
        let mut reader = BufReader::new(&file);
        let (mut whole, mut line) = (0, Vec::new());
        loop {
            line.clear();
            let count = reader.read_until(b'\n', &mut line)?;
            if count == 0 {
                break;
            }
            let Some(text) = line.strip_suffix(b"\n") else {
                tracing::warn!(file = %path.display(), bytes = count, "cut off a torn last line");
                file.set_len(whole)?;
                break;
            };
            whole += count as u64;
            each(&String::from_utf8_lossy(text));
        }
        if let Some(folder) = path.parent() {
            // Makes the file's own name durable.
            File::open(folder)?.sync_all()?;
        }
        Ok(Self {
            file,
            torn_at: None,
        })
    }

    /// Appends lines and returns when they are on the disk.
    ///
    /// # Errors
    /// When they may not be there. A failed sync is never retried: the system may have thrown the
    /// pages away and would report success the second time. Appending the lines anew is something
    /// else: the next call first cuts off whatever this one has left.
    pub fn append(&mut self, lines: &[String]) -> io::Result<()> {
        if lines.is_empty() {
            return Ok(());
        }
        let mut whole = self.file.metadata()?.len();
        if let Some(torn_at) = self.torn_at
            && torn_at < whole
        {
            self.file.set_len(torn_at)?;
            whole = torn_at;
        }
        let mut batch = lines.join("\n");
        batch.push('\n');
        self.torn_at = Some(whole);
        let written = (self.file.write_all(batch.as_bytes())).and_then(|()| self.file.sync_data());
        // Readers of the file should not see half a line for long.
        if written.is_ok() || self.file.set_len(whole).is_ok() {
            self.torn_at = None;
        }
        written
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torn_last_line_is_cut_off_and_the_next_one_stands_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("j");
        std::fs::write(&path, "one\ntw").unwrap();
        let mut lines = Vec::new();
        let mut journal = Journal::open(&path, |line| lines.push(line.to_owned())).unwrap();
        assert_eq!(lines, ["one"]);
        journal
            .append(&["two".to_owned(), "three".to_owned()])
            .unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "one\ntwo\nthree\n");
    }
}

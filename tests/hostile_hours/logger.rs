//! A logger that appends rows to its file, and what is done to the file.

use crate::slope::Measured;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

const HEADER: &str = "time,displacement_mm\n";

/// One logger with its file.
pub(crate) struct Logger {
    pub(crate) name: &'static str,
    folder: PathBuf,
    /// Measured and not written.
    kept: Vec<Measured>,
    /// The second half of a row whose first half is written.
    half: Option<(String, Measured)>,
    pub(crate) is_away: bool,
    pub(crate) writes_halves: bool,
    pub(crate) is_late: bool,
    /// Rows were written since the daemon had everything on the disk.
    pub(crate) is_unsettled: bool,
    /// It was rotated since then.
    is_rotated: bool,
    rotations: u32,
    /// The row that was written whole last.
    last: Option<Measured>,
}

impl Logger {
    pub(crate) fn new(name: &'static str, folder: &Path) -> Self {
        Self {
            name,
            folder: folder.to_owned(),
            kept: Vec::new(),
            half: None,
            is_away: false,
            writes_halves: false,
            is_late: false,
            is_unsettled: false,
            is_rotated: false,
            rotations: 0,
            last: None,
        }
    }

    pub(crate) fn file(&self) -> PathBuf {
        self.folder.join(format!("{}.csv", self.name))
    }

    pub(crate) fn keep(&mut self, measured: Vec<Measured>) {
        self.kept.extend(measured);
    }

    /// Everything in the file is on the daemon's disk.
    pub(crate) fn settle(&mut self) {
        (self.is_unsettled, self.is_rotated) = (false, false);
    }

    fn append(&mut self, text: &str) {
        self.is_unsettled = true;
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(self.file())
            .unwrap();
        if file.metadata().unwrap().len() == 0 {
            file.write_all(HEADER.as_bytes()).unwrap();
        }
        file.write_all(text.as_bytes()).unwrap();
    }

    /// Writes what it has; the rows that can be read whole from now on.
    pub(crate) fn write(&mut self) -> Vec<Measured> {
        let mut readable = Vec::new();
        if self.is_away || !self.folder.exists() {
            return readable;
        }
        if let Some((rest, measured)) = self.half.take() {
            self.append(&rest);
            readable.push(measured);
        }
        if self.is_late && self.kept.len() < 3 {
            self.last = readable.last().copied().or(self.last);
            return readable;
        }
        let mut rows = std::mem::take(&mut self.kept);
        if self.is_late {
            rows.swap(0, 1);
        }
        let last = rows.len().saturating_sub(1);
        for (index, measured) in rows.into_iter().enumerate() {
            let row = format!("{},{}\n", measured.time, measured.value);
            if self.writes_halves && index == last {
                let (first, rest) = row.split_at(row.len() / 2 + 8);
                self.append(first);
                self.half = Some((rest.to_owned(), measured));
            } else {
                self.append(&row);
                readable.push(measured);
            }
        }
        self.last = readable.last().copied().or(self.last);
        readable
    }

    /// Another value for the row that was written last, in a row of its own.
    pub(crate) fn correct(&mut self) -> Option<Measured> {
        if self.half.is_some() || self.is_away || !self.folder.exists() {
            return None;
        }
        let last = self.last.take()?;
        let corrected = Measured {
            value: ((last.value + 0.01) * 1000.0).round() / 1000.0,
            calls_red: false,
            ..last
        };
        self.append(&format!("{},{}\n", corrected.time, corrected.value));
        Some(corrected)
    }

    /// A row that was never measured, or a line that is none.
    pub(crate) fn scribble(&mut self, line: &str) {
        if self.half.is_none() && self.folder.exists() && self.file().exists() {
            self.append(line);
        }
    }

    /// Under another name, and the next row begins another file. Not twice before the daemon has had it all: what
    /// nobody looked at under a name that counts cannot be known.
    pub(crate) fn rotate(&mut self) {
        if self.half.is_some() || self.is_rotated || !self.file().exists() {
            return;
        }
        self.rotations += 1;
        self.is_rotated = self.is_unsettled;
        let other = self
            .folder
            .join(format!("{}.csv.{}", self.name, self.rotations));
        fs::rename(self.file(), other).unwrap();
    }

    /// The same rows in another file, put in its place in one go.
    pub(crate) fn replace(&mut self) {
        if self.file().exists() {
            let new = self.folder.join("new");
            fs::copy(self.file(), &new).unwrap();
            fs::rename(new, self.file()).unwrap();
        }
    }

    /// Copied away and cut to nothing: only what has been read is not lost by that.
    pub(crate) fn copy_truncate(&mut self) {
        if self.half.is_none() && !self.is_unsettled && self.file().exists() {
            self.rotations += 1;
            let other = self
                .folder
                .join(format!("{}.csv.{}", self.name, self.rotations));
            fs::copy(self.file(), other).unwrap();
            OpenOptions::new()
                .write(true)
                .open(self.file())
                .unwrap()
                .set_len(0)
                .unwrap();
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.kept.is_empty() && self.half.is_none()
    }
}

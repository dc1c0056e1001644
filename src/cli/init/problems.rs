//! What keeps a config from being written.

use super::usage;
use crate::cli::exit::NoSuchReadings;
use std::path::{Path, PathBuf};

/// What keeps a config from being written.
#[derive(Debug, Default)]
pub(super) struct Problems {
    /// What a flag decides, and what no flag mends.
    pub(super) open: Vec<String>,
    pub(super) bad: Vec<String>,
    /// What a flag decides of files, each once, with those of which it is so.
    of_files: Vec<(String, Vec<PathBuf>)>,
}

impl Problems {
    pub(super) fn leave_open(&mut self, problem: String) {
        self.open.push(problem);
    }

    /// The same of this file, as it may be of many.
    pub(super) fn leave_open_of(&mut self, file: &Path, problem: String) {
        let mut known = self.of_files.iter_mut();
        match known.find(|(one, _)| *one == problem) {
            Some((_, files)) => files.push(file.to_owned()),
            None => self.of_files.push((problem, vec![file.to_owned()])),
        }
    }

    /// As an error, where there are some.
    pub(super) fn none(self) -> anyhow::Result<()> {
        let of_files = self.of_files.iter().map(|(problem, files)| {
            let first = files[0].display();
            match files.len() {
                1 => format!("{first}: {problem}"),
                many => format!("{first} and {} more files: {problem}", many - 1),
            }
        });
        let open: Vec<String> = of_files.chain(self.open).collect();
        match (&open[..], &self.bad[..]) {
            ([], []) => Ok(()),
            ([], bad) => Err(NoSuchReadings(bad.join("\n")).into()),
            (open, bad) => Err(usage([open, bad].concat().join("\n"))),
        }
    }
}

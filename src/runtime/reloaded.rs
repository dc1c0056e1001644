//! Whether the config file as it is now is in force: kept in the state folder, for those who ask the state.

use super::kept;
use super::tail::{Decoder, does_not_answer, list};
use crate::config::{Benchmark, Config, FileSource};
use crate::reading::Timestamp;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::Path;
use std::sync::mpsc;
use std::time::Duration;

/// In the state folder.
const FILE: &str = "config.json";

/// Why the config file that a daemon was asked to take up is not in force.
#[derive(Debug, Clone, Default, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
#[schemars(rename = "ConfigRefusal")]
pub struct ConfigRefusal {
    /// What is wrong with it; `None` where it is in force.
    pub refused: Option<String>,
    /// Since when, by the host's clock.
    pub since: Option<Timestamp>,
}

impl ConfigRefusal {
    /// As it stands in a state folder; `None` where the config is in force.
    pub fn read(state_dir: &Path) -> Option<Self> {
        kept::read(&state_dir.join(FILE)).filter(|kept: &Self| kept.refused.is_some())
    }

    pub(super) fn write(&self, state_dir: &Path) -> io::Result<()> {
        kept::write(state_dir, FILE, self)
    }
}

/// A folder that does not answer within this time is not waited for.
const ANSWERS_WITHIN: Duration = Duration::from_secs(3);

/// A line for each source of which there is no file now: its path may be mistyped; and for the first whose folder does not answer, as on a
/// network's share whose server is away, behind which none is looked at.
pub fn sources_without_files(config: &Config) -> Vec<String> {
    without_files_among(&config.sources, &config.benchmarks)
}

/// The same of those sources that `former` has not, or looks elsewhere for.
pub(super) fn new_sources_without_files(config: &Config, former: &Config) -> Vec<String> {
    let is_new = |source: &&FileSource| {
        let same = |one: &FileSource| (&one.id, &one.pattern) == (&source.id, &source.pattern);
        !former.sources.iter().any(same)
    };
    let new: Vec<FileSource> = config.sources.iter().filter(is_new).cloned().collect();
    without_files_among(&new, &config.benchmarks)
}

fn without_files_among(sources: &[FileSource], benchmarks: &[Benchmark]) -> Vec<String> {
    let (sender, listed) = mpsc::channel();
    let (all, benchmarks) = (sources.to_vec(), benchmarks.to_vec());
    // It ends when the file system answers: nobody waits for it.
    std::thread::spawn(move || {
        for source in &all {
            if sender.send(without_files(source, &benchmarks)).is_err() {
                return;
            }
        }
    });
    let mut lines = Vec::new();
    for source in sources {
        if let Ok(line) = listed.recv_timeout(ANSWERS_WITHIN) {
            lines.extend(line);
        } else {
            let what = does_not_answer(source.pattern.folder());
            lines.push(format!("source {:?}: the folder {what}", source.id));
            break;
        }
    }
    lines
}

fn without_files(source: &FileSource, benchmarks: &[Benchmark]) -> Option<String> {
    let decoder = Decoder::new(source, benchmarks);
    let (id, pattern) = (&source.id, &source.pattern);
    match list(pattern, &decoder) {
        Ok((files, _)) if !files.is_empty() => None,
        Ok(_) => Some(format!(
            "source {id:?}: there is no file {pattern}; is the path right?"
        )),
        Err(error) => {
            let folder = pattern.folder().display();
            Some(format!(
                "source {id:?}: the folder {folder} cannot be listed ({error}); is the path right?"
            ))
        }
    }
}

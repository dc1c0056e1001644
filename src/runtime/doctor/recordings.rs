//! Whether recordings keep readings back in a chunk that their writer has not closed.

use super::{CheckVerdict, Finding};
use crate::config::{FilePattern, FileSource, SourceKind};
use crate::runtime::tail::records::{HEADER_BYTES, MAGIC, OPEN_CHUNK};
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

const CHECK: &str = "recording";
/// Recordings of a source that are looked at, the newest.
const NEWEST: usize = 20;
/// Records of one that are looked at, so that a huge one costs a bounded time.
const MOST_RECORDS: usize = 1_000_000;

/// A finding for each recording with an open chunk, or one that there is none.
pub(super) fn findings(sources: &[FileSource]) -> Vec<Finding> {
    let recorded = sources
        .iter()
        .filter(|source| source.kind == SourceKind::Mcap);
    recorded.flat_map(of_source).collect()
}

fn of_source(source: &FileSource) -> Vec<Finding> {
    let files = match newest(&source.pattern) {
        Ok(files) => files,
        Err(error) => {
            let text = format!("{}: {error}", source.pattern.folder().display());
            return vec![Finding::new(CHECK, CheckVerdict::Unknown, text)];
        }
    };
    let found: Vec<Finding> = files.iter().filter_map(|file| of_file(file)).collect();
    if found.is_empty() {
        let text = format!(
            "source {:?}: no open chunk in {} files",
            source.id,
            files.len()
        );
        return vec![Finding::new(CHECK, CheckVerdict::Good, text)];
    }
    found
}

fn of_file(file: &Path) -> Option<Finding> {
    let name = file.display();
    match open_chunk(file) {
        Ok(None) => None,
        Ok(Some(bytes)) => Some(Finding::new(
            CHECK,
            CheckVerdict::Doubtful,
            format!(
                "{name}: {bytes} bytes stand in a chunk that is not closed, and cannot be seen \
                 before it is; have the recorder write without chunks, or flush after each reading"
            ),
        )),
        Err(error) => {
            let text = format!("{name}: {error}");
            Some(Finding::new(CHECK, CheckVerdict::Unknown, text))
        }
    }
}

/// The newest files that match.
fn newest(pattern: &FilePattern) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(pattern.folder())? {
        let entry = entry?;
        if entry
            .file_name()
            .to_str()
            .is_some_and(|name| pattern.matches(name))
        {
            let metadata = std::fs::metadata(entry.path())?;
            let changed = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            files.push((changed, entry.path()));
        }
    }
    files.sort();
    Ok(files
        .into_iter()
        .rev()
        .take(NEWEST)
        .map(|(_, path)| path)
        .collect())
}

/// How many bytes stand in the chunk at the end that is still open.
fn open_chunk(file: &Path) -> io::Result<Option<u64>> {
    let file = File::open(file)?;
    let length = file.metadata()?.len();
    let mut at = MAGIC.len() as u64;
    for _ in 0..MOST_RECORDS {
        let content = at + HEADER_BYTES as u64;
        if content > length {
            return Ok(None);
        }
        let mut header = [0; HEADER_BYTES];
        file.read_exact_at(&mut header, at)?;
        if header == OPEN_CHUNK {
            return Ok(Some(length - content));
        }
        let [_opcode, size @ ..] = header;
        let Some(next) = content.checked_add(u64::from_le_bytes(size)) else {
            return Ok(None);
        };
        at = next;
    }
    Ok(None)
}

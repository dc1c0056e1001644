//! Where readings stand in the files of a site: the file and the line, as far as the files still hold them.

use super::ingest::is_packed;
use super::tail::{Decoder, TextReader, list};
use crate::config::{Config, FileSource};
use crate::monitor::{Input, Measured};
use crate::reading::Timestamp;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Lines that are looked at, so that years of history cost a bounded time.
const MOST_LINES: u64 = 2_000_000;
/// Longest line that is looked at, bytes.
const LONGEST_LINE: u64 = 1 << 20;

/// A value by name, time and the bits of the number as it stands in the file.
type ValueIdentity = (String, Timestamp, u64);

/// A line of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin {
    /// The file.
    pub file: PathBuf,
    /// The line, from 1.
    pub line: u64,
}

/// Where the values stand in the text files of a site's sources. What came from a recording, a packed file or a broker, or whose
/// file has changed or gone since, is not among them.
#[derive(Debug, Default)]
pub struct Origins {
    lines: BTreeMap<ValueIdentity, Origin>,
    looked_at: u64,
}

impl Origins {
    /// Looks through the files of `config`; a file that cannot be read is left out.
    pub fn of(config: &Config) -> Self {
        let mut origins = Self::default();
        for source in &config.sources {
            origins.source(source, &Decoder::new(source, &config.benchmarks));
        }
        origins
    }

    /// Where this value stands.
    pub fn find(&self, input: &Input) -> Option<&Origin> {
        self.lines.get(&token(input)?)
    }

    fn source(&mut self, source: &FileSource, decoder: &Decoder) {
        let Ok((mut files, _)) = list(&source.pattern, decoder) else {
            return;
        };
        files.sort_by(|one, other| one.0.cmp(&other.0));
        for (file, _) in files {
            if !is_packed(&file)
                && let Err(error) = self.file(&file, decoder)
            {
                tracing::warn!(file = %file.display(), %error, "its lines cannot be read");
            }
        }
    }

    fn file(&mut self, file: &Path, decoder: &Decoder) -> io::Result<()> {
        let Some(rows) = decoder.text_rows(file) else {
            return Ok(());
        };
        let mut text = TextReader::new(rows);
        let mut reader = BufReader::new(File::open(file)?);
        let mut bytes = Vec::new();
        for line in 1.. {
            bytes.clear();
            let count = io::Read::take(&mut reader, LONGEST_LINE).read_until(b'\n', &mut bytes)?;
            self.looked_at += 1;
            if count == 0 || !bytes.ends_with(b"\n") || self.looked_at > MOST_LINES {
                break;
            }
            let fed = text.feed(&bytes);
            for (_, item) in fed.items {
                let arrival = decoder.arrival(item);
                if let Some(token) = arrival.and_then(|arrival| token(&arrival.input)) {
                    let file = file.to_owned();
                    self.lines.insert(token, Origin { file, line });
                }
            }
            if fed.is_lost {
                break;
            }
        }
        Ok(())
    }
}

fn token(input: &Input) -> Option<ValueIdentity> {
    let measured = input.measured()?;
    let name = match measured {
        Measured::Reading { benchmark, .. } => format!("reading {benchmark}"),
        Measured::Sample { channel, .. } => format!("sample {channel}"),
    };
    Some((name, measured.time(), measured.value().to_bits()))
}

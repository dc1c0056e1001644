//! Files of a site's sources, read as its daemon reads them.

use super::args::{Loaded, ReadingArgs};
use super::exit::{self, UsageError};
use super::preview;
use crate::config::{Config, FileSource};
use crate::reading::Recording;
use crate::runtime::ingest::{FilesRead, IngestError, ReadOptions, read_beside};
use crate::runtime::preview::{RefusedKinds, RefusedRow};
use crate::runtime::tail::{is_taken, options_of};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Reads the files, those of covariates too: those of the config's sources as it says, of these only what it watches, and the others as
/// the flags say.
/// Rows that cannot be used are set aside; what is left out is said on stderr.
///
/// # Errors
/// [`UsageError`] where a flag says nothing of any file, [`IngestError`] where a whole file cannot be used.
pub(super) fn load(readings: &ReadingArgs, config: &Config) -> anyhow::Result<Loaded> {
    let of = |file: &PathBuf| {
        let mut sources = config.sources.iter();
        sources.find(|source| source.pattern.is_of(file))
    };
    let as_source = |file: &PathBuf| Some(options_of(of(file)?, &config.benchmarks, file));
    let sources: Vec<Option<&FileSource>> = readings.files.iter().map(of).collect();
    let of_channels: Vec<Option<&FileSource>> = readings.channels.iter().map(of).collect();
    refuse_idle_flags(readings, &sources, &of_channels)?;
    let options = readings.file.options();
    let (mut parts, mut all) = (Vec::new(), FilesRead::default());
    let mut without_readings = None;
    for (file, source) in readings.files.iter().zip(&sources) {
        let own = as_source(file);
        let mut read = match read(file, own.as_ref().unwrap_or(&options)) {
            Ok(read) => read,
            Err(error) => {
                let Some(remark) = error.left_out() else {
                    return Err(error.into());
                };
                all.remarks.push((file.clone(), remark));
                without_readings.get_or_insert(error);
                continue;
            }
        };
        if let Some(source) = source {
            leave_out(&mut read.recording, source, config, file);
        }
        all.disorder += read.disorder;
        all.remarks.extend(read.remarks);
        parts.push(read.recording);
    }
    if let Some(none) = without_readings.filter(|_| parts.is_empty()) {
        return Err(none.into());
    }
    let (recording, overlap) = Recording::merge(parts).map_err(IngestError::from)?;
    all.recording = recording;
    all.disorder += overlap;
    let as_stated = |file: &PathBuf| as_source(file).unwrap_or_else(|| options.clone());
    Ok(readings.joined(all, &as_stated)?)
}

/// Refuses flags that say how files are read, where the config says it of all files.
fn refuse_idle_flags(
    readings: &ReadingArgs,
    sources: &[Option<&FileSource>],
    of_channels: &[Option<&FileSource>],
) -> anyhow::Result<()> {
    let stated = readings.file.stated();
    let mut of_sources = readings.files.iter().zip(sources);
    let Some((file, source)) = of_sources.find_map(|(file, source)| Some((file, (*source)?)))
    else {
        return Ok(());
    };
    if stated.is_empty() {
        return Ok(());
    }
    let place = format!(
        "{}: source {:?} of the config says how it is read",
        file.display(),
        source.id
    );
    if sources.iter().chain(of_channels).any(Option::is_none) {
        let flags: Vec<&str> = stated.iter().map(|(flag, _)| *flag).collect();
        exit::complain(&format_args!(
            "{place}; {} is for the other files",
            flags.join(", ")
        ));
        return Ok(());
    }
    let instead = stated.iter().fold(String::new(), |mut text, (flag, key)| {
        let _ = write!(text, "; instead of {flag} set {key}");
        text
    });
    Err(UsageError(format!("{place}{instead}")).into())
}

/// Reads one file, and says which of its rows are set aside.
fn read(file: &Path, options: &ReadOptions) -> Result<FilesRead, IngestError> {
    let (mut refused, mut count) = (RefusedKinds::default(), 0_u64);
    let read = read_beside(file, options, &mut |fault| {
        count += 1;
        refused.row(RefusedRow::of_fault(&fault));
    });
    if count > 0 {
        exit::complain(&format_args!(
            "{}: rows that cannot be used, set aside as the daemon does: {count}",
            file.display()
        ));
        for kind in refused.sorted() {
            exit::complain(&format_args!("  {}", preview::refused(&kind)));
        }
    }
    read
}

/// Leaves out the readings that the daemon does not take from this source.
fn leave_out(recording: &mut Recording, source: &FileSource, config: &Config, file: &Path) {
    let mut left = Vec::new();
    recording.series.retain(|series| {
        let taken = is_taken(source, &config.benchmarks, &series.benchmark, series.unit);
        if !taken {
            left.push(format!("{} of {}", series.quantity(), series.benchmark));
        }
        taken
    });
    if !left.is_empty() {
        exit::complain(&format_args!(
            "{}: not watched, and not played, as no [[benchmark]] takes it from source {:?}: {}",
            file.display(),
            source.id,
            left.join(", ")
        ));
    }
}

//! `[site] record`: where the daemon writes all that it says, and how much of it is kept.

use super::table::Section;
use super::{FileSource, SourceKind, value};
use std::path::{Path, PathBuf};

/// Bytes of one file, unless the config says otherwise.
const SIZE: u64 = 64_000_000;
/// Bytes of all of them.
const TOTAL: u64 = 1_000_000_000;
/// A file that is shorter consists of what every file begins with.
const LEAST: u64 = 10_000;

/// The files of the daemon's record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordFiles {
    /// What they are named after: `PATH-000001.mcap` and on.
    pub path: PathBuf,
    /// Bytes from which on another one is begun.
    pub size: u64,
    /// Bytes of all of them; the oldest go.
    pub total: u64,
}

/// The keys of `[site]`; `None` where there is to be no record.
pub(super) fn record(section: &mut Section<'_>, base: &Path) -> Option<RecordFiles> {
    let path = section.parsed("record", |text| {
        let path = base.join(text);
        let is_mcap = path.extension().is_some_and(|ending| ending == "mcap");
        let is_file = is_mcap && path.file_stem().is_some() && !text.contains('*');
        is_file
            .then_some(path)
            .ok_or_else(|| "write a file that ends in .mcap: \"record/site.mcap\"".to_owned())
    });
    let size = section.parsed("record_size", value::bytes);
    let total = section.parsed("record_total", value::bytes);
    let at = [&size, &total].map(|given| given.as_ref().map(|given| given.at.clone()));
    if !section.has("record") {
        for at in at.iter().flatten() {
            section.error(
                at,
                "site.record_size or record_total without site.record: nothing is recorded"
                    .to_owned(),
                "add record = \"record/site.mcap\", or leave it out",
            );
        }
        return None;
    }
    let (size, total) = (
        size.map_or(SIZE, |given| given.value),
        total.map_or(TOTAL, |given| given.value),
    );
    if (size < LEAST || total < 2 * size)
        && let Some(at) = at.iter().flatten().next()
    {
        section.error(
            at,
            format!("site.record_total of {total} bytes does not hold two files of {size}"),
            format!("write a record_size of {LEAST} B or more, and twice that or more in all"),
        );
    }
    let path = path?.value;
    Some(RecordFiles { path, size, total })
}

/// The daemon would take in its own record.
pub(super) fn refuse_own(section: &Section<'_>, record: &RecordFiles, sources: &[FileSource]) {
    let stem = record.path.file_stem().unwrap_or_default();
    let name = format!("{}-000001.mcap", stem.to_string_lossy());
    let first = record.path.with_file_name(name);
    let reads = |source: &&FileSource| {
        let is_beside = first.parent() == Some(source.pattern.folder());
        let name = first.file_name().and_then(|name| name.to_str());
        source.kind == SourceKind::Mcap
            && is_beside
            && name.is_some_and(|name| source.pattern.matches(name))
    };
    if let Some(source) = sources.iter().find(reads) {
        section.error(
            section.at(),
            format!(
                "site.record = {:?} is among the files of source {:?}",
                record.path.display().to_string(),
                source.id
            ),
            "write it into a folder of its own",
        );
    }
}

#[cfg(test)]
mod tests {
    use crate::config::parse;
    use std::path::Path;

    fn said(of_site: &str) -> String {
        let text = format!(
            "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n{of_site}\n\
             [[source]]\nid = \"recorder\"\nkind = \"mcap\"\npath = \"incoming/*.mcap\"\n"
        );
        match parse(&text, Path::new("/site/site.toml")) {
            Ok(config) => format!("{:?}", config.site.record),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn a_record_has_its_own_folder_and_room_for_two_files() {
        let right = said("record = \"record/site.mcap\"\nrecord_size = \"1 MB\"");
        assert!(right.contains("/site/record/site.mcap"), "{right}");
        assert!(
            right.contains("size: 1000000, total: 1000000000"),
            "{right}"
        );
        for (wrong, why) in [
            ("record = \"incoming/site.mcap\"", "source \"recorder\""),
            ("record = \"record/site.csv\"", "ends in .mcap"),
            ("record_total = \"1 GB\"", "without site.record"),
            (
                "record = \"site.mcap\"\nrecord_total = \"100 MB\"",
                "does not hold two files",
            ),
        ] {
            let said = said(wrong);
            assert!(said.contains(why), "{wrong}: {said}");
        }
        assert_eq!(said(""), "None");
    }
}

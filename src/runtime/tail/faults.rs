//! Which files and folders cannot be read now, and why.

use super::file::{Content, FileTail};
use super::follow::Follower;
use super::text::RefusedRows;
use crate::reading::counted;
use crate::runtime::clock;
use crate::runtime::service_faults::{FaultPlace, ServiceFaultKind};
use jiff::SignedDuration;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

/// A file that has rested for so long is not within the writing of a row.
const RESTED: Duration = Duration::from_secs(60);
/// So many rows in a row that cannot be used are no accident: the table has become another one.
const MOST_REFUSED: u64 = 5;
/// What was last written longer ago than this is no row that anybody waits for.
const OF_INTEREST: SignedDuration = SignedDuration::from_hours(24 * 7);

impl Follower {
    /// Folders that cannot be listed, files that cannot be read, and those that are refused until they are replaced.
    pub(super) fn faults(&self) -> Vec<(FaultPlace, String)> {
        let place = |kind, source: &str, path: &Path| FaultPlace {
            what: path.display().to_string(),
            ..FaultPlace::of_source(kind, source)
        };
        let folders = self.unlisted.iter().map(|(folder, (source, error))| {
            let place = place(ServiceFaultKind::FolderUnreadable, source, folder);
            let text = format!("the folder {} cannot be listed: {error}", folder.display());
            (place, text)
        });
        let files = self.files.iter().filter_map(|((source, path), file)| {
            let (kind, text) = file.fault()?;
            Some((place(kind, &self.sources[*source].id, path), text))
        });
        folders.chain(files).chain(self.unended_rows()).collect()
    }

    /// Of each source the file whose last row waits for its end, and how many others there are: where one program writes them all, all are alike.
    fn unended_rows(&self) -> impl Iterator<Item = (FaultPlace, String)> {
        let mut unended: BTreeMap<usize, Vec<&FileTail>> = BTreeMap::new();
        for ((source, _), file) in &self.files {
            if file.waits_for_an_end() {
                unended.entry(*source).or_default().push(file);
            }
        }
        unended.into_iter().map(|(source, files)| {
            let first = files[0].path.display();
            let others = match files.len() - 1 {
                0 => String::new(),
                others => format!(" (so are those of {})", counted(others, "other file", "other files")),
            };
            let text = format!(
                "the last row of {first} is not taken{others}: it has no line break, so that whoever writes may not be done with it"
            );
            let kind = ServiceFaultKind::RowUnended;
            (FaultPlace::of_source(kind, &self.sources[source].id), text)
        })
    }
}

impl FileTail {
    /// Whether its last row has no line break, and nobody has written more of it for some time.
    fn waits_for_an_end(&self) -> bool {
        let is_within_a_row =
            matches!(&self.content, Content::Text(text) if text.is_within_a_line());
        let has_rested = (self.idle_since).is_some_and(|since| since.elapsed() >= RESTED);
        let is_of_interest = (self.changed)
            .is_some_and(|changed| clock::now().duration_since(changed) <= OF_INTEREST);
        is_within_a_row && has_rested && is_of_interest && self.departed.is_none()
    }

    fn fault(&self) -> Option<(ServiceFaultKind, String)> {
        let file = self.path.display();
        if let Content::Refused(why) = &self.content {
            let text = format!("{file} is refused until it is replaced: {why}");
            return Some((ServiceFaultKind::FileRefused, text));
        }
        if let Some(trouble) = &self.trouble {
            let text = format!("{file} cannot be read: {trouble}");
            return Some((ServiceFaultKind::FileUnreadable, text));
        }
        let RefusedRows { count, why } = &self.refused_rows;
        (*count >= MOST_REFUSED).then(|| {
            let text = format!("none of the newest {count} rows of {file} could be used: {why}");
            (ServiceFaultKind::RowsRefused, text)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::io::Write;

    /// A follower of `*.csv` in a folder.
    fn follower(folder: &Path) -> Follower {
        let text = "[site]\nname = \"s\"\nstate_dir = \"state\"\n[[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"*.csv\"\n";
        let file = folder.join("site.toml");
        fs::write(&file, text).unwrap();
        let config = crate::config::load(&file).unwrap();
        Follower::new(&config.sources, &[], &[])
    }

    #[tokio::test(start_paused = true)]
    async fn a_last_row_without_a_line_break_is_a_fault_after_a_minute_until_it_ends() {
        let folder = tempfile::tempdir().unwrap();
        let rows = "time,displacement_mm\n2026-01-01T00:00:00Z,1.0\n2026-01-01T01:00:00Z,1.1";
        for name in ["5.csv", "6.csv"] {
            fs::write(folder.path().join(name), rows).unwrap();
        }
        let mut follower = follower(folder.path());
        let mut faults = async |rests| {
            for _ in 0..4 {
                follower.poll(clock::now());
            }
            tokio::time::advance(rests).await;
            follower.faults()
        };
        assert!(faults(Duration::from_secs(59)).await.is_empty());
        let lasting = faults(Duration::from_secs(2)).await;
        let [(place, text)] = &lasting[..] else {
            panic!("{lasting:?}");
        };
        assert_eq!(place.kind, ServiceFaultKind::RowUnended);
        assert!(
            text.contains("5.csv is not taken (so are those of 1 other file)"),
            "{text}"
        );
        for name in ["5.csv", "6.csv"] {
            fs::write(folder.path().join(name), format!("{rows}\n")).unwrap();
        }
        assert!(faults(Duration::from_secs(61)).await.is_empty());
    }

    #[test]
    fn rows_that_cannot_be_used_are_a_fault_from_the_fifth_in_a_row_until_one_can() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("5.csv");
        fs::write(&file, "time,displacement_mm\n").unwrap();
        let mut follower = follower(folder.path());
        let mut faults = |rows: &str| {
            let mut file = fs::OpenOptions::new().append(true).open(&file).unwrap();
            file.write_all(rows.as_bytes()).unwrap();
            for _ in 0..4 {
                follower.poll(clock::now());
            }
            follower.faults()
        };
        assert!(faults("2026-01-01T00:00:00Z,1.0\n").is_empty());
        assert!(faults(&"2026-01-01T01:00:00Z;1.1\n".repeat(4)).is_empty());
        let lasting = faults("2026-01-01T01:00:00Z;1.1\n");
        let [(place, text)] = &lasting[..] else {
            panic!("{lasting:?}");
        };
        assert_eq!(place.kind, ServiceFaultKind::RowsRefused);
        assert!(text.contains("none of the newest 5 rows"), "{text}");
        assert!(faults("2026-01-01T01:00:00Z,1.1\n").is_empty());
    }
}

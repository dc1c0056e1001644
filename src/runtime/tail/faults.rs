//! Which files and folders cannot be read now, and why.

use super::file::{Content, FileTail};
use super::follow::Follower;
use super::text::MOST_REFUSED;
use crate::reading::counted;
use crate::runtime::clock;
use crate::runtime::service_faults::{FaultPlace, ServiceFaultKind};
use jiff::SignedDuration;
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

/// A file that has rested for so long is not within the writing of a row.
const RESTED: Duration = Duration::from_secs(60);
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
        let files: Vec<(FaultPlace, String)> = files.collect();
        let one_by_one = self.refused_in_turn(&files);
        let faults = folders.chain(self.unended_rows()).chain(one_by_one);
        faults.chain(files).collect()
    }

    /// The sources whose newest files hold a few rows each, of which none could be used; not those of which `files` names one.
    fn refused_in_turn(&self, files: &[(FaultPlace, String)]) -> Vec<(FaultPlace, String)> {
        let all = self.files.iter();
        let mut newest_first: Vec<(usize, &FileTail)> =
            all.map(|((source, _), file)| (*source, file)).collect();
        newest_first.sort_by_key(|(source, file)| (*source, Reverse(file.modified)));
        let mut faults = Vec::new();
        for of_source in newest_first.chunk_by(|(one, _), (next, _)| one == next) {
            let id = &self.sources[of_source[0].0].id;
            let place = FaultPlace::of_source(ServiceFaultKind::RowsRefused, id);
            if files.iter().any(|(named, _)| named.source == place.source) {
                continue;
            }
            let (mut total, mut newest) = (0, None);
            for (_, file) in of_source {
                if file.refused_rows.count > 0 {
                    total += file.refused_rows.count;
                    newest = newest.or(Some(file));
                }
                if file.refused_rows.is_below_used {
                    break;
                }
            }
            if let Some(file) = newest.filter(|_| total >= MOST_REFUSED) {
                let (path, why) = (file.path.display(), &file.refused_rows.why);
                let text = format!(
                    "none of the newest {total} rows or messages of the newest files could be used, as in {path}: {why}"
                );
                faults.push((place, text));
            }
        }
        faults
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
        let is_of_interest = (self.changed)
            .is_some_and(|changed| clock::now().duration_since(changed) <= OF_INTEREST);
        self.rests_within_a_line() && is_of_interest && self.departed.is_none()
    }

    /// Whether nothing ends its last line, and nobody has written for some time.
    pub(super) fn rests_within_a_line(&self) -> bool {
        matches!(&self.content, Content::Text(text) if text.is_within_a_line())
            && (self.idle_since).is_some_and(|since| since.elapsed() >= RESTED)
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
        let (count, why) = self.refused_rows.fault()?;
        let what = match self.decoder.text_rows(&self.path) {
            Some(_) => "rows",
            None => "messages",
        };
        let text = format!("none of the newest {count} {what} of {file} could be used: {why}");
        Some((ServiceFaultKind::RowsRefused, text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::io::Write;

    fn only(faults: &[(FaultPlace, String)]) -> &(FaultPlace, String) {
        let [fault] = faults else {
            panic!("{faults:?}");
        };
        fault
    }

    /// A follower of `*.csv` in a folder.
    fn follower(folder: &Path) -> Follower {
        follower_from(folder, &[])
    }

    fn follower_from(folder: &Path, saved: &[(String, Vec<u8>)]) -> Follower {
        let text = "[site]\nname = \"s\"\nstate_dir = \"state\"\n[[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"*.csv\"\n";
        let file = folder.join("site.toml");
        fs::write(&file, text).unwrap();
        let config = crate::config::load(&file).unwrap();
        Follower::new(&config.sources, &[], saved)
    }

    /// Writes a file of that hour, which was written then.
    fn upload_at(folder: &Path, hour: u64, text: &str) {
        let path = folder.join(format!("{hour}.csv"));
        fs::write(&path, text).unwrap();
        let ago = Duration::from_secs(36_000 - 3600 * hour);
        let file = fs::File::options().append(true).open(path).unwrap();
        let written = std::time::SystemTime::from(clock::now()) - ago;
        file.set_modified(written).unwrap();
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
        let (place, text) = only(&lasting);
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

    #[tokio::test(start_paused = true)]
    async fn last_rows_without_a_line_break_are_read_where_three_files_were_left_so() {
        let folder = tempfile::tempdir().unwrap();
        let upload = |hour: u64| {
            let row = format!("time,displacement_mm\n2026-01-01T0{hour}:00:00Z,1.0");
            upload_at(folder.path(), hour, &row);
        };
        let mut follower = follower(folder.path());
        let mut read = async |seconds| {
            let mut arrivals = 0;
            for _ in 0..3 {
                arrivals += follower.poll(clock::now()).arrivals.len();
                tokio::time::advance(Duration::from_secs(seconds)).await;
            }
            arrivals
        };
        upload(1);
        upload(2);
        assert_eq!(read(61).await, 0);
        upload(3);
        assert_eq!(read(1).await, 0, "the third may still be written");
        assert_eq!(read(61).await, 3);
        upload(4);
        assert_eq!(read(2).await, 1, "the fourth is known");
    }

    #[tokio::test(start_paused = true)]
    async fn an_export_that_is_written_anew_without_a_last_line_break_is_read_whole_from_the_fourth_on()
     {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("5.csv");
        let mut follower = follower(folder.path());
        let mut newest = async |hours: u64| {
            let rows = (0..=hours).map(|hour| format!("2026-01-01T0{hour}:00:00Z,1.{hour}"));
            let rows: Vec<String> = rows.collect();
            let text = format!("time,displacement_mm\n{}", rows.join("\n"));
            let new = folder.path().join("5.new");
            fs::write(&new, text).unwrap();
            fs::rename(&new, &file).unwrap();
            let mut newest = None;
            for _ in 0..6 {
                let arrivals = follower.poll(clock::now()).arrivals;
                newest = newest.max(arrivals.iter().map(|one| one.time).max());
                tokio::time::advance(Duration::from_secs(3)).await;
            }
            newest.map(|time| time.to_string())
        };
        let hour = |hour: u64| Some(format!("2026-01-01T0{hour}:00:00Z"));
        for hours in 1..=3 {
            assert_eq!(newest(hours).await, hour(hours - 1));
        }
        for hours in 4..=6 {
            assert_eq!(newest(hours).await, hour(hours));
        }
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
        let (place, text) = only(&lasting);
        assert_eq!(place.kind, ServiceFaultKind::RowsRefused);
        assert!(text.contains("none of the newest 5 rows"), "{text}");
        assert!(faults("2026-01-01T01:00:00Z,1.1\n").is_empty());
    }

    /// A follower of `*.mcap` in a folder.
    fn follower_of_recordings(folder: &Path) -> Follower {
        let site = "[site]\nname = \"s\"\nstate_dir = \"state\"\n[[source]]\nid = \"robot\"\nkind = \"mcap\"\npath = \"*.mcap\"\n";
        fs::write(folder.join("site.toml"), site).unwrap();
        let config = crate::config::load(&folder.join("site.toml")).unwrap();
        Follower::new(&config.sources, &[], &[])
    }

    #[test]
    fn what_is_written_behind_the_footer_of_a_recording_is_a_fault() {
        let folder = tempfile::tempdir().unwrap();
        let mut follower = follower_of_recordings(folder.path());
        let mut recording = std::io::Cursor::new(Vec::new());
        mcap::Writer::new(&mut recording).unwrap().finish().unwrap();
        let recording = recording.into_inner();
        let file = folder.path().join("a.mcap");
        let mut faults = || {
            for _ in 0..9 {
                follower.poll(clock::now());
            }
            follower.faults()
        };
        fs::write(&file, &recording).unwrap();
        assert!(faults().is_empty());
        let mut grown = fs::OpenOptions::new().append(true).open(&file).unwrap();
        grown.write_all(&recording).unwrap();
        let lasting = faults();
        let (place, text) = only(&lasting);
        assert_eq!(place.kind, ServiceFaultKind::FileRefused);
        let count = format!("{} bytes stand behind the footer", recording.len());
        assert!(text.contains(&count), "{text}");
    }

    #[test]
    fn messages_of_a_recording_of_which_none_can_be_used_any_more_are_a_fault() {
        let folder = tempfile::tempdir().unwrap();
        let mut follower = follower_of_recordings(folder.path());
        let file = fs::File::create(folder.path().join("a.mcap")).unwrap();
        let options = mcap::WriteOptions::new().use_chunks(false);
        let mut writer = mcap::Writer::with_options(file, options).unwrap();
        let channel = writer.add_channel(0, "/benchmarks/5/displacement", "json", &BTreeMap::new());
        let channel_id = channel.unwrap();
        let mut sequence = 0;
        let mut faults = |json: &str| {
            sequence += 1;
            let time = 1_780_000_000_000_000_000 + 3_600_000_000_000 * u64::from(sequence);
            let header = mcap::records::MessageHeader {
                channel_id,
                sequence,
                log_time: time,
                publish_time: time,
            };
            let written = writer.write_to_known_channel(&header, json.as_bytes());
            written.and_then(|()| writer.flush()).unwrap();
            for _ in 0..4 {
                follower.poll(clock::now());
            }
            follower.faults()
        };
        assert!(faults(r#"{"value": 1.0, "unit": "mm"}"#).is_empty());
        for _ in 0..4 {
            assert!(faults(r#"{"value": 1.0, "unit": "furlong"}"#).is_empty());
        }
        let lasting = faults(r#"{"value": 1.0, "unit": "furlong"}"#);
        let (place, text) = only(&lasting);
        assert_eq!(place.kind, ServiceFaultKind::RowsRefused);
        assert!(
            text.contains("newest 5 messages") && text.contains("furlong"),
            "{text}"
        );
        assert!(faults(r#"{"value": 1.1, "unit": "mm"}"#).is_empty());
    }

    #[test]
    fn rows_that_cannot_be_used_are_counted_over_files_of_one_row_each() {
        let folder = tempfile::tempdir().unwrap();
        let mut follower = follower(folder.path());
        let mut faults = |hour: u64, row: &str| {
            let text = format!("time,displacement_mm\n{row}\n");
            upload_at(folder.path(), hour, &text);
            for _ in 0..4 {
                follower.poll(clock::now());
            }
            follower.faults()
        };
        assert!(faults(0, "2026-01-01T00:00:00Z,1.0").is_empty());
        for hour in 1..=4 {
            assert!(faults(hour, "2026-01-01T01:00:00Z;1.1").is_empty());
        }
        let lasting = faults(5, "2026-01-01T01:00:00Z;1.1");
        let (place, text) = only(&lasting);
        assert_eq!(place.kind, ServiceFaultKind::RowsRefused);
        assert!(
            text.contains("newest 5 rows") && text.contains("5.csv"),
            "{text}"
        );
        assert!(faults(6, "2026-01-01T06:00:00Z,1.0").is_empty());
    }

    #[test]
    fn rows_that_cannot_be_used_are_a_fault_after_a_restart_too() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("5.csv");
        let rows = "2026-01-01T01:00:00Z;1.1\n".repeat(5);
        fs::write(
            &file,
            format!("time,displacement_mm\n2026-01-01T00:00:00Z,1.0\n{rows}"),
        )
        .unwrap();
        let mut first = follower(folder.path());
        let mut saved = BTreeMap::new();
        for _ in 0..4 {
            let positions = first.poll(clock::now()).positions;
            saved.extend(positions.into_iter().map(|one| (one.name, one.body)));
        }
        assert_eq!(first.faults().len(), 1);
        let saved: Vec<(String, Vec<u8>)> = saved
            .into_iter()
            .filter_map(|(name, body)| Some((name, body?)))
            .collect();
        let mut second = follower_from(folder.path(), &saved);
        second.poll(clock::now());
        assert_eq!(second.faults(), first.faults());
    }
}

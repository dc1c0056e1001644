//! What a rotation leaves: a file under another name that its source asks for too, and a new one under the first name, perhaps without
//! a header.

use super::file::{Content, FileTail};
use super::follow::{FileKey, Follower};
use super::position::FileId;
use super::text::{LinesRead, TextReader};
use crate::runtime::ingest::{is_packed, unpacked_name};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What a rotation appends to a name, or puts before it, beside digits and what stands between them.
const WORDS: [&str; 5] = ["old", "bak", "prev", "T", "Z"];

/// So many files whose last line has no line break are no accident: the program that writes them ends none with one.
const LEFT_UNENDED: usize = 3;

/// The first names of files that have been renamed, by their present ones.
pub(super) type FirstNames = BTreeMap<FileKey, PathBuf>;

/// What is known of the files that were followed before others came.
#[derive(Debug, Default)]
pub(super) struct KnownBefore {
    /// Of the files that stood under a first name and have another by now, the one that was written to last.
    latest: BTreeMap<FileKey, FileKey>,
    /// The sources whose newest file has lines that are ended by the next one.
    ends_later: BTreeSet<usize>,
}

impl Follower {
    /// The files that are followed now.
    pub(super) fn places(&self) -> BTreeSet<FileId> {
        self.files.values().filter_map(|file| file.place).collect()
    }

    /// Of the files that are followed under another name than their first.
    pub(super) fn first_names(&self) -> FirstNames {
        let renamed = self
            .files
            .iter()
            .filter(|(_, file)| file.origin != file.path);
        renamed
            .map(|(key, file)| (key.clone(), file.origin.clone()))
            .collect()
    }

    /// What is known of the files that are followed, for those that come.
    pub(super) fn known_before(&self) -> KnownBefore {
        let mut known = KnownBefore::default();
        let mut newest: BTreeMap<usize, &FileTail> = BTreeMap::new();
        for (key, file) in &self.files {
            let of_source = newest.entry(key.0).or_insert(file);
            if file.modified >= of_source.modified {
                *of_source = file;
            }
            if file.origin != file.path {
                let first = (key.0, file.origin.clone());
                let latest = known.latest.entry(first).or_insert_with(|| key.clone());
                if file.modified >= self.files[latest].modified {
                    latest.clone_from(key);
                }
            }
        }
        let ends_later = |file: &FileTail| matches!(&file.content, Content::Text(text) if text.has_lines_ended_later());
        let newest = newest.into_iter();
        known.ends_later = newest
            .filter(|(_, file)| ends_later(file))
            .map(|(source, _)| source)
            .collect();
        known
    }

    /// A file that is followed from here on. Where it is a renamed one, packed, it keeps the first name of that; where another one stood
    /// under its name before, what it holds without a header is read by the header of that.
    pub(super) fn newly_followed(
        &self,
        key: &FileKey,
        renamed: &FirstNames,
        known: &KnownBefore,
    ) -> FileTail {
        let decoder = Arc::clone(&self.sources[key.0].decoder);
        let plain = is_packed(&key.1).then(|| unpacked_name(&key.1));
        let first = plain.and_then(|plain| renamed.get(&(key.0, plain)));
        let first = first.map_or_else(|| key.1.clone(), |name| packed(name));
        let mut file = FileTail::new(first, decoder);
        file.path.clone_from(&key.1);
        let latest = known.latest.get(key);
        if let Some(latest) = latest.and_then(|latest| self.files.get(latest)) {
            file.header_before = latest.header();
            file.follow_on(&latest.content);
        }
        if known.ends_later.contains(&key.0) {
            file.expect_lines_ended_later();
        }
        file
    }

    /// Where a source's program ends none of its files with a line break, the last line of each is whole once it has rested: three files
    /// that were left so at other times show it.
    pub(super) fn expect_unended_files(&mut self) {
        let mut left: BTreeMap<usize, BTreeSet<i64>> = BTreeMap::new();
        for ((source, _), file) in &self.files {
            if file.rests_within_a_line() {
                let minute = file.modified.0.div_euclid(60);
                left.entry(*source).or_default().insert(minute);
            }
        }
        left.retain(|_, minutes| minutes.len() >= LEFT_UNENDED);
        if left.is_empty() {
            return;
        }
        for ((source, _), file) in &mut self.files {
            if left.contains_key(source) && file.rests_within_a_line() {
                file.expect_lines_ended_later();
            }
        }
    }
}

/// The name of a file when it is packed.
fn packed(name: &Path) -> PathBuf {
    let mut name = name.as_os_str().to_owned();
    name.push(".gz");
    name.into()
}

impl FileTail {
    /// Nothing has been read of it: it stands under the name of one whose content was `before`.
    pub(super) fn follow_on(&mut self, before: &Content) {
        if let (Content::Text(text), Content::Text(before)) = (&mut self.content, before) {
            text.follow_on(before);
        }
    }

    /// Its last line is whole once whoever writes has had the time to go on.
    fn expect_lines_ended_later(&mut self) {
        if let Content::Text(text) = &mut self.content {
            text.expect_lines_ended_later();
        }
    }

    /// The lines of its header, where it is a text that has been read so far.
    pub(super) fn header(&self) -> Vec<String> {
        match &self.content {
            Content::Text(text) => text.header().to_vec(),
            Content::Packed(_) | Content::Mcap { .. } | Content::Refused(_) | Content::Complete => {
                Vec::new()
            }
        }
    }

    /// A reader from the start of this file by the header of the one before it, where it begins with a row of that and not with a header.
    pub(super) fn without_header(&mut self, read: &LinesRead) -> Option<TextReader> {
        let header = std::mem::take(&mut self.header_before);
        let first = read
            .bad
            .last()
            .filter(|_| read.is_lost && !header.is_empty())?;
        let reader = || TextReader::below(self.decoder.text_rows(&self.origin)?, &header);
        let is_row = reader()?.feed(format!("{}\n", first.text).as_bytes());
        if is_row.items.is_empty() || !is_row.bad.is_empty() {
            return None;
        }
        let file = self.path.display();
        tracing::warn!(%file, "begins without a header: read by that of the file that had its name before");
        reader()
    }
}

/// Whether `to` is what a rotation makes of the name of `from`: what is added are digits, as of a date or a number.
pub(super) fn is_rotated_name(from: &Path, to: &Path) -> bool {
    let (Some(from), Some(to)) = (stem(from), stem(to)) else {
        return false;
    };
    let is_separator = |one: char| "-_. ".contains(one);
    let after = to
        .strip_prefix(from)
        .filter(|more| more.starts_with(is_separator));
    let before = to
        .strip_suffix(from)
        .filter(|more| more.ends_with(is_separator));
    after.or(before).is_some_and(|more| {
        let mut words = more.split(|one: char| is_separator(one) || one.is_ascii_digit());
        words.all(|word| word.is_empty() || WORDS.contains(&word))
    })
}

fn stem(path: &Path) -> Option<&str> {
    path.file_stem()?.to_str()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_or_a_number_beside_the_name_is_that_of_a_rotation() {
        let is = |from: &str, to: &str| is_rotated_name(Path::new(from), Path::new(to));
        for to in [
            "ext7-20261128.csv",
            "ext7_2026-11-28T06.csv",
            "ext7.1.csv",
            "ext7.old.csv",
            "20261128-ext7.csv",
        ] {
            assert!(is("in/ext7.csv", &format!("in/{to}")), "{to}");
        }
        for to in [
            "ext71.csv",
            "ext8.csv",
            "ext7-upper.csv",
            "ext7.csv",
            "7.csv",
        ] {
            assert!(!is("in/ext7.csv", &format!("in/{to}")), "{to}");
        }
    }
}

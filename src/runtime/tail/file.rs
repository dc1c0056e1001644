//! Follows one file: where we are in it, whether it is still the same, and what came.

use super::decode::{Arrival, Decoder};
use super::position::{FileId, Saved};
use super::preallocated::ReadSpan;
use super::records::Channels;
use super::text::{RefusedRows, TextReader, Unpacking};
use crate::reading::Timestamp;
use crate::runtime::clock::Stopwatch;
use crate::runtime::ingest::{Item, is_packed};
use fnv::FnvHasher;
use std::collections::VecDeque;
use std::fs::{File, Metadata};
use std::hash::Hasher as _;
use std::io;
use std::os::unix::fs::{FileExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Bytes before the offset that are compared as a whole when the file has changed: an export that is written again in place keeps its last rows.
const EARLIER_BYTES: u64 = 256 * 1024;
/// How long an export may take to be written, and how soon a file is read from its start again for it.
const WRITTEN: Duration = Duration::from_secs(2);
const ANEW_AGAIN: Duration = Duration::from_secs(600);
/// Bytes of text that are read at once.
const READ_BYTES: usize = 16 * 1024;
/// Bytes before the offset that must not change.
const MARK_BYTES: u64 = 256;
/// Bytes that may be read of one file, without a value in them, before others have their turn.
const TURN_BYTES: u64 = 1 << 20;
/// After so many bytes without a value others need not wait for the file any more,
pub(super) const VALUELESS_BYTES: u64 = 8 << 20;
/// and after so many it is refused.
const REFUSED_BYTES: u64 = 1 << 30;

/// One followed file.
#[derive(Debug)]
pub(super) struct FileTail {
    pub(super) path: PathBuf,
    /// The name under which it was found first: a benchmark may be named after it, whatever it is renamed to.
    pub(super) origin: PathBuf,
    pub(super) decoder: Arc<Decoder>,
    pub(super) content: Content,
    /// Everything before this has been read.
    pub(super) at: u64,
    pub(super) place: Option<FileId>,
    /// The last bytes before `at`: another file of the same number and size has others.
    pub(super) mark: Vec<u8>,
    /// A hash of the bytes before the offset, [`EARLIER_BYTES`] at most; none while there is more to read.
    pub(super) earlier: Option<u64>,
    /// Runs since that was found to be another one now.
    other_since: Option<Stopwatch>,
    /// Runs since it was read from its start for that.
    read_anew: Option<Stopwatch>,
    /// As of the last look that found nothing more; the file is opened only when it differs.
    pub(super) idle: Option<FileStat>,
    /// Runs since then.
    pub(super) idle_since: Option<Stopwatch>,
    /// When it was last written to, as of the last read.
    pub(super) modified: (i64, i64),
    /// When it was last written to, or came under its name, by the host's clock, as of the last look.
    pub(super) changed: Option<Timestamp>,
    pub(super) pending: VecDeque<Arrival>,
    pub(super) quarantined: u64,
    /// The newest lines, where all of them could not be used.
    pub(super) refused_rows: RefusedRows,
    /// The lines of the header of the file that stood under its name before.
    pub(super) header_before: Vec<String>,
    /// The last error, so that it is logged once.
    pub(super) trouble: Option<String>,
    /// It is held open, perhaps, so that it can be read wherever it goes.
    pub(super) held: Option<File>,
    /// Where it is no longer under its name.
    pub(super) departed: Option<Departed>,
    /// Bytes read since the last value.
    pub(super) valueless: u64,
    /// Whether its turn ended before it had been read to its end.
    pub(super) has_more: bool,
    /// Whether it has not been looked at since a restart.
    pub(super) is_restored: bool,
    /// When the newest value was measured that it has given.
    pub(super) newest: Option<Timestamp>,
    /// From where a restart goes on.
    pub(super) safe: Saved,
    /// As [`FileTail::moved`] last reported it.
    pub(super) reported: Saved,
}

/// Since when a file is read on that is no longer under its name, and how.
#[derive(Debug)]
pub(super) struct Departed {
    /// Runs since it last grew, or went.
    pub(super) grew: Stopwatch,
    /// Where we were then.
    pub(super) at: u64,
    /// Whether it has no name that we know: it is read while it is held open, and a restart does not find it.
    pub(super) is_nameless: bool,
}

#[derive(Debug)]
pub(super) enum Content {
    Text(Box<TextReader>),
    /// A packed file, that is read whole, again when it has grown.
    Packed(Box<Unpacking>),
    Mcap {
        channels: Channels,
        /// A damaged last record may be one that is still being written: it gets a second look.
        suspect: Option<u64>,
    },
    /// Not to be read until it is another file: why.
    Refused(String),
    /// Complete: nothing comes after it.
    Complete,
}

impl Content {
    fn of(decoder: &Decoder, path: &Path) -> Self {
        match decoder.text_rows(path) {
            Some(rows) if is_packed(path) => Self::Packed(Box::new(Unpacking::new(rows))),
            Some(rows) => Self::Text(Box::new(TextReader::new(rows))),
            None => Self::Mcap {
                channels: Channels::default(),
                suspect: None,
            },
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FileStat {
    place: FileId,
    size: u64,
    modified: (i64, i64),
    changed: Option<Timestamp>,
}

impl FileStat {
    fn at(metadata: &Metadata) -> Self {
        Self {
            place: FileId::of(metadata),
            size: metadata.size(),
            modified: (metadata.mtime(), metadata.mtime_nsec()),
            changed: Timestamp::from_second(metadata.ctime()).ok(),
        }
    }
}

impl FileTail {
    pub(super) fn new(path: PathBuf, decoder: Arc<Decoder>) -> Self {
        Self {
            content: Content::of(&decoder, &path),
            origin: path.clone(),
            path,
            decoder,
            at: 0,
            place: None,
            mark: Vec::new(),
            earlier: None,
            other_since: None,
            read_anew: None,
            idle: None,
            idle_since: None,
            modified: (0, 0),
            changed: None,
            pending: VecDeque::new(),
            quarantined: 0,
            refused_rows: RefusedRows::default(),
            header_before: Vec::new(),
            trouble: None,
            held: None,
            departed: None,
            valueless: 0,
            has_more: false,
            is_restored: false,
            newest: None,
            safe: Saved::default(),
            reported: Saved::default(),
        }
    }

    /// Whether this is no longer the file under its name.
    pub(super) fn is_other_than(&self, place: FileId) -> bool {
        self.place.is_some_and(|own| own != place)
    }

    /// Reads until something is pending, there is no more for now, or its turn is over.
    pub(super) fn refill(&mut self) {
        let mut turn = 0;
        self.has_more = false;
        while self.pending.is_empty() {
            if turn >= TURN_BYTES {
                self.has_more = true;
                return;
            }
            self.mark_handed_out();
            let before = self.at;
            match self.advance() {
                Ok(true) => {
                    self.trouble = None;
                    turn += READ_BYTES as u64;
                    self.count_valueless(before);
                }
                Ok(false) => {
                    // A packed file is tried again when it has changed, and the trouble with it lasts until then.
                    if !matches!(self.content, Content::Packed(_)) {
                        self.trouble = None;
                    }
                    return;
                }
                Err(error) => {
                    let trouble = error.to_string();
                    if self.trouble.as_ref() != Some(&trouble) {
                        let file = self.path.display();
                        tracing::warn!(%file, %error, "cannot read; will look again");
                        self.trouble = Some(trouble);
                    }
                    return;
                }
            }
        }
    }

    /// Counts what has been read since `before` and gave no value; of a packed file, what was unpacked. A recording may have other things than
    /// readings, as the pictures of a camera.
    fn count_valueless(&mut self, before: u64) {
        if !self.pending.is_empty() {
            self.valueless = 0;
            return;
        }
        self.valueless += if matches!(self.content, Content::Packed(_)) {
            READ_BYTES as u64
        } else {
            self.at.saturating_sub(before)
        };
        if self.valueless > REFUSED_BYTES && !matches!(self.content, Content::Mcap { .. }) {
            self.valueless = 0;
            let error = format!("{REFUSED_BYTES} bytes without a value");
            self.refuse(&io::Error::other(error));
        }
    }

    /// The file under its name, or the one that is held where that is another one by now, until the next look at the
    /// folder.
    fn stat(&self) -> io::Result<FileStat> {
        let named = std::fs::metadata(&self.path).map(|metadata| FileStat::at(&metadata));
        let is_gone = |error: &io::Error| error.kind() == io::ErrorKind::NotFound;
        match (&self.held, named) {
            (Some(_), Ok(named)) if self.place == Some(named.place) => Ok(named),
            (Some(held), named) if named.as_ref().err().is_none_or(is_gone) => {
                Ok(FileStat::at(&held.metadata()?))
            }
            (_, named) => named,
        }
    }

    fn open(&self) -> io::Result<File> {
        let named = File::open(&self.path);
        let Some(held) = &self.held else {
            return named;
        };
        match named {
            Ok(named) if self.place == Some(FileId::of(&named.metadata()?)) => Ok(named),
            // Whoever may not open it any more does not read it either.
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            Ok(_) | Err(_) => held.try_clone(),
        }
    }

    /// One read; `false` when there is no more for now.
    fn advance(&mut self) -> io::Result<bool> {
        let stat = self.stat()?;
        if self.idle == Some(stat) {
            return Ok(self.take_unended());
        }
        let file = self.open()?;
        self.is_restored = false;
        let stat = FileStat::at(&file.metadata()?);
        if self.has_grown_packed(stat) {
            // Known values are dropped as repeated.
            tracing::info!(file = %self.path.display(), "a packed file that has grown since it was read: read from its start");
            self.content = Content::of(&self.decoder, &self.origin);
            self.at = 0;
        } else if !self.is_same(&file, stat)? {
            let is_read =
                self.at > 0 && !matches!(self.content, Content::Refused(_) | Content::Complete);
            if self.departed.is_some() {
                // What has left its name is read on, and nothing else in its place.
                if is_read {
                    let gap = self.lost("cut off, or another file, and no longer under its name");
                    self.pending.push_back(gap);
                    self.content = Content::Complete;
                }
                self.idle = Some(stat);
                return Ok(false);
            }
            if is_read && self.place == Some(stat.place) {
                self.report_cut(stat.size);
            } else {
                tracing::info!(file = %self.path.display(), at = self.at, "another file: read from its start");
            }
            self.begin_anew();
        } else if self.is_rewritten(&file)? {
            // Known values are dropped as repeated.
            tracing::info!(file = %self.path.display(), at = self.at, "what had been read of it is another text now: read from its start");
            self.begin_anew();
            self.read_anew = Some(Stopwatch::start());
        }
        self.place = Some(stat.place);
        self.modified = stat.modified;
        self.changed = stat.changed;
        let before = self.at;
        match &self.content {
            Content::Text(_) => self.read_text(&file)?,
            Content::Packed(_) => return self.read_packed(stat),
            Content::Mcap { .. } => self.read_record(&file, stat.size)?,
            Content::Complete => self.look_behind_footer(&file, stat.size)?,
            Content::Refused(_) => {}
        }
        let moved = self.at != before;
        if moved {
            self.mark = read_at(&file, self.mark_start(), self.at - self.mark_start())?;
            // What was read before a rewriting is compared with until the file is read anew, also by the next process.
            if self.other_since.is_none() {
                let is_at_end = self.at >= stat.size && matches!(self.content, Content::Text(_));
                self.earlier = is_at_end.then(|| self.hash_of_earlier(&file)).transpose()?;
            }
        }
        // A suspect record is looked at again although nothing changes any more.
        let suspect =
            matches!(self.content, Content::Mcap { suspect: Some(at), .. } if at == self.at);
        self.idle = (!moved && !suspect && self.other_since.is_none()).then_some(stat);
        self.idle_since = self.idle.map(|_| Stopwatch::start());
        Ok(moved)
    }

    /// Takes the last line although nothing ends it, once whoever writes has had the time to go on.
    fn take_unended(&mut self) -> bool {
        let has_rested = |since: Stopwatch| since.elapsed() >= WRITTEN;
        let Content::Text(text) = &mut self.content else {
            return false;
        };
        let line = (self.idle_since.is_some_and(has_rested)).then(|| text.unended());
        line.flatten().map(|line| self.take(line)).is_some()
    }

    /// Whether more has been packed into the file, under its name, since it was read whole.
    fn has_grown_packed(&self, stat: FileStat) -> bool {
        matches!(self.content, Content::Complete)
            && is_packed(&self.origin)
            && self.departed.is_none()
            && self.place == Some(stat.place)
            && stat.size > self.at
    }

    pub(super) fn mark_start(&self) -> u64 {
        self.at.saturating_sub(MARK_BYTES)
    }

    fn is_same(&self, file: &File, stat: FileStat) -> io::Result<bool> {
        if self.at == 0 {
            return Ok(!matches!(self.content, Content::Refused(_)));
        }
        if self.place != Some(stat.place) || stat.size < self.at {
            return Ok(false);
        }
        Ok(read_at(file, self.mark_start(), self.at - self.mark_start())? == self.mark)
    }

    /// From its start, with the columns of its header before where it has none now.
    fn begin_anew(&mut self) {
        self.header_before = self.header();
        let before = std::mem::replace(&mut self.content, Content::of(&self.decoder, &self.origin));
        self.follow_on(&before);
        self.at = 0;
        (self.earlier, self.other_since) = (None, None);
    }

    /// Whether rows that have been read stand there otherwise, as in an export written over the one before; what has left its name is read on.
    /// Only once whoever writes it has had the time to, and not again at once: some programs count in the header what they append.
    fn is_rewritten(&mut self, file: &File) -> io::Result<bool> {
        let Some(known) = self.earlier.filter(|_| self.departed.is_none()) else {
            return Ok(false);
        };
        if self.other_since.is_none() && self.hash_of_earlier(file)? != known {
            self.other_since = Some(Stopwatch::start());
        }
        let is_written =
            (self.other_since.as_ref()).is_some_and(|since| since.elapsed() >= WRITTEN);
        let is_again = (self.read_anew.as_ref()).is_some_and(|since| since.elapsed() < ANEW_AGAIN);
        Ok(is_written && !is_again)
    }

    fn hash_of_earlier(&self, file: &File) -> io::Result<u64> {
        let from = self.at.saturating_sub(EARLIER_BYTES);
        let mut hasher = FnvHasher::default();
        hasher.write(&read_at(file, from, self.at - from)?);
        Ok(hasher.finish())
    }

    fn read_text(&mut self, file: &File) -> io::Result<()> {
        let mut buffer = vec![0; READ_BYTES];
        let read = file.read_at(&mut buffer, self.at)?;
        let ReadSpan { count, next } = ReadSpan::of(&buffer[..read], file, self.at)?;
        self.at = next;
        if let Content::Text(text) = &mut self.content {
            let has_lines_ended_later = text.has_lines_ended_later();
            let fed = text.feed(&buffer[..count]);
            if let Some(mut reader) = self.without_header(&fed) {
                if has_lines_ended_later {
                    reader.expect_lines_ended_later();
                }
                self.content = Content::Text(Box::new(reader));
                self.at = 0;
                return self.read_text(file);
            }
            self.take(fed);
        }
        Ok(())
    }

    /// One piece of a packed file; `false` when it has all been read.
    fn read_packed(&mut self, stat: FileStat) -> io::Result<bool> {
        let Content::Packed(unpacking) = &mut self.content else {
            return Ok(false);
        };
        match unpacking.next(&self.path) {
            Ok(Some(fed)) => {
                self.take(fed);
                Ok(true)
            }
            Ok(None) => {
                let fed = unpacking.end();
                self.take(fed);
                self.content = Content::Complete;
                self.at = stat.size;
                let file = File::open(&self.path)?;
                self.mark = read_at(&file, self.mark_start(), self.at - self.mark_start())?;
                Ok(true)
            }
            Err(error) => {
                // Perhaps it is still being packed: from its start again when it has changed.
                self.content = Content::of(&self.decoder, &self.origin);
                self.idle = Some(stat);
                Err(error)
            }
        }
    }

    pub(super) fn expect(&mut self, item: Item) {
        if let Some(arrival) = self.decoder.arrival(item) {
            self.newest = self.newest.max(Some(arrival.time));
            self.pending.push_back(arrival);
        }
    }
}

pub(super) fn read_at(file: &File, at: u64, length: u64) -> io::Result<Vec<u8>> {
    let length = usize::try_from(length).map_err(io::Error::other)?;
    let mut bytes = vec![0; length];
    file.read_exact_at(&mut bytes, at)?;
    Ok(bytes)
}

//! A daemon's record: what stands in the state, copied into MCAP files while the daemon works.
//!
//! A thread of its own follows the state as anybody may who looks on. So no disk that is full, slow or gone keeps the
//! work loop waiting, and what could not be written is written once there is room: it stands in the state. What was
//! written in the last seconds before a kill may stand twice, at the end of one file and the beginning of the next.

use super::files;
use super::level_now::LevelsNow;
use super::topics::TopicWriter;
use crate::config::{Config, RecordFiles};
use crate::monitor::{Event, KindShown, Measured, by_time};
use crate::reading::Timestamp;
use crate::runtime::clock::{self, Stopwatch};
use crate::runtime::recorded::RecordStanding;
use crate::runtime::standing::every_until;
use crate::runtime::vitals::Vitals;
use crate::store::{Store, StoreError};
use jiff::tz::TimeZone;
use mcap::McapError;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;
use tokio::sync::oneshot;

/// How often the state is looked at.
const POLL: Duration = Duration::from_secs(1);
/// How long after a failure it is tried again.
const RETRY: Duration = Duration::from_secs(10);
/// How often it is noted how far the record has come, which takes a sync.
const NOTE: Duration = Duration::from_secs(10);

/// An event's line for a person.
pub type EventWords = fn(&Event, &TimeZone) -> String;

/// What the record could not do.
#[derive(Debug, thiserror::Error)]
enum RecordError {
    #[error("the state cannot be read: {0}")]
    State(#[from] StoreError),
    #[error("the event {number} cannot be read: {source}")]
    Event {
        number: i64,
        source: serde_json::Error,
    },
    #[error("no file can be begun beside {}: {source}", .path.display())]
    Begin { path: PathBuf, source: io::Error },
    #[error("{}: {source}", .file.display())]
    Write { file: PathBuf, source: McapError },
}

/// What the thread is asked for.
enum RecordOrder {
    Follow(RecordFiles),
    Stop,
}

/// The thread that records.
#[derive(Debug)]
pub(in crate::runtime) struct LiveRecord {
    orders: mpsc::Sender<RecordOrder>,
    done: oneshot::Receiver<()>,
}

impl LiveRecord {
    /// Goes on where the record of this state ended, or from now on where there is none; `None` where the config asks for
    /// none. Without a thread there is no record, and the daemon works.
    pub(in crate::runtime) fn start(
        config: &Config,
        store: &Store,
        vitals: &Arc<Vitals>,
        words: EventWords,
    ) -> Option<Self> {
        let files = config.site.record.clone()?;
        let state_dir = config.site.state_dir.clone();
        let (step, event) = (store.last_step(), store.last_event());
        let known = RecordStanding::read(&state_dir);
        // A state that was put back has no more than it had then.
        let known = known.filter(|known| known.step <= step && known.event <= event);
        let begun = RecordStanding {
            step,
            event,
            ..RecordStanding::default()
        };
        let recorder = Recorder {
            files,
            state_dir,
            zone: config.site.time_zone.clone(),
            words,
            vitals: Arc::clone(vitals),
            store: None,
            open: None,
            levels: LevelsNow::default(),
            standing: known.unwrap_or(begun),
            noted: None,
            failed: None,
        };
        let (orders, received) = mpsc::channel();
        let (end, done) = oneshot::channel();
        let work = move || {
            recorder.work(&received);
            // Nobody may be waiting any more.
            let _ = end.send(());
        };
        let started = std::thread::Builder::new()
            .name("record".to_owned())
            .spawn(work);
        if let Err(error) = started {
            tracing::error!(%error, "no record is kept: there is no thread for it");
            return None;
        }
        Some(Self { orders, done })
    }

    /// Goes on in other files.
    pub(in crate::runtime) fn follow(&self, files: &RecordFiles) {
        // A thread that has ended has said why.
        let _ = self.orders.send(RecordOrder::Follow(files.clone()));
    }

    /// Records what there is and ends the file, if the disk takes it within `limit`.
    pub(in crate::runtime) async fn close(self, limit: Duration) {
        let _ = self.orders.send(RecordOrder::Stop);
        if tokio::time::timeout(limit, self.done).await.is_err() {
            tracing::warn!("the recording could not be closed: its disk does not respond");
        }
    }
}

/// A file that is being written.
struct OpenFile {
    writer: TopicWriter<BufWriter<File>>,
    path: PathBuf,
    file: File,
    /// Bytes up to the end of the last chunk that is there for certain.
    whole: u64,
}

struct Recorder {
    files: RecordFiles,
    state_dir: PathBuf,
    zone: TimeZone,
    words: EventWords,
    vitals: Arc<Vitals>,
    store: Option<Store>,
    open: Option<OpenFile>,
    levels: LevelsNow,
    standing: RecordStanding,
    /// Since it was noted in the state folder how far it has come; `None`: not yet.
    noted: Option<Stopwatch>,
    /// Since the last attempt, where that failed.
    failed: Option<Stopwatch>,
}

impl Recorder {
    fn work(mut self, orders: &mpsc::Receiver<RecordOrder>) {
        loop {
            match orders.recv_timeout(POLL) {
                Err(RecvTimeoutError::Timeout) => self.turn(),
                Ok(RecordOrder::Follow(files)) => {
                    self.end_file();
                    self.files = files;
                    self.failed = None;
                }
                Ok(RecordOrder::Stop) | Err(RecvTimeoutError::Disconnected) => {
                    self.failed = None;
                    self.turn();
                    self.end_file();
                    self.note();
                    return;
                }
            }
        }
    }

    fn turn(&mut self) {
        if self.failed.is_some_and(|since| since.elapsed() < RETRY) {
            return;
        }
        match self.advance() {
            Ok(()) => self.succeeds(),
            Err(error) => self.fails(&error),
        }
        let standing = self.standing.clone();
        self.vitals.update(|health| health.record = Some(standing));
    }

    fn succeeds(&mut self) {
        self.failed = None;
        if self.standing.failure.take().is_some() {
            self.standing.failing_since = None;
            tracing::info!("the record is written again");
            self.note();
        } else if self.noted.is_none_or(|noted| noted.elapsed() >= NOTE) {
            self.note();
        }
    }

    fn fails(&mut self, error: &RecordError) {
        self.failed = Some(Stopwatch::start());
        // What is wrong with the state is no reason to end the file.
        if matches!(error, RecordError::Begin { .. } | RecordError::Write { .. }) {
            self.end_file();
        }
        if self.standing.failure.is_none() {
            tracing::error!(%error, "the record cannot be written; alerts go out all the same");
            self.standing.failing_since = Some(clock::now());
        }
        self.standing.failure = Some(error.to_string());
        self.note();
    }

    /// Notes how far it has come. Where that fails, more is written twice after a kill.
    fn note(&mut self) {
        self.noted = Some(Stopwatch::start());
        let known = RecordStanding::read(&self.state_dir);
        if known.as_ref() != Some(&self.standing)
            && let Err(error) = self.standing.write(&self.state_dir)
        {
            tracing::warn!(%error, "how far the record has come cannot be noted");
        }
    }

    /// Copies what has been committed since.
    fn advance(&mut self) -> Result<(), RecordError> {
        let store = match self.store.take() {
            Some(store) => store,
            None => self.look()?,
        };
        let copied = self.copy(&store);
        self.store = Some(store);
        copied
    }

    /// Opens the state, and learns which levels are in force where the record goes on.
    fn look(&mut self) -> Result<Store, RecordError> {
        let store = Store::look(&self.state_dir)?;
        let alerts = every_until(&store, KindShown::ALERT.name, self.standing.event)?;
        for alert in by_time(alerts) {
            self.levels.take(&alert);
        }
        Ok(store)
    }

    fn copy(&mut self, store: &Store) -> Result<(), RecordError> {
        loop {
            let steps = store.steps(self.standing.step)?;
            let events = store.events(self.standing.event, None, None)?;
            if steps.is_empty() && events.is_empty() {
                return Ok(());
            }
            for measured in steps.iter().filter_map(|row| row.input.measured()) {
                self.write(measured.time(), Some(&measured), |writer, levels| {
                    writer.measured(&measured, levels)
                })?;
            }
            for (number, body) in &events {
                let event: Event = serde_json::from_str(body).map_err(|source| {
                    let number = *number;
                    RecordError::Event { number, source }
                })?;
                let words = (self.words)(&event, &self.zone);
                self.write(event.time, None, |writer, levels| {
                    writer.event(&event, &words, levels)
                })?;
            }
            self.flush()?;
            let (step, event) = (steps.last(), events.last());
            self.standing.step = step.map_or(self.standing.step, |row| row.seq);
            self.standing.event = event.map_or(self.standing.event, |(number, _)| *number);
        }
    }

    fn write(
        &mut self,
        time: Timestamp,
        measured: Option<&Measured<'_>>,
        write: impl FnOnce(&mut TopicWriter<BufWriter<File>>, &mut LevelsNow) -> Result<(), McapError>,
    ) -> Result<(), RecordError> {
        let takes = |open: &OpenFile| open.writer.takes(time, measured);
        if !self.open.as_ref().is_some_and(takes) {
            self.end_file();
            self.open = Some(self.begin(time)?);
        }
        let Some(open) = &mut self.open else {
            return Ok(());
        };
        write(&mut open.writer, &mut self.levels).map_err(|source| RecordError::Write {
            file: open.path.clone(),
            source,
        })
    }

    fn begin(&mut self, first: Timestamp) -> Result<OpenFile, RecordError> {
        let files = &self.files;
        let begun = || {
            // A place that nothing was ever written to has nothing to remove.
            if files.path.parent().is_some_and(Path::exists) {
                files::remove_oldest(&files.path, files.total.saturating_sub(files.size))?;
            }
            let (path, file) = files::begin(&files.path)?;
            Ok((path, file.try_clone()?, file))
        };
        let (path, file, out) = begun().map_err(|source| RecordError::Begin {
            path: files.path.clone(),
            source,
        })?;
        // Before 1970 times count from the oldest that the state can hold, as none is known that will not be older.
        let first = if first < Timestamp::UNIX_EPOCH {
            OLDEST
        } else {
            first
        };
        let writer = TopicWriter::create(BufWriter::new(out), first, &BTreeMap::new());
        let writer = writer.and_then(|mut writer| writer.grows().map(|()| writer));
        let writer = writer.map_err(|source| {
            // Nothing is in it yet.
            remove(&path);
            let file = path.clone();
            RecordError::Write { file, source }
        })?;
        self.standing.file = Some(path.display().to_string());
        Ok(OpenFile {
            writer,
            path,
            file,
            whole: 0,
        })
    }

    /// Writes what is in memory, and ends a file that is long enough.
    fn flush(&mut self) -> Result<(), RecordError> {
        let Some(open) = &mut self.open else {
            return Ok(());
        };
        let flushed = open.writer.flush().and_then(|()| {
            open.whole = open.file.metadata()?.len();
            Ok(())
        });
        flushed.map_err(|source| RecordError::Write {
            file: open.path.clone(),
            source,
        })?;
        if open.whole >= self.files.size {
            self.end_file();
        }
        Ok(())
    }

    /// Ends the file with its summary; where the disk does not take it, behind its last whole chunk.
    fn end_file(&mut self) {
        let Some(open) = self.open.take() else {
            return;
        };
        let finished = open.writer.finish();
        // A writer that has failed before may say that it has finished.
        if finished.is_ok() && files::is_ended(&open.path) && open.file.sync_all().is_ok() {
            return;
        }
        let cut = match open.whole {
            0 => std::fs::remove_file(&open.path),
            whole => open.file.set_len(whole),
        };
        if let Err(error) = cut {
            tracing::warn!(file = %open.path.display(), %error, "the record's file ends in the middle of a chunk");
        }
    }
}

/// Removes a file without anything in it.
fn remove(file: &Path) {
    if let Err(error) = std::fs::remove_file(file) {
        tracing::warn!(file = %file.display(), %error, "an empty file of the record cannot be removed");
    }
}

/// The oldest time that the state can hold.
const OLDEST: Timestamp = Timestamp::constant(-9_223_372_036, 0);

//! What lasts and keeps the daemon from its work: a broker that cannot be reached, a file that cannot be read, a state that cannot be
//! written. It stands in the state folder too, for those who ask the state while the daemon runs.

use super::clock;
use super::locked::locked;
use crate::reading::Timestamp;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard};

/// In the state folder.
const FILE: &str = "faults.json";
/// Of this size from the start: what it says is written over what it said, which needs no room on a full disk.
const FILE_BYTES: usize = 16 * 1024;
/// Faults that are shown one by one, and characters of each; all are counted.
const MOST_SHOWN: usize = 20;
const LONGEST_TEXT: usize = 400;

/// What the daemon cannot do.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, JsonSchema, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum ServiceFaultKind {
    /// Write the state: what comes waits unacknowledged, and alerts go out from memory.
    StateUnwritable,
    /// Reach a broker.
    BrokerUnreachable,
    /// Subscribe at a broker.
    SubscriptionRefused,
    /// Have an alert taken by a hook.
    HookFailing,
    /// List a folder.
    FolderUnreadable,
    /// Read a file.
    FileUnreadable,
    /// Make anything of a file, until it is replaced.
    FileRefused,
    /// Take the last row of a file, which has no line break.
    RowUnended,
    /// Use any of the newest rows of a file, or messages of a recording.
    RowsRefused,
    /// Use any of the newest messages of a broker.
    MessagesRefused,
}

impl ServiceFaultKind {
    /// Each of them.
    pub(super) const ALL: [Self; 10] = [
        Self::StateUnwritable,
        Self::BrokerUnreachable,
        Self::SubscriptionRefused,
        Self::FolderUnreadable,
        Self::FileUnreadable,
        Self::FileRefused,
        Self::RowUnended,
        Self::RowsRefused,
        Self::MessagesRefused,
        Self::HookFailing,
    ];

    /// As in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::StateUnwritable => "state-unwritable",
            Self::BrokerUnreachable => "broker-unreachable",
            Self::SubscriptionRefused => "subscription-refused",
            Self::FolderUnreadable => "folder-unreadable",
            Self::FileUnreadable => "file-unreadable",
            Self::FileRefused => "file-refused",
            Self::RowUnended => "row-unended",
            Self::RowsRefused => "rows-refused",
            Self::MessagesRefused => "messages-refused",
            Self::HookFailing => "hook-failing",
        }
    }

    /// Whether it is of a file, or a folder of them.
    fn is_of_files(self) -> bool {
        match self {
            Self::StateUnwritable
            | Self::BrokerUnreachable
            | Self::SubscriptionRefused
            | Self::MessagesRefused
            | Self::HookFailing => false,
            Self::FolderUnreadable
            | Self::FileUnreadable
            | Self::FileRefused
            | Self::RowUnended
            | Self::RowsRefused => true,
        }
    }
}

/// A fault that lasts.
#[derive(Debug, Clone, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
pub struct ServiceFault {
    /// What cannot be done.
    pub kind: ServiceFaultKind,
    /// Of which source; null where it is of none.
    pub source: Option<String>,
    /// Where, and why.
    pub text: String,
    /// Since when, by the host's clock.
    pub since: Timestamp,
}

/// What a fault is of: its kind, its source, and the file or folder.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct FaultPlace {
    pub(super) kind: ServiceFaultKind,
    pub(super) source: Option<String>,
    pub(super) what: String,
}

impl FaultPlace {
    /// Of a source as a whole.
    pub(super) fn of_source(kind: ServiceFaultKind, source: &str) -> Self {
        Self {
            kind,
            source: Some(source.to_owned()),
            what: String::new(),
        }
    }

    /// Of a hook.
    pub(super) fn of_hook(name: &str) -> Self {
        Self {
            kind: ServiceFaultKind::HookFailing,
            source: None,
            what: name.to_owned(),
        }
    }

    /// Of the state.
    pub(super) fn of_state() -> Self {
        Self {
            kind: ServiceFaultKind::StateUnwritable,
            source: None,
            what: String::new(),
        }
    }
}

type Lasting = BTreeMap<FaultPlace, (String, Timestamp)>;

/// The faults that last, shared by those who meet them and those who show them.
#[derive(Debug, Clone, Default)]
pub struct ServiceFaults(Arc<Mutex<Lasting>>);

impl ServiceFaults {
    /// It lasts, and is what `text` says.
    pub(super) fn begin_fault(&self, place: FaultPlace, text: &str) {
        let entry = (text.chars().take(LONGEST_TEXT).collect(), clock::now());
        let mut faults = self.locked();
        let (known, _) = faults.entry(place).or_insert_with(|| entry.clone());
        *known = entry.0;
    }

    /// It is over, if it ever was.
    pub(super) fn end_fault(&self, place: &FaultPlace) {
        self.locked().remove(place);
    }

    /// Of files and folders these last, and no others.
    pub(super) fn set_file_faults(&self, now: impl IntoIterator<Item = (FaultPlace, String)>) {
        let now: BTreeMap<FaultPlace, String> = now.into_iter().collect();
        let is_past = |place: &FaultPlace| place.kind.is_of_files() && !now.contains_key(place);
        self.locked().retain(|place, _| !is_past(place));
        for (place, text) in now {
            self.begin_fault(place, &text);
        }
    }

    /// Of hooks these remain, and no others: those that the config has from here on.
    pub(super) fn keep_hooks(&self, names: &[String]) {
        self.locked().retain(|place, _| {
            place.kind != ServiceFaultKind::HookFailing || names.contains(&place.what)
        });
    }

    /// Those of sources are over: the sources are others from here on.
    pub(super) fn forget_sources(&self) {
        self.locked().retain(|place, _| place.source.is_none());
    }

    /// The first of them.
    pub fn shown(&self) -> Vec<ServiceFault> {
        let faults = self.locked();
        let shown = faults.iter().take(MOST_SHOWN);
        shown
            .map(|(place, (text, since))| ServiceFault {
                kind: place.kind,
                source: place.source.clone(),
                text: text.clone(),
                since: *since,
            })
            .collect()
    }

    /// How many there are of each kind and source, all of them.
    pub(super) fn counts(&self) -> BTreeMap<(ServiceFaultKind, Option<String>), usize> {
        let mut counts = BTreeMap::new();
        for place in self.locked().keys() {
            *counts
                .entry((place.kind, place.source.clone()))
                .or_default() += 1;
        }
        counts
    }

    fn locked(&self) -> MutexGuard<'_, Lasting> {
        locked(&self.0)
    }
}

/// Those that the daemon which runs on this state meets; of one that has stopped they are what it met last.
pub fn faults_in(state_dir: &Path) -> Vec<ServiceFault> {
    let read = || -> io::Result<Vec<ServiceFault>> {
        let mut text = String::new();
        let mut file = File::open(state_dir.join(FILE))?.take(FILE_BYTES as u64);
        file.read_to_string(&mut text)?;
        Ok(serde_json::from_str(&text)?)
    };
    // There is none before a daemon has run.
    let mut all = read().unwrap_or_default();
    all.extend(read_only(state_dir));
    all
}

/// That the file in which a daemon says what it meets lies on a file system that is read-only: it cannot say that itself.
fn read_only(state_dir: &Path) -> Option<ServiceFault> {
    let path = state_dir.join(FILE);
    let opened = File::options().write(true).open(&path);
    opened
        .err()
        .filter(|error| error.kind() == io::ErrorKind::ReadOnlyFilesystem)?;
    let written = path.metadata().and_then(|file| file.modified());
    let written = written.ok().and_then(|time| Timestamp::try_from(time).ok());
    Some(ServiceFault {
        kind: ServiceFaultKind::StateUnwritable,
        source: None,
        text: format!(
            "{} lies on a file system that is read-only here: what is shown may be old, a level in force may be missing, and no order can be left. \
             Whether the daemon can write it is said by its log, its /readyz and its hooks",
            state_dir.display()
        ),
        since: written.unwrap_or_else(clock::now),
    })
}

/// Writes them over what was there.
pub(super) fn write(state_dir: &Path, faults: &[ServiceFault]) -> io::Result<()> {
    let mut shown = faults;
    let mut text = serde_json::to_vec(shown)?;
    while text.len() > FILE_BYTES {
        shown = &shown[..shown.len() / 2];
        text = serde_json::to_vec(shown)?;
    }
    text.resize(FILE_BYTES, b' ');
    let mut options = File::options();
    let file = (options.create(true).truncate(false).write(true)).open(state_dir.join(FILE))?;
    file.write_all_at(&text, 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn broker() -> FaultPlace {
        FaultPlace::of_source(ServiceFaultKind::BrokerUnreachable, "radio")
    }

    fn file(number: usize) -> (FaultPlace, String) {
        let place = FaultPlace {
            what: format!("{number}.csv"),
            ..FaultPlace::of_source(ServiceFaultKind::FileUnreadable, "logger")
        };
        (place, "\u{1}é".repeat(300))
    }

    #[test]
    fn what_is_over_goes_and_what_lasts_keeps_its_beginning() {
        let faults = ServiceFaults::default();
        faults.begin_fault(broker(), "refused");
        faults.set_file_faults((0..3).map(file));
        let since = faults.shown()[0].since;
        faults.begin_fault(broker(), "no route");
        faults.set_file_faults([file(1)]);
        let shown = faults.shown();
        assert_eq!((shown.len(), shown[0].since), (2, since));
        assert_eq!(shown[0].text, "no route");
        faults.end_fault(&broker());
        faults.begin_fault(FaultPlace::of_state(), "full");
        faults.forget_sources();
        assert_eq!(faults.counts().len(), 1);
    }

    #[test]
    fn as_many_as_there_are_fit_into_the_file_and_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(faults_in(folder.path()), []);
        let faults = ServiceFaults::default();
        faults.set_file_faults((0..500).map(file));
        assert_eq!(faults.counts().into_values().collect::<Vec<_>>(), [500]);
        write(folder.path(), &faults.shown()).unwrap();
        let read = faults_in(folder.path());
        assert!(
            !read.is_empty() && read.len() <= MOST_SHOWN,
            "{}",
            read.len()
        );
        write(folder.path(), &[]).unwrap();
        assert_eq!(faults_in(folder.path()), []);
    }
}

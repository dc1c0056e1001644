//! Whether the kernel lets us watch the sources' folders.

use super::{CheckVerdict, Finding};
use crate::config::Config;
use notify::{ErrorKind, RecursiveMode, Watcher};
use std::collections::BTreeSet;
use std::io;
use std::path::Path;

const CHECK: &str = "inotify";

/// Watches the folders for real, for a moment.
pub(super) fn finding(config: &Config) -> Finding {
    let folders = config.sources.iter().map(|source| source.pattern.folder());
    let folders: BTreeSet<&Path> = folders.filter(|folder| folder.is_dir()).collect();
    let limits = format!(
        "{} folders, limits {} watches and {} watchers a user",
        folders.len(),
        limit("max_user_watches"),
        limit("max_user_instances")
    );
    let tried = notify::recommended_watcher(|_: notify::Result<notify::Event>| {}).and_then(
        |mut watcher| {
            (folders.iter())
                .try_for_each(|folder| watcher.watch(folder, RecursiveMode::NonRecursive))
        },
    );
    let is_of_rights = |error: &notify::Error| matches!(&error.kind, ErrorKind::Io(why) if why.kind() == io::ErrorKind::PermissionDenied);
    match tried {
        Ok(()) => Finding::new(CHECK, CheckVerdict::Good, limits),
        Err(error) if is_of_rights(&error) => Finding::new(
            CHECK,
            CheckVerdict::Doubtful,
            format!("{error}: give the daemon's user the right to read the folder"),
        ),
        Err(error) => Finding::new(
            CHECK,
            CheckVerdict::Doubtful,
            format!(
                "{error} ({limits}): files are looked at every two seconds instead; raise \
                 fs.inotify.max_user_watches or max_user_instances with sysctl"
            ),
        ),
    }
}

fn limit(name: &str) -> String {
    std::fs::read_to_string(Path::new("/proc/sys/fs/inotify").join(name))
        .map_or_else(|_| "unknown".to_owned(), |text| text.trim().to_owned())
}

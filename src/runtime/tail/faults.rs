//! Which files and folders cannot be read now, and why.

use super::file::{Content, FileTail};
use super::follow::Follower;
use crate::runtime::service_faults::{FaultPlace, ServiceFaultKind};
use std::path::Path;

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
        folders.chain(files).collect()
    }
}

impl FileTail {
    fn fault(&self) -> Option<(ServiceFaultKind, String)> {
        let file = self.path.display();
        if let Content::Refused(why) = &self.content {
            let text = format!("{file} is refused until it is replaced: {why}");
            return Some((ServiceFaultKind::FileRefused, text));
        }
        let trouble = self.trouble.as_ref()?;
        let text = format!("{file} cannot be read: {trouble}");
        Some((ServiceFaultKind::FileUnreadable, text))
    }
}

//! The events of the state, for those who ask over the network.

use super::serve::{Archive, ArchiveError, Page};
use crate::store::Store;
use std::sync::Arc;

/// The events in a site's state.
#[derive(Debug)]
pub(super) struct Events(Arc<Store>);

impl Events {
    pub(super) fn of(store: Arc<Store>) -> Self {
        Self(store)
    }
}

impl Archive for Events {
    fn events(&self, since: Option<&str>, limit: usize) -> Result<Page, ArchiveError> {
        let after = since.map_or(Ok(0), str::parse::<i64>);
        let after =
            after.map_err(|_| ArchiveError::NoSuchPlace(since.unwrap_or_default().to_owned()))?;
        let events = self.0.events(after, None, None);
        let mut events = events.map_err(|error| ArchiveError::Unreadable(error.to_string()))?;
        events.truncate(limit);
        let next = events.last().map_or(after, |(seq, _)| *seq);
        let lines = events.iter().flat_map(|(_, body)| [body.as_str(), "\n"]);
        Ok(Page {
            lines: lines.collect(),
            next: next.to_string(),
        })
    }
}

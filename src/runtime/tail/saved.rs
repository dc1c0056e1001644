//! A file put back to where a restart goes on in it, and that place as it moves.

use super::decode::{Decoder, whatever};
use super::file::{Content, FileTail};
use super::position::{Saved, SavedContent};
use super::records::Channels;
use super::text::{SavedText, TextReader};
use crate::monitor::{from_bytes, means_the_same};
use std::collections::BTreeMap;
use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

/// Stands behind how a benchmark was read of a source that the config has no more.
const LEFT: &str = ", and left out since";

impl FileTail {
    /// The file as [`FileTail::moved`] reported it, perhaps to another process.
    ///
    /// # Errors
    /// When this version, or this config, cannot go on from there.
    pub(super) fn restored(
        path: PathBuf,
        decoder: Arc<Decoder>,
        body: &[u8],
    ) -> Result<Self, Box<dyn Error>> {
        let saved: Saved = from_bytes(body)?;
        let origin = saved.origin.clone().unwrap_or_else(|| path.clone());
        let rows = decoder.text_rows(&origin);
        let is_read_anew = saved.misses(&decoder);
        let mut file = Self::new(origin, decoder);
        file.path = path;
        if is_read_anew {
            tracing::info!(file = %file.path.display(), "read from its start: the config takes other readings from it");
            return Ok(file);
        }
        file.content = match (saved.content.clone(), rows) {
            (SavedContent::Text(text), Some(rows)) => {
                Content::Text(Box::new(TextReader::restored(rows, text)?))
            }
            (SavedContent::Mcap(channels), None) => Content::Mcap {
                channels,
                suspect: None,
            },
            (SavedContent::Complete, _) => Content::Complete,
            (SavedContent::Anew | SavedContent::Text(_) | SavedContent::Mcap(_), _) => {
                return Ok(file);
            }
        };
        file.is_restored = true;
        file.at = saved.at;
        file.place = saved.place;
        file.mark.clone_from(&saved.mark);
        file.earlier = saved.earlier;
        file.refused_rows = saved.refused_rows.clone();
        file.reported = saved.clone();
        // From here on these readings are taken from it, though it may not grow.
        file.safe = Saved {
            read_as: Some(Arc::clone(file.decoder.read_as())),
            ..saved
        };
        Ok(file)
    }

    /// From where a restart is to go on, if that is another place than when last asked.
    pub(super) fn moved(&mut self) -> Option<Vec<u8>> {
        if self.reported == self.safe {
            return None;
        }
        let body = rmp_serde::to_vec_named(&self.safe)
            .inspect_err(|error| tracing::error!(%error, "no position to go on from"))
            .ok()?;
        self.reported = self.safe.clone();
        Some(body)
    }

    /// What a restart goes on from where the file has another name now, and no more of it counts as read than
    /// `acknowledged` says.
    pub(super) fn kept(&self, acknowledged: Option<&[u8]>) -> Option<Vec<u8>> {
        let from_its_start = || Saved {
            place: self.place,
            content: match &self.content {
                Content::Text(_) => SavedContent::Text(SavedText::default()),
                Content::Mcap { .. } => SavedContent::Mcap(Channels::default()),
                Content::Packed(_) | Content::Refused(_) | Content::Complete => SavedContent::Anew,
            },
            ..Saved::default()
        };
        let saved = acknowledged.and_then(|body| from_bytes(body).ok());
        let saved = Saved {
            origin: Some(self.origin.clone()),
            ..saved.unwrap_or_else(from_its_start)
        };
        rmp_serde::to_vec_named(&saved).ok()
    }

    /// Everything up to here has been handed out.
    pub(super) fn mark_handed_out(&mut self) {
        let is_there = self.safe.at == self.at && self.safe.place == self.place;
        if is_there && self.safe.mark == self.mark && self.safe.earlier == self.earlier {
            return;
        }
        let content = match &self.content {
            Content::Text(text) => SavedContent::Text(text.saved()),
            Content::Mcap { channels, .. } => SavedContent::Mcap(channels.clone()),
            Content::Complete => SavedContent::Complete,
            // A packed file is read whole or not at all.
            Content::Packed(_) | Content::Refused(_) => SavedContent::Anew,
        };
        self.safe = Saved {
            at: self.at,
            place: self.place,
            mark: self.mark.clone(),
            earlier: self.earlier,
            content,
            refused_rows: self.refused_rows.clone(),
            origin: (self.origin != self.path).then(|| self.origin.clone()),
            read_as: Some(Arc::clone(self.decoder.read_as())),
        };
    }
}

impl Saved {
    /// Whether the file has been read without readings that the config takes from it now: of benchmarks that it did not name then,
    /// or that were read as something else.
    fn misses(&self, decoder: &Decoder) -> bool {
        let Some(before) = &self.read_as else {
            return false;
        };
        let now = decoder.read_as();
        // Earlier versions did not keep how a source is read that names no benchmarks.
        let nothing = String::new();
        now.iter().any(|(id, read_as)| {
            let otherwise = (*id == whatever()).then_some(&nothing);
            let before = before.get(id).or(otherwise);
            before.is_none_or(|before| !means_the_same(before, read_as))
        })
    }

    /// The same where the config has no such source: what it takes, should the config have it again, has been forgotten meanwhile. `None` where that
    /// is noted.
    pub(super) fn left(mut self) -> Option<Self> {
        let mut read_as = self
            .read_as
            .take()
            .map_or_else(BTreeMap::new, Arc::unwrap_or_clone);
        read_as.entry(whatever()).or_default();
        if read_as.values().all(|one| one.ends_with(LEFT)) {
            return None;
        }
        for one in read_as.values_mut().filter(|one| !one.ends_with(LEFT)) {
            *one += LEFT;
        }
        self.read_as = Some(Arc::new(read_as));
        Some(self)
    }
}

//! How far the reading of files is, for those who see to it that it goes on.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Which source is being read, and how many folders and files have been looked at.
#[derive(Debug, Clone, Default)]
pub(super) struct AtWork(Arc<(AtomicUsize, AtomicUsize)>);

impl AtWork {
    /// A folder or a file of the source of this number comes next.
    pub(super) fn comes_to(&self, source: usize) {
        self.0.0.store(source, Ordering::Relaxed);
        self.0.1.fetch_add(1, Ordering::Relaxed);
    }

    /// The number of the source.
    pub(super) fn source(&self) -> usize {
        self.0.0.load(Ordering::Relaxed)
    }

    /// Folders and files so far.
    pub(super) fn steps(&self) -> usize {
        self.0.1.load(Ordering::Relaxed)
    }
}

//! Locks that one panic does not close for all others.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// What `mutex` guards; also where whoever had it has panicked.
pub(super) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

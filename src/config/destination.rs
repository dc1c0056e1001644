//! Where alerts go beside programs: what the rest of the program asks of such a place.

use std::any::Any;
use std::fmt::Debug;
use std::ops::Deref;
use std::path::PathBuf;
use std::sync::Arc;

/// What one table of the config says of where its alerts go; how they are sent there is a row of
/// [`WAYS_OUT`](crate::runtime::ways_out::WAYS_OUT).
pub trait Destination: Any + Debug + Send + Sync {
    /// The table of the config, by which the row is found.
    fn table(&self) -> &'static str;

    /// What logs and receipts call it; of all that a site has each has its own.
    fn name(&self) -> String;

    /// Whether it goes by the keys of alerts alone, whatever the order in which it gets them: the end of one reaches it after the beginning
    /// of another too.
    fn goes_by_keys(&self) -> bool {
        false
    }

    /// Whether it keeps alerts in memory alone, so that those in force are sent to it again and again.
    fn forgets(&self) -> bool {
        false
    }

    /// The files whose content it takes when it is set up.
    fn reads(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    /// What it needs and this machine does not have, for `check`.
    fn lacks(&self) -> Option<String> {
        None
    }
}

/// A destination, with which it can be compared.
#[derive(Debug, Clone)]
pub struct SharedDestination {
    to: Arc<dyn Destination>,
    is_same: fn(&dyn Any, &dyn Any) -> bool,
}

impl SharedDestination {
    /// Of any kind.
    pub fn new<T: Destination + PartialEq>(to: T) -> Self {
        Self {
            to: Arc::new(to),
            is_same: |one, other| {
                let both = one.downcast_ref::<T>().zip(other.downcast_ref::<T>());
                both.is_some_and(|(one, other)| one == other)
            },
        }
    }

    /// As the kind that it is; `None` as any other.
    pub fn of<T: Destination>(&self) -> Option<&T> {
        let any: &dyn Any = &*self.to;
        any.downcast_ref()
    }
}

impl Deref for SharedDestination {
    type Target = dyn Destination;

    fn deref(&self) -> &Self::Target {
        &*self.to
    }
}

impl PartialEq for SharedDestination {
    fn eq(&self, other: &Self) -> bool {
        (self.is_same)(&*self.to, &*other.to)
    }
}

impl Eq for SharedDestination {}

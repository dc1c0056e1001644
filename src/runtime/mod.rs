//! The thin shell around the monitor: clock, files, signals, hooks.

pub mod clock;
pub mod deliver;
pub mod delivered;
pub mod hook;
pub mod ingest;
pub mod journal;
pub mod shutdown;
pub mod tail;

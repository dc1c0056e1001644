//! The thin shell around the monitor: clock, files, signals, hooks.

pub mod clock;
pub mod ingest;

//! The thin shell around the monitor: clock, files, signals, hooks.

mod backlog;
pub mod clock;
pub mod deliver;
pub mod delivered;
pub mod event_log;
pub mod hook;
mod in_hand;
pub mod ingest;
pub mod journal;
pub mod log;
#[cfg(feature = "mqtt")]
pub mod mqtt;
pub mod replay;
pub mod run;
mod searches;
mod seen;
pub mod shutdown;
pub mod site;
pub mod tail;

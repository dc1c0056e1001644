//! The thin shell around the monitor: clock, files, signals, hooks.

mod backlog;
pub mod clock;
pub mod deliver;
pub mod delivered;
pub mod doctor;
pub mod event_log;
pub mod hook;
mod in_hand;
pub mod ingest;
pub mod journal;
pub mod log;
#[cfg(feature = "mqtt")]
pub mod mqtt;
pub mod pulse;
pub mod replay;
pub mod run;
pub mod sampling;
pub mod sandbox;
mod searches;
mod seen;
pub mod serve;
pub mod service;
pub mod shutdown;
pub mod site;
pub mod tail;
pub mod vitals;

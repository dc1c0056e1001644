//! The thin shell around the monitor: clock, files, signals, hooks.

mod archive;
pub mod clock;
pub mod daemon;
pub mod deliver;
pub mod delivered;
pub mod doctor;
pub mod hook;
mod in_hand;
pub mod ingest;
pub mod log;
pub mod mqtt;
pub mod preview;
pub mod pulse;
pub mod replay;
pub mod run;
pub mod sampling;
pub mod sandbox;
mod searches;
pub mod serve;
pub mod service;
pub mod shutdown;
pub mod site;
pub mod sources;
pub mod tail;
pub mod vitals;

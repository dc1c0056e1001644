//! The daemon, and what belongs to it: hooks, brokers, its page, the files of its deployment.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod browser;
mod cap;
mod certificates;
mod daemon;
mod deploy;
mod eventually;
mod follow;
mod hooks;
mod identity;
mod mqtt;
mod mqtt_out;
mod offered;
mod page;
mod retention;
mod sample_hooks;
mod sandbox;
mod serve;
mod service;
mod shown;
mod site;
mod ways_out;
mod webhooks;

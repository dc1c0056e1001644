//! The network that gives the chance of a collapse: its weights stand in learned.txt, written by
//! `cargo run --release -p studies --bin learn`.

use super::network::Network;
use std::sync::LazyLock;

/// The network in force.
pub(super) static LEARNED: LazyLock<Network> =
    LazyLock::new(|| Network::from_text(include_str!("learned.txt")));

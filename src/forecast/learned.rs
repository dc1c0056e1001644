//! The network that gives the chance of a collapse: its weights stand in learned.txt, written by
//! `cargo run --release -p studies --bin learn`. Of its eight networks four were trained before accelerations of fewer than six
//! readings and quiet times of more than ten times an acceleration were drawn, and four after. The older call no slopes of the kind, and
//! the newer err more on others; their mean, made by hand once, lies between (docs/families.md). `learn` writes four anew, alone.

use super::network::Network;
use std::sync::LazyLock;

/// The network in force.
pub(super) static LEARNED: LazyLock<Network> =
    LazyLock::new(|| Network::from_text(include_str!("learned.txt")));

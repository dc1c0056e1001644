//! The network that gives the chance of a collapse: its weights stand in learned.txt, written by
//! `cargo run --release -p studies --bin learn`. Of its eight networks four were taught before accelerations of fewer than six
//! readings and quiet times of more than ten times an acceleration were drawn, and four after: the mean of both errs less, on slopes
//! like those and on others, than either.

use super::network::Network;
use std::sync::LazyLock;

/// The network in force.
pub(super) static LEARNED: LazyLock<Network> =
    LazyLock::new(|| Network::from_text(include_str!("learned.txt")));

//! The only place that knows the time.
#![expect(
    clippy::disallowed_methods,
    reason = "the one module that may read the clock"
)]

use jiff::{SignedDuration, Timestamp};
use std::time::Duration;
use tokio::time::Instant;

/// So far ahead of the wall clock a measurement may be: clocks differ, days do not.
pub(crate) const TOLERANCE: SignedDuration = SignedDuration::from_hours(1);

/// The wall clock's time.
pub fn now() -> Timestamp {
    Timestamp::now()
}

/// A running stopwatch, for figures such as `seconds` in a fit's report. It runs on the runtime's own clock, which a
/// simulation moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stopwatch(Instant);

impl Stopwatch {
    /// Starts it.
    pub fn start() -> Self {
        Self(Instant::now())
    }

    /// The time since its start.
    pub fn elapsed(self) -> Duration {
        self.0.elapsed()
    }
}

/// The instant `delay` from now on the runtime's own clock, for waits.
pub(crate) fn later(delay: Duration) -> Instant {
    Instant::now() + delay
}

//! The true time, which tokio's clock has, and the host's, which may be wrong.

use jiff::{SignedDuration, Timestamp};
use std::cell::Cell;
use tokio::time::Instant;

thread_local! {
    static START: Cell<Option<Instant>> = const { Cell::new(None) };
    static WRONG_BY: Cell<SignedDuration> = const { Cell::new(SignedDuration::ZERO) };
}

/// The true time at the beginning of each life.
fn beginning() -> Timestamp {
    "2026-03-01T00:00:00Z".parse().unwrap()
}

/// A life begins, with a right clock.
pub(crate) fn begin() {
    START.set(Some(Instant::now()));
    WRONG_BY.set(SignedDuration::ZERO);
}

/// The true time.
pub(crate) fn truth() -> Timestamp {
    let passed = Instant::now() - START.get().unwrap_or_else(Instant::now);
    beginning() + SignedDuration::try_from(passed).unwrap()
}

/// What the host's clock says.
pub(crate) fn wall() -> Timestamp {
    truth() + WRONG_BY.get()
}

/// From now on the host's clock is wrong by so much.
pub(crate) fn set_wrong_by(span: SignedDuration) {
    WRONG_BY.set(span);
}

/// Writes the true time before a line of the log.
pub(crate) struct Truth;

impl tracing_subscriber::fmt::time::FormatTime for Truth {
    fn format_time(
        &self,
        writer: &mut tracing_subscriber::fmt::format::Writer<'_>,
    ) -> std::fmt::Result {
        write!(writer, "{}", truth())
    }
}

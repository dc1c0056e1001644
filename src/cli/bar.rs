//! How far a command has come, on stderr, for one who waits: hidden where that is no terminal.

use crate::reading::{Recording, Timestamp};
use indicatif::{ProgressBar, ProgressStyle};

/// Steps of a bar that shows a share.
const STEPS: u64 = 1000;

/// A bar of so many steps, drawn as `template` says.
pub(super) fn counted(length: u64, template: &str) -> ProgressBar {
    let bar = ProgressBar::new(length);
    let style = ProgressStyle::with_template(template).ok();
    style.map_or(bar.clone(), |style| bar.with_style(style))
}

/// A bar of the share that is done, for [`share`].
pub(super) fn shared() -> ProgressBar {
    counted(STEPS, "{bar:40} {percent} %, {elapsed}")
}

/// Moves the bar to a share of 0 to 1.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of a small constant"
)]
pub(super) fn share(bar: &ProgressBar, share: f64) {
    bar.set_position((share.clamp(0.0, 1.0) * STEPS as f64) as u64);
}

/// From now on it counts bytes, of which nobody knows how many there will be.
pub(super) fn of_bytes(bar: &ProgressBar) {
    if bar.length().is_some()
        && let Ok(style) = ProgressStyle::with_template("{bytes} written, {elapsed}")
    {
        bar.unset_length();
        bar.set_style(style);
    }
}

/// A bar of the time that a recording spans; it goes when it is dropped.
#[derive(Debug)]
pub(super) struct BarInTime {
    bar: ProgressBar,
    first: Timestamp,
    seconds: f64,
}

impl BarInTime {
    /// From the first reading to the last, or to `until`.
    pub(super) fn of(recording: &Recording, until: Option<Timestamp>) -> Self {
        let readings = || recording.series.iter().flat_map(|series| &series.readings);
        let first = readings().map(|reading| reading.time).min();
        let last = readings().map(|reading| reading.time).max();
        let first = first.unwrap_or_default();
        let last = until.into_iter().chain(last).min().unwrap_or(first);
        Self {
            bar: shared(),
            first,
            seconds: last.duration_since(first).as_secs_f64(),
        }
    }

    /// Moves it to `now`.
    pub(super) fn moved(&self, now: Timestamp) {
        if self.seconds > 0.0 {
            share(
                &self.bar,
                now.duration_since(self.first).as_secs_f64() / self.seconds,
            );
        }
    }
}

impl Drop for BarInTime {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

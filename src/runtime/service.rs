//! What the service manager is notified of: readiness, status, and that the work loop still turns.

use super::clock::Stopwatch;
use sd_notify::NotifyState;
use std::time::Duration;

/// The service manager, where one has started us; otherwise every call does nothing.
#[derive(Debug)]
pub struct Service {
    /// How often it expects a sign of life at least.
    watchdog: Option<Duration>,
    last_beat: Option<Stopwatch>,
    /// Whether anything is said at all.
    is_silent: bool,
}

impl Service {
    /// As the environment says: `NOTIFY_SOCKET`, `WATCHDOG_USEC`, `WATCHDOG_PID`.
    pub fn of_environment() -> Self {
        Self {
            watchdog: sd_notify::watchdog_enabled(),
            last_beat: None,
            is_silent: false,
        }
    }

    /// None: of what works beside the daemon the service manager is not notified.
    pub fn none() -> Self {
        Self {
            watchdog: None,
            last_beat: None,
            is_silent: true,
        }
    }

    fn notify(&self, state: &[NotifyState<'_>]) {
        if !self.is_silent {
            notify(state);
        }
    }

    /// The daemon is at work. Said at once, not only when the past has been read: that may take
    /// longer than a start may, and `/readyz` distinguishes the two.
    pub fn ready(&self, status: &str) {
        self.notify(&[NotifyState::Ready, NotifyState::Status(status)]);
    }

    /// One line for `systemctl status`.
    pub fn status(&self, status: &str) {
        self.notify(&[NotifyState::Status(status)]);
    }

    /// The config is being read again; [`Service::ready`] ends it.
    pub fn reloading(&self) {
        match NotifyState::monotonic_usec_now() {
            Ok(now) => self.notify(&[NotifyState::Reloading, now]),
            Err(_) => self.notify(&[NotifyState::Reloading]),
        }
    }

    /// The daemon is on its way out.
    pub fn stopping(&self) {
        self.notify(&[NotifyState::Stopping, NotifyState::Status("stopping")]);
    }

    /// The work loop has turned. Only the work loop calls this: a task of its own would go on
    /// while that hangs. Says so at most four times in the watchdog's interval.
    pub fn beat(&mut self) {
        let Some(watchdog) = self.watchdog else {
            return;
        };
        let is_due = |last: Stopwatch| last.elapsed() >= watchdog / 4;
        if self.last_beat.is_none_or(is_due) {
            self.notify(&[NotifyState::Watchdog]);
            self.last_beat = Some(Stopwatch::start());
        }
    }
}

fn notify(state: &[NotifyState<'_>]) {
    if let Err(error) = sd_notify::notify(state) {
        tracing::warn!(%error, ?state, "the service manager cannot be notified");
    }
}

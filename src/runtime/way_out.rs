//! What a way out for alerts is: what the rest of the program asks of it.

use super::hook::{Alert, HookOutcome};
use crate::config::{Destination, HookConfig};
use std::pin::Pin;
use std::sync::Arc;

/// An attempt that is under way.
pub type Run = Pin<Box<dyn Future<Output = HookOutcome> + Send>>;

/// What sends alerts in force again, which is no attempt to deliver them.
pub type Repeat = fn(Arc<HookConfig>, Vec<Alert>) -> Run;

/// A way by which alerts get out; each stands in the file of its sender, and has a row in
/// [`WAYS_OUT`](super::ways_out::WAYS_OUT). What the config says of it is a [`Destination`], whose keys are read by a row of
/// `config/hook.rs`.
#[derive(Debug)]
pub struct WayOut {
    /// Its table of the config.
    pub table: &'static str,
    /// Makes one attempt. It ends in the hook's timeout, and logs how it ended.
    pub send: fn(DeliveryAttempt) -> Run,
    /// Sends alerts in force again to a destination that forgets them; it logs where that fails.
    pub repeat: Option<Repeat>,
    /// Whether an attempt could be made on this machine, for `doctor`; none is.
    pub ready: fn(&HookConfig) -> Result<String, String>,
}

/// One attempt to get one alert out.
#[derive(Debug, Clone)]
pub struct DeliveryAttempt {
    /// Where to.
    pub hook: Arc<HookConfig>,
    /// What.
    pub alert: Alert,
    /// Counts from 1.
    pub attempt: u32,
}

impl DeliveryAttempt {
    /// Where to, as the kind that this way out knows.
    ///
    /// # Errors
    /// The outcome where it is of another kind.
    pub fn to<T: Destination>(&self) -> Result<&T, HookOutcome> {
        destination(&self.hook).map_err(HookOutcome::NotStarted)
    }
}

/// Where the hook's alerts go, as the kind that a way out knows.
///
/// # Errors
/// That it is of another kind.
pub fn destination<T: Destination>(hook: &HookConfig) -> Result<&T, String> {
    let to = hook.to.as_ref().and_then(|to| to.of());
    to.ok_or_else(|| format!("[[{}]] is of another kind", hook.table()))
}

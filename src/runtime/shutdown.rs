//! The request to stop, handed down as an argument.

use nix::sys::signal::Signal;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;

/// Whoever holds this can ask for the stop; dropping it asks as well.
#[derive(Debug)]
pub struct Trigger(watch::Sender<bool>);

/// Whoever holds this learns of the request.
#[derive(Debug, Clone)]
pub struct Shutdown(watch::Receiver<bool>);

/// A request not yet made, and its two ends.
pub fn pair() -> (Trigger, Shutdown) {
    let (sender, receiver) = watch::channel(false);
    (Trigger(sender), Shutdown(receiver))
}

impl Trigger {
    /// Asks for the stop.
    pub fn request(&self) {
        self.0.send_replace(true);
    }
}

impl Shutdown {
    /// Ends when the stop is asked for.
    pub async fn requested(&mut self) {
        // An error means that the trigger is gone: nobody is left who could ask.
        let _ = self.0.wait_for(|asked| *asked).await;
    }

    /// Whether it has been asked for.
    pub fn is_requested(&self) -> bool {
        *self.0.borrow() || self.0.has_changed().is_err()
    }

    /// The request that SIGTERM and SIGINT make; needs a tokio runtime.
    ///
    /// # Errors
    /// When the signals cannot be listened for.
    pub fn on_signals() -> std::io::Result<Self> {
        let mut terminate = signal(SignalKind::terminate())?;
        let mut interrupt = signal(SignalKind::interrupt())?;
        let (trigger, shutdown) = pair();
        tokio::spawn(async move {
            let name = tokio::select! {
                _ = terminate.recv() => "SIGTERM",
                _ = interrupt.recv() => "SIGINT",
            };
            tracing::info!(signal = name, "stopping");
            trigger.request();
        });
        Ok(shutdown)
    }
}

/// From now on a file at its longest is an error of the write, not the end of the process.
///
/// # Errors
/// When the signal cannot be listened for.
pub(super) fn survive_the_file_limit() -> std::io::Result<()> {
    // The handler stays when its listener goes.
    signal(SignalKind::from_raw(Signal::SIGXFSZ as i32)).map(drop)
}

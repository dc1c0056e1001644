//! What keeps the state in order while the daemon works.

use super::Daemon;
use crate::store::StoreError;

impl Daemon {
    /// On a full disk it waits, as everything does.
    pub(super) fn thin(&self) -> Result<(), StoreError> {
        match self.site.thin(self.config.site.keep_refits) {
            Err(error) if !error.is_full() => Err(error),
            Ok(_) | Err(_) => Ok(()),
        }
    }

    /// Keeps how much could not be used, for those who ask the state; on a full disk the next time does.
    pub(super) fn note_quarantined(&mut self) -> Result<(), StoreError> {
        let counts = self.pulse.vitals.health().quarantined;
        if counts == self.quarantined {
            return Ok(());
        }
        match self.store.note_quarantined(&counts) {
            Ok(()) => {
                self.quarantined = counts;
                Ok(())
            }
            Err(error) if error.is_full() => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Looks at a few more rows of the state. Where one is damaged the work goes on, and people are to see to it.
    pub(super) fn verify(&mut self) {
        let is_damaged = self.pulse.vitals.health().is_store_damaged;
        if let Err(error) = self.store.verify(&mut self.verified)
            && !is_damaged
        {
            tracing::error!(%error, "the state on the disk has changed by itself");
            self.pulse
                .vitals
                .update(|health| health.is_store_damaged = true);
        }
    }
}

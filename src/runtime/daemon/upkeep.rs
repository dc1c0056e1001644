//! What keeps the state in order while the daemon works.

use super::Daemon;
use crate::alert::Level;
use crate::runtime::restored;
use crate::runtime::service_faults::{self, FaultPlace};
use crate::store::StoreError;

/// Benchmarks that a text names.
const MOST_NAMED: usize = 10;

impl Daemon {
    /// On a full disk it waits, as everything does.
    pub(super) fn thin(&self) -> Result<(), StoreError> {
        match self.site.thin(self.config.site.keep_refits) {
            Err(error) if !error.is_full() => Err(error),
            Ok(_) | Err(_) => Ok(()),
        }
    }

    /// Keeps how much of the sources could not be used, for those who ask the state, and which brokers hold a session; on a full disk the next
    /// time does.
    pub(super) fn note_sources(&mut self) -> Result<(), StoreError> {
        let noted = self.note_quarantined();
        let noted = noted.and_then(|()| self.sources.note_sessions(&self.store));
        match noted {
            Err(error) if !error.is_full() => Err(error),
            Ok(()) | Err(_) => Ok(()),
        }
    }

    /// Where the state was put back from a backup, reports it, once.
    pub(in crate::runtime) fn note_restored(&mut self, is_so: bool) -> Result<(), StoreError> {
        if !is_so {
            return Ok(());
        }
        self.report("state-restored", restored::TEXT.to_owned())?;
        self.store.clear_copy_mark()
    }

    fn note_quarantined(&mut self) -> Result<(), StoreError> {
        let counts = self.reporting.vitals.health().quarantined;
        if counts != self.quarantined {
            self.store.note_quarantined(&counts)?;
            self.quarantined = counts;
        }
        Ok(())
    }

    /// Keeps what lasts and keeps it from its work, for those who ask the state.
    pub(super) fn keep_faults(&mut self) {
        let faults = self.reporting.vitals.faults().shown();
        if self.faults.as_ref() == Some(&faults) {
            return;
        }
        match service_faults::write(&self.config.site.state_dir, &faults) {
            Ok(()) => self.faults = Some(faults),
            Err(error) => {
                tracing::debug!(%error, "faults are not kept for slipwatch status");
            }
        }
    }

    /// After a commit: whether the state holds all that is known.
    pub(super) fn note_state(
        &self,
        error: Option<&StoreError>,
        is_waiting: bool,
        is_in_place: bool,
    ) {
        let faults = self.reporting.vitals.faults();
        let why = match error {
            Some(error) => error.to_string(),
            None if is_waiting => "there is no room on the disk".to_owned(),
            None if !is_in_place => "its folder or its files are gone".to_owned(),
            None => return faults.end_fault(&FaultPlace::of_state()),
        };
        let levels = self.levels_in_memory();
        let text = format!(
            "the state cannot be written ({why}): what comes waits unacknowledged, alerts go out from memory; in force there: {levels}"
        );
        faults.begin_fault(FaultPlace::of_state(), &text);
    }

    /// Where orange or red is in force.
    fn levels_in_memory(&self) -> String {
        let points = self.reporting.vitals.points();
        let severe = points.iter().filter(|(_, one)| one.level >= Level::Orange);
        let named: Vec<String> = (severe.take(MOST_NAMED))
            .map(|(id, one)| format!("{id} {}", one.level.name()))
            .collect();
        if named.is_empty() {
            "no orange or red".to_owned()
        } else {
            named.join(", ")
        }
    }

    /// Looks at a few more rows of the state. Where one is damaged the work goes on, and people are to see to it.
    pub(super) fn verify(&mut self) {
        let is_damaged = self.reporting.vitals.health().is_store_damaged;
        if let Err(error) = self.store.verify(&mut self.verified)
            && !is_damaged
        {
            tracing::error!(%error, "the state on the disk is damaged");
            self.reporting
                .vitals
                .update(|health| health.is_store_damaged = true);
        }
    }
}

//! What the state lacks while it cannot be written: alerts that were called since then are known to the daemon alone.

use crate::config::Config;
use crate::runtime::service_faults::{ServiceFaultKind, faults_in};
use crate::store::Store;

/// What the running daemon says of a state that it cannot write, and what follows for those who ask the state.
pub(super) fn fault(config: &Config) -> Option<String> {
    let state_dir = &config.site.state_dir;
    if !Store::is_held(state_dir) {
        return None;
    }
    let mut faults = faults_in(state_dir).into_iter();
    let fault = faults.find(|one| one.kind == ServiceFaultKind::StateUnwritable)?;
    Some(format!(
        "the daemon cannot write the state, so alerts since {} are not in it and no order can be left: {}",
        fault.since, fault.text
    ))
}

/// `error`, or what stands behind it where the state cannot be written.
pub(super) fn explained(config: &Config, error: anyhow::Error) -> anyhow::Error {
    match fault(config) {
        Some(fault) => anyhow::anyhow!(fault),
        None => error,
    }
}

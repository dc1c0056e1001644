//! Drives the monitor's panel over the readings in their order, so that a fit forecasts what it would.

use crate::fit::Observations;
use crate::forecast::{Outlook, Panel};

/// Up to this many readings the panel sees each as the monitor would.
const FEED_EACH: usize = 400;
/// Beyond that, the updates before each forecast that is wanted: four memories of a member's score.
const FEED_NEWEST: usize = 48;

/// What the panel says after each of `counts` readings (increasing), from the first reading on.
pub(super) fn outlooks(
    mut panel: Panel,
    observations: &Observations,
    critical: f64,
    counts: &[usize],
) -> Vec<Option<Outlook>> {
    let most = counts.last().copied().unwrap_or(0);
    let fed = |count: usize| {
        let next_wanted = counts.iter().find(|wanted| **wanted >= count);
        most <= FEED_EACH
            || counts.contains(&count)
            || (most - count < FEED_NEWEST && next_wanted.is_some())
    };
    let mut known = Observations {
        values: Vec::with_capacity(most),
        ..observations.clone()
    };
    let mut said = Vec::new();
    for (index, value) in observations.values.iter().take(most).enumerate() {
        known.values.push(*value);
        let count = index + 1;
        if !fed(count) {
            continue;
        }
        let outlook = panel.update(&known, critical);
        for _ in counts.iter().filter(|wanted| **wanted == count) {
            said.push(outlook.clone());
        }
    }
    said.resize(counts.len(), None);
    said
}

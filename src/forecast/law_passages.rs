//! When the law passes a critical velocity, where the slope measurably moves.

use crate::fit::{LoadPosterior, Rate};

/// How far the forecast looks, days.
pub const HORIZON_DAYS: f64 = 400.0;
/// The law's passages are followed so far, days.
const FARTHEST_DAYS: f64 = 10.0 * HORIZON_DAYS;
/// A slope at 50 m/day has failed by any account, mm/day.
const FASTEST_CRITICAL: f64 = 5e4;

/// (days from `now_days`, probability) of passing `critical` mm/day by the law; none where the slope does not
/// measurably move.
pub(super) fn passages(
    rates: &[Rate],
    posterior: Option<&LoadPosterior>,
    critical: f64,
    now_days: f64,
) -> Vec<(f64, f64)> {
    let Some(posterior) = posterior.filter(|_| measurably_moves(rates)) else {
        return Vec::new();
    };
    let later = now_days - posterior.now_days;
    let critical = critical.min(FASTEST_CRITICAL);
    let mut law = posterior.passages(critical, FARTHEST_DAYS + later);
    for (days, _) in &mut law {
        *days = (*days - later).max(0.0);
    }
    law
}

/// Whether any of the newest rates stands clear of its noise: where none does, a forecast would be the
/// prior's and not the slope's.
pub(crate) fn measurably_moves(rates: &[Rate]) -> bool {
    let newest = &rates[rates.len().saturating_sub(6)..];
    newest
        .iter()
        .any(|rate| rate.velocity > 3.0 * rate.sigma && rate.velocity > 0.0)
}

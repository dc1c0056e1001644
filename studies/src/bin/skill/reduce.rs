//! What many forecasts come to: quantiles, counts, horizons.

/// The middle of the values, infinite ones among them; `None` without any.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    let lower = values[(values.len() - 1) / 2];
    // Of two infinities the midpoint is one; of one, the value that is finite would hide it.
    Some(f64::midpoint(lower, upper))
}

/// How many of the values, 0 to 1, lie in each tenth.
pub(crate) fn tenths(values: impl Iterator<Item = f64>) -> [u32; 10] {
    let mut counts = [0; 10];
    for value in values {
        let tenth = (1..10).filter(|edge| value >= 0.1 * f64::from(*edge));
        counts[tenth.count()] += 1;
    }
    counts
}

/// The longest lead from which on every shorter one was near; 0 where the last one was not. (lead, near), in any
/// order.
pub(crate) fn prognostic_horizon(mut leads: Vec<(f64, bool)>) -> f64 {
    leads.sort_by(|one, other| one.0.total_cmp(&other.0));
    let near = leads.into_iter().take_while(|(_, is_near)| *is_near);
    near.last().map_or(0.0, |(lead, _)| lead)
}

/// The Brier score of one forecast.
pub(crate) fn brier(chance: f64, came: bool) -> f64 {
    let miss = chance - f64::from(u8::from(came));
    miss * miss
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these figures are exact")]
mod tests {
    use super::*;

    #[test]
    fn a_median_knows_forecasts_of_never() {
        assert_eq!(median(vec![]), None);
        assert_eq!(median(vec![3.0, 1.0]), Some(2.0));
        assert_eq!(median(vec![f64::INFINITY, 1.0, 2.0]), Some(2.0));
        let mostly = vec![f64::INFINITY, 1.0, f64::INFINITY];
        assert_eq!(median(mostly), Some(f64::INFINITY));
    }

    #[test]
    fn tenths_hold_their_lower_edge_and_the_last_one_its_end() {
        let counts = tenths([0.0, 0.05, 0.1, 0.55, 0.95, 1.0].into_iter());
        assert_eq!(counts, [2, 1, 0, 0, 0, 1, 0, 0, 0, 2]);
    }

    #[test]
    fn a_horizon_ends_at_the_first_lead_that_is_missed_from_the_failure_back() {
        let leads = |near: [bool; 4]| [40.0, 20.0, 10.0, 5.0].into_iter().zip(near).collect();
        assert_eq!(prognostic_horizon(leads([true, false, true, true])), 10.0);
        assert_eq!(prognostic_horizon(leads([true; 4])), 40.0);
        assert_eq!(prognostic_horizon(leads([true, true, true, false])), 0.0);
        assert_eq!(prognostic_horizon(Vec::new()), 0.0);
    }

    #[test]
    fn the_brier_score_of_a_fair_coin_is_a_quarter_either_way() {
        assert_eq!(brier(0.5, true), 0.25);
        assert_eq!(brier(0.5, false), 0.25);
        assert_eq!(brier(1.0, true), 0.0);
        assert_eq!(brier(1.0, false), 1.0);
    }
}

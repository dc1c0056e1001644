//! The inverse-velocity line where a river at the foot drives the slope too, as at La Clapière: readings weighted by
//! the flow (Vibert et al. 1988), or the river's share taken out of the velocity first (Rat 1988, "Difficulties
//! in foreseeing failure in landslides: La Clapière, French Alps", Proc. 5th Int. Symp. Landslides, Lausanne,
//! vol. 3, 1503-1504).
//!
//! We have seen neither formula. Ours: a velocity weighs q/(q + flow), q the median flow, so that what
//! moved at low water, by itself, counts most; and the share is a multiple of the flow's departure from its mean, by
//! least squares of the changes from velocity to velocity, in which a trend all but vanishes.

use super::straight::line_through;
use super::{line, moves, point, rates};
use crate::fit::Rate;
use crate::forecast::{InverseVelocityLine, Passage};
use crate::reading::upper_median;
use crate::score::Known;

/// The line weighted by the flow; `None` where no river is known.
pub(in crate::score) fn weighted_line(known: &Known) -> Option<Passage> {
    let beside = beside(known);
    let mut flows: Vec<f64> = beside.iter().map(|(_, flow)| *flow).collect();
    let median = upper_median(&mut flows)?;
    let points: Vec<(f64, f64, f64)> = beside
        .iter()
        .filter(|(rate, _)| moves(rate))
        .map(|(rate, flow)| (rate.middle(), 1.0 / rate.velocity, weight(*flow, median)))
        .collect();
    let line = line_through(&points)?;
    if line.slope() >= 0.0 {
        return Some(Passage::default());
    }
    point(line.reaches(0.0) - known.now_days)
}

/// The line through the velocity without the river's share; `None` where no river is known.
pub(in crate::score) fn removed_line(known: &Known) -> Option<Passage> {
    let beside = beside(known);
    let mean = beside.iter().map(|(_, flow)| flow).sum::<f64>() / beside.len() as f64;
    let share = share(&beside);
    let left: Vec<Rate> = beside
        .iter()
        .map(|(rate, flow)| Rate {
            velocity: rate.velocity - share * (flow - mean),
            ..*rate
        })
        .collect();
    line::meets_zero(InverseVelocityLine::fit(&left)?, known)
}

/// From 1 in a dry bed to 0 in an endless flood.
fn weight(flow: f64, median: f64) -> f64 {
    let (flow, median) = (flow.max(0.0), median.max(f64::MIN_POSITIVE));
    median / (median + flow)
}

/// mm/day for each unit of flow, not negative: a river that holds a slope back has no share in its motion.
fn share(beside: &[(Rate, f64)]) -> f64 {
    let changes: Vec<(f64, f64, f64)> = beside
        .windows(2)
        .map(|pair| {
            let [(before, flow_before), (after, flow_after)] = [pair[0], pair[1]];
            (
                flow_after - flow_before,
                after.velocity - before.velocity,
                1.0,
            )
        })
        .collect();
    line_through(&changes).map_or(0.0, |line| line.slope().max(0.0))
}

/// Every rate with the mean flow during it, or the newest before where none was read within; without the
/// rates that are older than the first flow.
fn beside(known: &Known) -> Vec<(Rate, f64)> {
    let flow = &known.flow;
    let until = |days: f64| flow.partition_point(|(at, _)| *at <= days);
    let of = |rate: &Rate| {
        let (from, to) = (until(rate.from), until(rate.to));
        let within = &flow[from.min(to.checked_sub(1)?)..to];
        Some(within.iter().map(|(_, value)| value).sum::<f64>() / within.len() as f64)
    };
    rates(known)
        .into_iter()
        .filter_map(|rate| Some((rate, of(&rate)?)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::drawn::{never, velocities, when};
    use super::*;

    fn flow(t: f64) -> f64 {
        10.0 + 8.0 * (t / 3.0).sin()
    }

    /// Fails on day 120, with floods that add to its velocity.
    fn with_river(share: f64) -> Known {
        let velocity = |t: f64| 800.0 / (120.0 - t) + share * (flow(t) - 10.0);
        let mut known = velocities(1.0, 90.0, velocity);
        known.flow = (0..=90)
            .map(|day| (f64::from(day), flow(f64::from(day))))
            .collect();
        known
    }

    #[test]
    fn the_line_is_found_when_the_rivers_share_is_removed_from_the_velocity() {
        let known = with_river(0.7);
        let removed = when(&known, removed_line(&known).as_ref());
        assert!((removed - 120.0).abs() < 1.5, "{removed}");
        let raw = when(&known, line::raw(&known).as_ref());
        assert!((raw - 120.0).abs() > 3.0 * (removed - 120.0).abs(), "{raw}");
    }

    #[test]
    fn floods_count_less_in_the_weighted_line() {
        let known = with_river(0.0);
        assert!((when(&known, weighted_line(&known).as_ref()) - 120.0).abs() < 1e-6);
        assert!(weight(100.0, 10.0) < 0.2 * weight(1.0, 10.0));
    }

    #[test]
    fn without_a_river_or_with_a_short_record_they_say_nothing_and_a_slowing_slope_never_fails() {
        let mut known = velocities(1.0, 30.0, |t| 50.0 / (1.0 + t));
        for forecast in [weighted_line, removed_line] {
            assert_eq!(forecast(&known), None);
        }
        known.flow = vec![(0.0, 3.0), (10.0, 4.0), (20.0, 3.0)];
        for forecast in [weighted_line, removed_line] {
            assert!(never(forecast(&known).as_ref()));
        }
        known.observations.values.truncate(3);
        for forecast in [weighted_line, removed_line] {
            assert_eq!(forecast(&known), None);
        }
    }
}

//! Sentences for people on where a covariate and the velocity part ways, and on what may be slip.

use super::explanation::{Effect, Explanation};
use super::kind::Kind;
use crate::reading::{Channel, Quantity, Sample, Series, Timestamp, days_since};
use jiff::SignedDuration;

/// A turn counts when the covariate swings this share of its range after it.
const SWING: f64 = 0.15;
/// A swing whose ups and downs together are longer than this many times itself is none.
const LONGEST_PATH: f64 = 1.5;
/// Fewest velocities on either side of the turn.
const FEWEST: usize = 5;
/// Rank correlation from which two courses go the same way.
const SAME_WAY: f64 = 0.6;
/// The velocity goes on by this factor at least after the turn.
const CLEAR: f64 = 1.25;
/// Rates over a displacement are taken over at least this share of the record.
const RATE_SHARE: f64 = 1.0 / 80.0;
/// A day that begins up to so many hours before midnight UTC is meant to begin there.
const DAY_BEGINS_BEFORE: i64 = 3;

/// What a person should know of `channels` beside `series`: a sentence for each whose last sustained turn the
/// velocity did not follow, though it had gone the same way before. Nothing on what caused what.
pub fn of_channels(series: &Series, channels: &[Channel]) -> Vec<String> {
    let velocities = velocities(series);
    channels
        .iter()
        .filter_map(|channel| parting(&velocities, channel))
        .collect()
}

/// Jumps of the reading along the motion that do not come back, with their sizes: slip of the slope looks the same.
fn forward_jumps<'a>(
    effects: impl Iterator<Item = &'a Effect> + Clone,
) -> impl Iterator<Item = (&'a Effect, f64)> {
    let jumps = effects.filter(|one| one.effect == Kind::OFFSET);
    let sizes: Vec<f64> = jumps.clone().filter_map(|one| one.size).collect();
    let comes_back = move |of: f64| sizes.iter().any(|size| *size < -0.5 * of);
    jumps.filter_map(move |one| {
        let size = one.size.filter(|size| *size > 0.0 && !comes_back(*size))?;
        Some((one, size))
    })
}

/// Whether one of the effects may be slip of the slope as well as of the reading.
pub fn may_be_slip(explanation: &Explanation) -> bool {
    let found = std::iter::once(&explanation.verdict).chain(&explanation.also);
    forward_jumps(found).next().is_some()
}

/// What a person should know of jumps of the reading along the motion that do not come back.
pub(super) fn of_forward_jumps<'a>(
    effects: impl Iterator<Item = &'a Effect> + Clone,
) -> Vec<String> {
    let said = forward_jumps(effects).filter_map(|(one, size)| {
        Some(format!(
            "The offset of {} {} at {} is along the motion: slip of the slope within that time looks the same. A point beside it, or \
             the instrument, shows which it was.",
            figure(size),
            one.unit.as_deref().unwrap_or_default(),
            one.at?
        ))
    });
    said.collect()
}

/// When, and mm/day.
type TimedVelocities = Vec<(Timestamp, f64)>;

fn velocities(series: &Series) -> TimedVelocities {
    let factor = series.unit.factor();
    let values = series
        .readings
        .iter()
        .map(|one| (one.time, factor * one.value));
    if series.quantity() == Quantity::Velocity {
        return values.collect();
    }
    let (Some(first), Some(last)) = (series.readings.first(), series.readings.last()) else {
        return Vec::new();
    };
    let least = RATE_SHARE * days_since(first.time, last.time);
    let mut rates = TimedVelocities::new();
    let mut before = (first.time, factor * first.value);
    for (time, slip) in values.skip(1) {
        let days = days_since(before.0, time);
        if days >= least {
            rates.push((time, (slip - before.1) / days));
            before = (time, slip);
        }
    }
    rates
}

/// The sentence for one channel, where there is one to say.
fn parting(velocities: &TimedVelocities, channel: &Channel) -> Option<String> {
    let (first, last) = (velocities.first()?.0, velocities.last()?.0);
    let samples: Vec<Sample> = channel
        .samples
        .iter()
        .copied()
        .filter(|sample| sample.time >= first && sample.time <= last)
        .collect();
    let turn = last_turn(&samples)?;
    let (start, at, until) = (samples[turn.start], samples[turn.at], samples[turn.until]);
    let swing = until.value - at.value;
    let side = |from: Timestamp, to: Timestamp| -> Vec<(f64, f64)> {
        let inside = velocities.iter().filter(|one| one.0 >= from && one.0 <= to);
        inside
            .filter_map(|one| Some((channel_at(&samples, one.0)?, one.1)))
            .collect()
    };
    let before = side(start.time, at.time);
    let after = side(at.time, until.time);
    if before.len() < FEWEST || after.len() < FEWEST {
        return None;
    }
    let goes_on = |pairs: &[(f64, f64)]| rank_correlation(pairs);
    let times: Vec<(f64, f64)> = after
        .iter()
        .enumerate()
        .map(|(index, one)| (index as f64, one.1))
        .collect();
    let way = -swing.signum();
    let (from, to) = (after[0].1, after[after.len() - 1].1);
    let against = if way > 0.0 { to / from } else { from / to };
    let is_clear = from > 0.0
        && to > 0.0
        && against >= CLEAR
        && (to - from).abs() > 4.0 * noise(velocities, (at.time, until.time));
    let parted = goes_on(&before) >= SAME_WAY && goes_on(&times) * way >= SAME_WAY && is_clear;
    if !parted {
        return None;
    }
    let (turns, runs, load, does) = if swing < 0.0 {
        ("falls", "rises", "falling", "slow this slope")
    } else {
        ("rises", "falls", "rising", "speed this slope up")
    };
    let unit = channel
        .unit
        .as_ref()
        .map_or(String::new(), |unit| format!(" {unit}"));
    Some(format!(
        "{} {turns} from {} (by {:.1}{unit} until {}) and the velocity still {runs}, from {} to {} mm/day: a {load} load does not {does}.",
        channel.name,
        date(at.time),
        swing.abs(),
        date(until.time),
        figure(from),
        figure(to),
    ))
}

/// Places among samples: where the run before the turn begins, the turn, and where the swing ends.
#[derive(Debug, PartialEq)]
struct TurningPoint {
    start: usize,
    at: usize,
    until: usize,
}

/// The last turn after which the values swing by [`SWING`] of their range, without turning back by as much.
fn last_turn(samples: &[Sample]) -> Option<TurningPoint> {
    let low = samples
        .iter()
        .map(|one| one.value)
        .fold(f64::INFINITY, f64::min);
    let high = samples
        .iter()
        .map(|one| one.value)
        .fold(f64::NEG_INFINITY, f64::max);
    let least = SWING * (high - low);
    if samples.len() < 2 * FEWEST || !least.is_normal() {
        return None;
    }
    let mut turns = vec![0];
    let (mut top, mut bottom) = (0, 0);
    let mut way = 0.0;
    for (index, one) in samples.iter().enumerate() {
        if one.value >= samples[top].value {
            top = index;
        }
        if one.value <= samples[bottom].value {
            bottom = index;
        }
        if way >= 0.0 && samples[top].value - one.value >= least {
            turns.push(top);
            way = -1.0;
            bottom = index;
        } else if way <= 0.0 && one.value - samples[bottom].value >= least {
            turns.push(bottom);
            way = 1.0;
            top = index;
        }
    }
    let at = *turns.last()?;
    let start = turns[turns.len().checked_sub(2)?];
    let until = if way > 0.0 { top } else { bottom };
    let swing = (samples[until].value - samples[at].value).abs();
    let path: f64 = samples[at..=until]
        .windows(2)
        .map(|two| (two[1].value - two[0].value).abs())
        .sum();
    (path <= LONGEST_PATH * swing).then_some(TurningPoint { start, at, until })
}

fn channel_at(samples: &[Sample], time: Timestamp) -> Option<f64> {
    let after = samples.partition_point(|one| one.time < time);
    let later = samples.get(after)?;
    if later.time == time {
        return Some(later.value);
    }
    let earlier = samples.get(after.checked_sub(1)?)?;
    let share = days_since(earlier.time, time) / days_since(earlier.time, later.time);
    Some(earlier.value + share * (later.value - earlier.value))
}

/// Scatter of a velocity about its neighbours' line, between two times, mm/day.
fn noise(velocities: &TimedVelocities, (from, to): (Timestamp, Timestamp)) -> f64 {
    let inside: Vec<f64> = velocities
        .iter()
        .filter(|one| one.0 >= from && one.0 <= to)
        .map(|one| one.1)
        .collect();
    let bends: Vec<f64> = inside
        .windows(3)
        .map(|three| three[1] - f64::midpoint(three[0], three[2]))
        .collect();
    let squares: f64 = bends.iter().map(|bend| bend * bend).sum();
    // The bend of three equal errors has 1.5 times their variance.
    (squares / (1.5 * (bends.len() as f64).max(1.0))).sqrt()
}

/// Kendall's: the share of pairs in order, less the share out of it.
fn rank_correlation(pairs: &[(f64, f64)]) -> f64 {
    let each = pairs
        .iter()
        .enumerate()
        .flat_map(|(index, one)| pairs[..index].iter().map(move |other| (one, other)));
    let order = each.map(|(one, other)| {
        ((one.0 - other.0) * (one.1 - other.1))
            .partial_cmp(&0.0)
            .map_or(0.0, |sign| f64::from(sign as i8))
    });
    let (sum, count) = order.fold((0.0, 0.0), |(sum, count), one| (sum + one, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

fn date(time: Timestamp) -> String {
    let shifted = time
        .checked_add(SignedDuration::from_hours(DAY_BEGINS_BEFORE))
        .unwrap_or(time);
    shifted.strftime("%Y-%m-%d").to_string()
}

fn figure(velocity: f64) -> String {
    if velocity.abs() >= 10.0 {
        format!("{velocity:.0}")
    } else {
        format!("{velocity:.2}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(values: &[f64]) -> Vec<Sample> {
        let time =
            |day: usize| Timestamp::from_second(i64::try_from(day).unwrap() * 86_400).unwrap();
        values
            .iter()
            .enumerate()
            .map(|(day, value)| Sample {
                time: time(day),
                value: *value,
            })
            .collect()
    }

    #[test]
    fn the_last_turn_is_that_after_which_the_values_swing_by_enough() {
        let rising_then_falling: Vec<f64> = (0..20)
            .map(|day| 10.0 - f64::from(14_i32 - day).abs())
            .collect();
        let turn = last_turn(&samples(&rising_then_falling)).unwrap();
        assert_eq!(
            turn,
            TurningPoint {
                start: 0,
                at: 14,
                until: 19
            }
        );
        let rising: Vec<f64> = (0..20).map(f64::from).collect();
        assert!(last_turn(&samples(&rising)).is_none_or(|turn| turn.at == 0));
    }

    #[test]
    fn what_goes_up_and_down_all_the_way_has_no_turn() {
        let spikes: Vec<f64> = (0..40).map(|day| f64::from(day * 17 % 5)).collect();
        let turn = last_turn(&samples(&spikes));
        assert!(turn.is_none_or(|turn| turn.until - turn.at < FEWEST));
    }

    #[test]
    fn a_jump_along_the_motion_that_does_not_come_back_may_be_slip() {
        let jump = |size: f64| Effect {
            at: Some("2014-02-15T00:00:00Z".parse().unwrap()),
            size: Some(size),
            unit: Some("mm".to_owned()),
            ..Effect::of(Kind::OFFSET)
        };
        let said = |effects: &[Effect]| of_forward_jumps(effects.iter());
        assert_eq!(said(&[jump(235.0)]).len(), 1);
        assert!(said(&[jump(235.0), jump(-230.0)]).is_empty());
        assert!(said(&[jump(-36.0), Effect::of(Kind::STATE_RESET)]).is_empty());
    }

    #[test]
    fn a_day_that_begins_an_hour_before_midnight_utc_keeps_its_date() {
        assert_eq!(date("1963-09-25T23:00:00Z".parse().unwrap()), "1963-09-26");
        assert_eq!(date("1963-09-25T12:00:00Z".parse().unwrap()), "1963-09-25");
    }
}

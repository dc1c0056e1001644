//! Readings taken in sessions: some rounds within minutes, then none for much longer, as total stations and GNSS campaigns give.
//!
//! The rounds of a session show the instrument's scatter and no motion; what a session says of the slope is their mean. Without that the
//! sampling interval would be the minutes between two rounds, and each pause between two sessions a silence.

use crate::fit::Observation;
use std::borrow::Cow;

/// Newest spans between readings that say how a slope is sampled.
pub(super) const SPANS: usize = 256;
/// Fewest sessions.
const FEWEST_SESSIONS: usize = 6;
/// Most rounds of a session: more of them, as in working hours, show motion.
const MOST_ROUNDS: usize = 16;
/// A session lasts no longer than this share of a pause.
const LASTS: f64 = 0.125;
/// The newest session, which may be going on, has at most so many times the rounds of the largest one before, and lasts at most so many
/// times as long as the longest: a slope that is read more often from now on is not in a session.
const AS_BEFORE: u32 = 2;

/// How sessions show among readings.
#[derive(Debug, Clone, Copy)]
struct SessionPattern {
    /// Spans of so many days or more part two sessions: longer than that between two rounds and shorter than a pause.
    least_pause: f64,
    /// So many days a session lasts at most.
    longest: f64,
}

/// The means of the sessions, oldest first; the readings as they are where they were not taken in sessions.
pub(super) fn merged(values: &[Observation]) -> Cow<'_, [Observation]> {
    let Some(pattern) = pattern(values) else {
        return Cow::Borrowed(values);
    };
    let groups = values.chunk_by(|a, b| b.t_days - a.t_days < pattern.least_pause);
    let mut means = Vec::with_capacity(values.len());
    let (mut most_rounds, mut longest) = (1, 0.0_f64);
    let mut groups = groups.peekable();
    while let Some(group) = groups.next() {
        let lasted = group[group.len() - 1].t_days - group[0].t_days;
        let is_as_before = group.len() <= AS_BEFORE as usize * most_rounds
            && lasted <= f64::from(AS_BEFORE) * longest;
        let is_usual = groups.peek().is_some() || group.len() == 1 || is_as_before;
        if group.len() <= MOST_ROUNDS && lasted <= pattern.longest && is_usual {
            (most_rounds, longest) = (most_rounds.max(group.len()), longest.max(lasted));
            means.push(mean(group));
        } else {
            means.extend_from_slice(group);
        }
    }
    Cow::Owned(means)
}

fn pattern(values: &[Observation]) -> Option<SessionPattern> {
    let newest = &values[values.len().saturating_sub(SPANS + 1)..];
    let spans = newest
        .windows(2)
        .map(|pair| pair[1].t_days - pair[0].t_days);
    let mut spans: Vec<f64> = spans.collect();
    spans.sort_unstable_by(f64::total_cmp);
    let ratios = spans.windows(2).map(|pair| (pair[1] / pair[0], pair));
    let (_, widest) = ratios.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let (longest_round, pause) = (widest[0], widest[1]);
    let rounds = spans.partition_point(|span| *span <= longest_round);
    let pauses = &spans[rounds..];
    let usual_pause = *pauses.get(pauses.len() / 2)?;
    let is_often = 2 * rounds >= pauses.len() && rounds < MOST_ROUNDS * pauses.len();
    let lasts = longest_round * (rounds as f64 / pauses.len() as f64);
    let longest = LASTS * usual_pause;
    (pauses.len() + 1 >= FEWEST_SESSIONS && is_often && lasts <= longest).then(|| SessionPattern {
        least_pause: (longest_round * pause).sqrt(),
        longest,
    })
}

fn mean(session: &[Observation]) -> Observation {
    let count = session.len() as f64;
    let mean_of = |of: &dyn Fn(&Observation) -> f64| session.iter().map(of).sum::<f64>() / count;
    let variances: Option<f64> = session
        .iter()
        .map(|one| one.sigma.map(|sigma| sigma * sigma))
        .sum();
    Observation {
        t_days: mean_of(&|one| one.t_days),
        value: mean_of(&|one| one.value),
        sigma: variances.map(|sum| sum.sqrt() / count),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MINUTE: f64 = 1.0 / 1440.0;

    /// Sessions `apart` days apart, of so many rounds `minutes` apart; 1 mm a day.
    fn sessions(count: usize, rounds: usize, apart: f64, minutes: f64) -> Vec<Observation> {
        let round = |index: usize| {
            let (session, round) = (index / rounds, index % rounds);
            let t_days = session as f64 * apart + round as f64 * minutes * MINUTE;
            Observation {
                t_days,
                value: t_days + if round.is_multiple_of(2) { 0.3 } else { -0.3 },
                sigma: Some(0.3),
            }
        };
        (0..count * rounds).map(round).collect()
    }

    #[test]
    fn of_rounds_within_minutes_their_mean_counts() {
        for (rounds, apart) in [(2, 0.5), (2, 1.0), (3, 0.5), (5, 3.0)] {
            let values = sessions(20, rounds, apart, 4.0);
            // Also while a session is going on.
            for read in values.len() - rounds + 1..=values.len() {
                let means = merged(&values[..read]);
                assert_eq!(means.len(), 20, "{rounds} {apart} {read}");
            }
            let means = merged(&values);
            let spacing = means[9].t_days - means[8].t_days;
            assert!((spacing - apart).abs() < 1e-9);
            let sigma = means[9].sigma.unwrap();
            assert!((sigma - 0.3 / (rounds as f64).sqrt()).abs() < 1e-9);
        }
    }

    #[test]
    fn readings_in_working_hours_at_one_spacing_or_with_outages_are_no_sessions() {
        let working = sessions(30, 8, 1.0, 60.0);
        assert_eq!(merged(&working).len(), working.len());
        let often = sessions(30, 48, 1.0, 10.0);
        assert_eq!(merged(&often).len(), often.len());
        for apart in [1.0, 0.1] {
            let regular = sessions(200, 1, apart, 0.0);
            assert_eq!(merged(&regular).len(), regular.len());
        }
        let mut with_outages = sessions(300, 1, 1.0 / 24.0, 0.0);
        for (index, one) in with_outages.iter_mut().enumerate() {
            one.t_days += (index / 50) as f64 * 3.0;
        }
        assert_eq!(merged(&with_outages).len(), with_outages.len());
    }

    /// As when it gets serious: surveys each month, and then a reading each hour.
    #[test]
    fn readings_that_come_more_often_from_now_on_are_no_session() {
        for (surveys, apart) in [(24, 30.0), (60, 30.0), (60, 7.0), (40, 1.0)] {
            let mut values = sessions(surveys, 1, apart, 0.0);
            for hour in 1..=200 {
                let last = values[values.len() - 1];
                let t_days = last.t_days + 1.0 / 24.0;
                values.push(Observation { t_days, ..last });
                let kept = merged(&values);
                assert_eq!(kept.len(), values.len(), "{surveys} {apart} {hour}");
            }
        }
        // The same after sessions of three rounds.
        let mut values = sessions(40, 3, 1.0, 4.0);
        for hour in 1..=48 {
            let last = values[values.len() - 1];
            let t_days = last.t_days + 1.0 / 24.0;
            values.push(Observation { t_days, ..last });
            assert!(merged(&values).len() >= 40 + hour, "{hour}");
        }
    }

    #[test]
    fn a_few_repeated_readings_are_no_sessions() {
        let mut values = sessions(60, 1, 1.0, 0.0);
        for index in [10, 20, 30] {
            let repeated = Observation {
                t_days: values[index].t_days + MINUTE,
                ..values[index]
            };
            values.insert(index + 1, repeated);
        }
        assert_eq!(merged(&values).len(), values.len());
        assert_eq!(merged(&sessions(5, 3, 1.0, 4.0)).len(), 15);
        assert_eq!(merged(&[]).len(), 0);
    }
}

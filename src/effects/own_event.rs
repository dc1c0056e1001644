//! An event that one benchmark had and its neighbours had not: it parted from them then.
//!
//! The law of the benchmark with its event, and the same law without it, are two courses; a neighbour that had moved in
//! proportion goes on in proportion to the one or to the other.

use super::explanation::{Candidate, Curves, Effect};
use super::kind::Kind;
use super::partition::AS_ONE;
use crate::reading::{BenchmarkId, Quantity, Series, Timestamp, days_since};

/// A neighbour follows one course where the other leaves this many times its squared error.
const CLEARLY: f64 = 2.0;
/// Fewest readings of a neighbour before the event and after it.
const FEWEST: usize = 5;

/// The benchmark's own course with an event and without it.
struct Courses<'a> {
    times: &'a [Timestamp],
    with: &'a [f64],
    without: Vec<f64>,
    at: Timestamp,
}

/// Which course a neighbour goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Follows {
    With,
    Without,
    Unclear,
}

/// The partition by the event among `effects` that neighbours had not, with its candidate; `None` where there is none.
pub(super) fn parted_by(
    series: &Series,
    neighbours: &[&Series],
    (effects, curves): (&[&Effect], &Curves),
    margin: f64,
) -> Option<(Effect, Candidate)> {
    let mut events = effects
        .iter()
        .filter(|one| one.effect.is_event_of_the_ground());
    let (Some(event), None) = (events.next(), events.next()) else {
        return None;
    };
    let added = curves.contributions.get(&event.effect.to_string())?;
    let without = curves.after.iter().zip(added).map(|(after, by)| after - by);
    let courses = Courses {
        times: &curves.times,
        with: &curves.after,
        without: without.collect(),
        at: event.at?,
    };
    if courses.without.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let others = neighbours.iter().filter(|other| {
        other.benchmark != series.benchmark && other.quantity() == series.quantity()
    });
    let (mut stayed, mut left) = (vec![series.benchmark.clone()], Vec::new());
    for other in others {
        match side(&courses, other, margin) {
            Follows::With => stayed.push(other.benchmark.clone()),
            Follows::Without => left.push(other.benchmark.clone()),
            Follows::Unclear => {}
        }
    }
    (!left.is_empty()).then(|| partition(event, (stayed, left)))
}

fn partition(
    event: &Effect,
    (stayed, left): (Vec<BenchmarkId>, Vec<BenchmarkId>),
) -> (Effect, Candidate) {
    let effect = Effect {
        at: event.at,
        p_value: event.p_value,
        groups: Some(vec![stayed, left]),
        bic_gain: event.bic_gain,
        ..Effect::of(Kind::PARTITION)
    };
    let candidate = Candidate {
        effect: Kind::PARTITION,
        channel: None,
        form: None,
        at: event.at,
        lag_days: None,
        bic_gain: event.bic_gain,
        p_value: event.p_value,
        held_out: None,
        rejected_because: None,
    };
    (effect, candidate)
}

/// The course that `other` follows: where only one of the two leaves no more than what moves as one may stray by.
fn side(courses: &Courses, other: &Series, margin: f64) -> Follows {
    let (Some(first), Some(last)) = (courses.times.first(), courses.times.last()) else {
        return Follows::Unclear;
    };
    let common: Vec<_> = other
        .readings
        .iter()
        .filter(|reading| (*first..=*last).contains(&reading.time))
        .collect();
    let before = common.iter().filter(|one| one.time < courses.at).count();
    if before < FEWEST || common.len() - before < FEWEST {
        return Follows::Unclear;
    }
    let values: Vec<f64> = common.iter().map(|reading| reading.value).collect();
    let of = |course: &[f64]| {
        let course = common.iter().map(|one| courses.at_time(course, one.time));
        left_of_line(&course.collect::<Vec<f64>>(), &values, other.quantity())
    };
    let (with, without) = (of(courses.with), of(&courses.without));
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let most = (AS_ONE * (high - low)).powi(2);
    let clearly = |small: f64, large: f64| {
        let gain = values.len() as f64 * (large / small.max(1e-300)).ln();
        small <= most && large >= CLEARLY * small && gain >= margin
    };
    if clearly(without, with) {
        Follows::Without
    } else if clearly(with, without) {
        Follows::With
    } else {
        Follows::Unclear
    }
}

impl Courses<'_> {
    /// A course between its readings in a straight line.
    fn at_time(&self, course: &[f64], time: Timestamp) -> f64 {
        let next = self.times.partition_point(|known| *known < time);
        let next = next.clamp(1, self.times.len() - 1);
        let span = days_since(self.times[next - 1], self.times[next]);
        let share = days_since(self.times[next - 1], time) / span;
        course[next - 1] + share * (course[next] - course[next - 1])
    }
}

/// Mean square of what is left of `values` about `course` in proportion; a displacement has its own zero, a velocity none.
fn left_of_line(course: &[f64], values: &[f64], quantity: Quantity) -> f64 {
    let n = values.len() as f64;
    let mean = |all: &[f64]| match quantity {
        Quantity::Displacement => all.iter().sum::<f64>() / n,
        Quantity::Velocity => 0.0,
    };
    let (x_mean, y_mean) = (mean(course), mean(values));
    let both = || {
        course
            .iter()
            .zip(values)
            .map(|(x, y)| (x - x_mean, y - y_mean))
    };
    let (xy, xx) = both().fold((0.0, 0.0), |(xy, xx), (x, y)| (xy + x * y, xx + x * x));
    let slope = xy / xx.max(1e-300);
    both().map(|(x, y)| (y - slope * x).powi(2)).sum::<f64>() / n
}

#[cfg(test)]
mod tests;

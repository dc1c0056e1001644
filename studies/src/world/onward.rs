//! The path of a slope: its course under its weather, added up.

use super::Family;
use super::course::Course;
use super::weather::Weather;
use rand::Rng;

/// Steps of a life, and the longest step, days.
const STEPS: f64 = 6000.0;
const MOST_STEPS: usize = 60_000;
const SHORTEST: f64 = 1.0 / 1440.0;
const FIVE_MINUTES: f64 = 1.0 / 288.0;
/// Towards the end steps shorten to this share of the time that is left.
const OF_THE_REST: f64 = 1.0 / 30.0;
/// A motion is seen that is so many times the error.
const SEEN: f64 = 10.0;

/// Displacement over time.
#[derive(Debug)]
pub(super) struct WorldPath {
    days: Vec<f64>,
    mm: Vec<f64>,
}

impl WorldPath {
    pub(super) fn at(&self, days: f64) -> f64 {
        let after = self.days.partition_point(|at| *at <= days);
        let after = after.clamp(1, self.days.len() - 1);
        let (from, to) = (self.days[after - 1], self.days[after]);
        let share = ((days - from) / (to - from)).min(1.0);
        self.mm[after - 1] + (self.mm[after] - self.mm[after - 1]) * share
    }

    pub(super) fn end(&self) -> f64 {
        self.days[self.days.len() - 1]
    }

    /// When the motion beyond the creep since the onset is [`SEEN`] times `error`, mm.
    pub(super) fn visible(&self, course: &Course, error: f64) -> f64 {
        let first = self.at(course.onset);
        let is_seen = |(days, mm): &(&f64, &f64)| {
            let beyond = *mm - first - course.creep * (*days - course.onset);
            **days > course.onset && beyond > SEEN * error
        };
        let found = self.days.iter().zip(&self.mm).find(is_seen);
        found.map_or(course.end, |(days, _)| *days)
    }
}

pub(super) fn path(
    course: &Course,
    family: Family,
    interval: f64,
    generator: &mut impl Rng,
) -> WorldPath {
    let end = course.end;
    let mut weather = Weather::draw(family, end, generator);
    let longest = (end / STEPS).clamp(FIVE_MINUTES, interval.max(FIVE_MINUTES));
    let mut path = WorldPath {
        days: vec![0.0],
        mm: vec![0.0],
    };
    let (mut days, mut mm) = (0.0, 0.0);
    while days < end && path.days.len() < MOST_STEPS {
        let left = end - days;
        let step = longest.min((left * OF_THE_REST).max(SHORTEST)).min(left);
        let step = step.max(1e-7);
        let middle = days + 0.5 * step;
        let velocity = course.velocity(middle);
        mm += step * weather.velocity((middle, step), velocity, course.creep, generator);
        days += step;
        path.days.push(days);
        path.mm.push(mm);
    }
    path
}

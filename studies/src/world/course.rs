//! The course of a slope's velocity before weather and roughness: stretches of creep, acceleration and relaxation.

use super::Family;
use super::gauge::Gauge;
use crate::random::{happens, log_uniform, normal, uniform};
use rand::{Rng, RngExt};

/// Velocity last read before a collapse: median, mm/day, and decades; and its bounds. The published ones are mostly of
/// daily surveys; who reads more often sees more of the last hours (Brienz 40 m/day, Lanzada ten times as fast within
/// its last hour), taken here as the fourth root of the readings a day.
const LAST_VELOCITY: (f64, f64) = (93.0, 1.1);
const LAST_VELOCITIES: (f64, f64) = (2.0, 60_000.0);
/// From the onset to the collapse: median, days, and decades; and its bounds.
const DURATION: (f64, f64) = (25.0, 0.8);
const DURATIONS: (f64, f64) = (0.3, 600.0);
/// Of how many intervals between readings an acceleration is at least. With six a slope that is read daily and collapses within a week was
/// in no family, while bursts of a few readings that stop were, and the network learnt to call none of them.
const FEWEST_INTERVALS: f64 = 3.0;
/// The quiet time before an acceleration, in multiples of that.
const QUIET: (f64, f64) = (0.1, 60.0);
/// By how much the velocity grows: at least; at most if read daily, times the root of the readings a day; and the bounds
/// of that.
const GROWTH: (f64, f64) = (8.0, 300.0);
const MOST_GROWTH: (f64, f64) = (100.0, 4000.0);
/// Readings of an acceleration, and of a whole life, at most. So many that how often a slope is read does not say how long it takes:
/// with 2,500 of them whatever was read each minute collapsed within two days, and a network learnt that.
const MOST_READINGS: (f64, f64) = (40_000.0, 60_000.0);
/// Lives of slopes that stand: readings, and days.
const STANDING_READINGS: (f64, f64) = (60.0, 60_000.0);
const STANDING_DAYS: (f64, f64) = (4.0, 1500.0);
/// Alpha within this of 1 is an exponential.
const EXPONENTIAL: f64 = 0.02;

/// A stretch of time in which the velocity goes one way.
#[derive(Debug, Clone)]
pub(super) struct Stretch {
    pub(super) from: f64,
    pub(super) to: f64,
    /// At its beginning and at its end, mm/day.
    velocities: (f64, f64),
    way: Way,
}

#[derive(Debug, Clone)]
enum Way {
    /// In a straight line.
    Straight,
    /// By Voight's relation, with waves in ln of the time that remains: their amplitude, frequency and phase.
    Voight { alpha: f64, wave: (f64, f64, f64) },
    /// Towards the second velocity, with this memory, days.
    Relaxing { memory: f64 },
}

/// The course of one slope.
#[derive(Debug)]
pub(super) struct Course {
    stretches: Vec<Stretch>,
    /// The creep beside which it is seen, mm/day.
    pub(super) creep: f64,
    /// When the acceleration begins, days; 0 without one.
    pub(super) onset: f64,
    /// When an acceleration ends, in a collapse or not, days.
    pub(super) stops: Option<f64>,
    pub(super) end: f64,
}

impl Stretch {
    fn velocity(&self, days: f64) -> f64 {
        let share = ((days - self.from) / (self.to - self.from)).clamp(0.0, 1.0);
        let (first, last) = self.velocities;
        match self.way {
            Way::Straight => first + (last - first) * share,
            Way::Relaxing { memory } => {
                last + (first - last) * (-(days - self.from) / memory).exp()
            }
            Way::Voight { alpha, wave } => {
                let smooth = if (alpha - 1.0).abs() < EXPONENTIAL {
                    first * (last / first).powf(share)
                } else {
                    let spent = 1.0 - (first / last).powf(alpha - 1.0);
                    first * (1.0 - share * spent).powf(-1.0 / (alpha - 1.0))
                };
                let (amplitude, frequency, phase) = wave;
                let remains = (1.0 - share).max(1e-4).ln();
                smooth * (amplitude * (frequency * remains + phase).cos()).exp()
            }
        }
    }
}

impl Course {
    /// `None` where the instrument could not see the acceleration, or reads it too seldom.
    pub(super) fn draw(family: Family, gauge: &Gauge, generator: &mut impl Rng) -> Option<Self> {
        if family.fails() || matches!(family, Family::Stopped | Family::Plateau) {
            return Self::accelerating(family, gauge, generator);
        }
        let readings = log_uniform(generator, STANDING_READINGS.0, STANDING_READINGS.1);
        let end = (gauge.interval * readings).clamp(STANDING_DAYS.0, STANDING_DAYS.1);
        Some(Self::standing(family, end, generator))
    }

    /// Of a slope that stands, a year long; one that accelerates does so once, at any time of it.
    pub(super) fn year(family: Family, gauge: &Gauge, generator: &mut impl Rng) -> Option<Self> {
        const DAYS: f64 = 365.25;
        if !matches!(family, Family::Stopped | Family::Plateau) {
            return Some(Self::standing(family, DAYS, generator));
        }
        let mut course = Self::accelerating(family, gauge, generator)?;
        let later = (DAYS - course.end).max(0.0) * generator.random::<f64>();
        for stretch in &mut course.stretches {
            stretch.from += later;
            stretch.to += later;
        }
        let quiet = straight((0.0, later), (course.creep, course.creep));
        course.stretches.insert(0, quiet);
        course.onset += later;
        course.stops = course.stops.map(|days| days + later);
        course.end = DAYS;
        Some(course)
    }

    pub(super) fn velocity(&self, days: f64) -> f64 {
        let within = |one: &&Stretch| (one.from..one.to).contains(&days);
        let found = self.stretches.iter().find(within);
        let found = found.or(self.stretches.last().filter(|last| days >= last.to));
        found.map_or(self.creep, |one| one.velocity(days))
    }

    fn accelerating(family: Family, gauge: &Gauge, generator: &mut impl Rng) -> Option<Self> {
        let duration = DURATION.0 * 10f64.powf(DURATION.1 * normal(generator));
        let duration = duration.clamp(DURATIONS.0, DURATIONS.1);
        let duration = duration.min(MOST_READINGS.0 * gauge.interval);
        let quiet = if happens(generator, 0.15) {
            0.0
        } else {
            let most = (MOST_READINGS.1 * gauge.interval - duration).clamp(0.0, 1200.0);
            (duration * log_uniform(generator, QUIET.0, QUIET.1)).min(most)
        };
        let often = gauge.interval.recip();
        let median = LAST_VELOCITY.0 * often.max(1.0).powf(0.25);
        let last = median * 10f64.powf(LAST_VELOCITY.1 * normal(generator));
        let last = last.clamp(LAST_VELOCITIES.0, LAST_VELOCITIES.1);
        let most = (GROWTH.1 * often.sqrt()).clamp(MOST_GROWTH.0, MOST_GROWTH.1);
        let first = last / log_uniform(generator, GROWTH.0, most);
        let error = gauge.error();
        let slip = (3.0 * first + 0.1 * last) * duration;
        let is_seen = slip > 8.0 * error && 0.15 * last * duration > 4.0 * error;
        if !is_seen || duration < FEWEST_INTERVALS * gauge.interval {
            return None;
        }
        let mut stretches = Vec::new();
        if quiet > 0.0 {
            stretches.push(Stretch {
                from: 0.0,
                to: quiet,
                velocities: (first, first),
                way: Way::Straight,
            });
        }
        let plan = Acceleration::draw((quiet, duration), (first, last), generator);
        plan.add(family, &mut stretches, generator);
        Some(Self {
            end: stretches.last()?.to,
            stretches,
            creep: first,
            onset: quiet,
            stops: Some(quiet + duration),
        })
    }

    fn standing(family: Family, end: f64, generator: &mut impl Rng) -> Self {
        let is_plain = matches!(family, Family::Steady | Family::TwoRates | Family::Resets);
        let most = if is_plain { 200.0 } else { 5.0 };
        let creep = if happens(generator, 0.1) {
            0.0
        } else {
            log_uniform(generator, 0.005, most)
        };
        let stretches = if family == Family::TwoRates {
            two_rates(end, creep, generator)
        } else if family == Family::Reservoir {
            draw_downs(end, creep, generator)
        } else if family == Family::StickSlip {
            fits(end, creep, generator)
        } else {
            Vec::new()
        };
        Self {
            stretches,
            creep,
            onset: 0.0,
            stops: None,
            end,
        }
    }
}

/// What every acceleration has.
struct Acceleration {
    from: f64,
    duration: f64,
    first: f64,
    last: f64,
    alpha: f64,
}

const SMOOTH: (f64, f64, f64) = (0.0, 0.0, 0.0);

impl Acceleration {
    fn draw(
        (from, duration): (f64, f64),
        (first, last): (f64, f64),
        generator: &mut impl Rng,
    ) -> Self {
        let alpha = if happens(generator, 0.6) {
            (2.0 + 0.25 * normal(generator)).clamp(1.3, 3.0)
        } else {
            uniform(generator, 1.3, 3.0)
        };
        Self {
            from,
            duration,
            first,
            last,
            alpha,
        }
    }

    fn add(&self, family: Family, stretches: &mut Vec<Stretch>, generator: &mut impl Rng) {
        let to = self.from + self.duration;
        let mut whole = |alpha: f64, wave: (f64, f64, f64)| {
            let velocities = (self.first, self.last);
            stretches.push(voight((self.from, to), velocities, alpha, wave));
        };
        match family {
            Family::Exponential => whole(1.0, SMOOTH),
            Family::LogPeriodic => {
                let amplitude = uniform(generator, 0.2, 0.9);
                let frequency = uniform(generator, 4.0, 9.0);
                let phase = uniform(generator, 0.0, std::f64::consts::TAU);
                whole(self.alpha, (amplitude, frequency, phase));
            }
            Family::Handover => self.handed_over(stretches, generator),
            Family::Paused => self.with_pauses(stretches, generator),
            Family::Pieces => self.in_pieces(stretches, generator),
            Family::Stopped => {
                let half = happens(generator, 0.5);
                let alpha = if half {
                    1.0
                } else {
                    uniform(generator, 1.2, 2.0)
                };
                whole(alpha, SMOOTH);
                let rest = self.duration * log_uniform(generator, 0.2, 3.0);
                let kept = self.first * log_uniform(generator, 0.5, 5.0);
                let memory = rest * log_uniform(generator, 0.03, 0.5);
                let velocities = (self.last, kept.min(0.5 * self.last));
                stretches.push(relaxing((to, to + rest), velocities, memory));
            }
            Family::Levelled => self.levelled(stretches, generator),
            Family::Plateau => self.to_a_plateau(stretches, generator),
            Family::Voight
            | Family::Law
            | Family::Steady
            | Family::TwoRates
            | Family::Rain
            | Family::Season
            | Family::Reservoir
            | Family::FreezeThaw
            | Family::StickSlip
            | Family::Resets => whole(self.alpha, SMOOTH),
        }
    }

    fn handed_over(&self, stretches: &mut Vec<Stretch>, generator: &mut impl Rng) {
        let first = self.duration * uniform(generator, 0.2, 0.6);
        let top = self.first * (self.last / self.first).powf(uniform(generator, 0.3, 0.8));
        let low = top * uniform(generator, 0.15, 0.6);
        let rest = self.duration * uniform(generator, 0.1, 0.3);
        let begins = self.from + first;
        let alpha = uniform(generator, 1.3, 2.2);
        stretches.push(voight(
            (self.from, begins),
            (self.first, top),
            alpha,
            SMOOTH,
        ));
        let memory = rest / uniform(generator, 1.5, 6.0);
        stretches.push(relaxing((begins, begins + rest), (top, low), memory));
        let to = (self.from + self.duration).max(begins + 2.0 * rest);
        stretches.push(voight(
            (begins + rest, to),
            (low, self.last),
            self.alpha,
            SMOOTH,
        ));
    }

    fn with_pauses(&self, stretches: &mut Vec<Stretch>, generator: &mut impl Rng) {
        let whole = voight(
            (0.0, self.duration),
            (self.first, self.last),
            self.alpha,
            SMOOTH,
        );
        let count = if happens(generator, 0.6) { 1 } else { 2 };
        let mut cuts: Vec<f64> = (0..count)
            .map(|_| self.duration * (1.0 - log_uniform(generator, 0.02, 0.6)))
            .collect();
        cuts.sort_by(f64::total_cmp);
        let (mut at, mut done) = (self.from, 0.0);
        for cut in cuts {
            if cut - done < 0.02 * self.duration {
                continue;
            }
            let (low, high) = (whole.velocity(done), whole.velocity(cut));
            stretches.push(voight(
                (at, at + cut - done),
                (low, high),
                self.alpha,
                SMOOTH,
            ));
            at += cut - done;
            let pause = (self.duration - cut) * log_uniform(generator, 0.3, 3.0);
            let kept = high * uniform(generator, 0.03, 0.5);
            let memory = pause * uniform(generator, 0.03, 0.4);
            stretches.push(relaxing((at, at + pause), (high, kept), memory));
            at += pause;
            done = cut;
        }
        let left = self.duration - done;
        let velocities = (whole.velocity(done), self.last);
        stretches.push(voight((at, at + left), velocities, self.alpha, SMOOTH));
    }

    fn in_pieces(&self, stretches: &mut Vec<Stretch>, generator: &mut impl Rng) {
        let count = if happens(generator, 0.7) { 1 } else { 2 };
        let (mut at, mut first) = (self.from, self.first);
        let mut span = self.duration * uniform(generator, 0.3, 0.8);
        for _ in 0..count {
            let top = self.last * uniform(generator, 0.3, 1.5);
            stretches.push(voight((at, at + span), (first, top), self.alpha, SMOOTH));
            at += span;
            let rest = span * log_uniform(generator, 0.05, 0.6);
            first = top * log_uniform(generator, 0.05, 0.6);
            let memory = rest * uniform(generator, 0.05, 0.4);
            stretches.push(relaxing((at, at + rest), (top, first), memory));
            at += rest;
            span = self.duration * log_uniform(generator, 0.05, 0.4);
        }
        stretches.push(voight(
            (at, at + span),
            (first, self.last),
            self.alpha,
            SMOOTH,
        ));
    }

    /// As the Birch glacier did for its last three days and a pit wall for its last hours (failures come from such a velocity
    /// as well as from a growing one).
    fn levelled(&self, stretches: &mut Vec<Stretch>, generator: &mut impl Rng) {
        let rest = self.duration * log_uniform(generator, 0.03, 0.5);
        let to = self.from + self.duration - rest;
        let top = self.last * uniform(generator, 0.7, 1.1);
        let velocities = (self.first, top);
        stretches.push(voight((self.from, to), velocities, self.alpha, SMOOTH));
        let memory = rest * uniform(generator, 0.1, 1.0);
        let kept = (top, self.last);
        stretches.push(relaxing((to, to + rest), kept, memory));
    }

    fn to_a_plateau(&self, stretches: &mut Vec<Stretch>, generator: &mut impl Rng) {
        const HIGHEST: f64 = 400.0;
        let top = (0.5 * self.last).min(HIGHEST);
        let to = self.from + self.duration;
        let velocities = (self.first.min(0.5 * top), top);
        stretches.push(voight((self.from, to), velocities, 1.0, SMOOTH));
        let rest = self.duration * log_uniform(generator, 0.3, 3.0);
        let kept = top * uniform(generator, 0.8, 1.5);
        stretches.push(relaxing((to, to + rest), (top, kept), 0.3 * rest));
    }
}

fn voight(
    (from, to): (f64, f64),
    velocities: (f64, f64),
    alpha: f64,
    wave: (f64, f64, f64),
) -> Stretch {
    Stretch {
        from,
        to,
        velocities,
        way: Way::Voight { alpha, wave },
    }
}

fn relaxing((from, to): (f64, f64), velocities: (f64, f64), memory: f64) -> Stretch {
    Stretch {
        from,
        to,
        velocities,
        way: Way::Relaxing { memory },
    }
}

fn straight((from, to): (f64, f64), velocities: (f64, f64)) -> Stretch {
    Stretch {
        from,
        to,
        velocities,
        way: Way::Straight,
    }
}

fn two_rates(end: f64, creep: f64, generator: &mut impl Rng) -> Vec<Stretch> {
    let change = end * uniform(generator, 0.2, 0.8);
    let ramp = end * log_uniform(generator, 0.001, 0.1);
    let faster = creep.max(0.1) * log_uniform(generator, 1.3, 6.0);
    vec![
        straight((0.0, change), (creep, creep)),
        straight((change, change + ramp), (creep, faster)),
        straight((change + ramp, end + ramp + 1.0), (faster, faster)),
    ]
}

/// A step in most years: a rise within weeks, and a relaxation.
fn draw_downs(end: f64, creep: f64, generator: &mut impl Rng) -> Vec<Stretch> {
    const FASTEST: f64 = 400.0;
    let (mut stretches, mut at) = (Vec::new(), 0.0);
    let mut rest = uniform(generator, 0.1, 0.9) * end.min(365.0);
    while at < end {
        stretches.push(straight((at, at + rest), (creep, creep)));
        at += rest;
        let top = (creep.max(0.1) * log_uniform(generator, 4.0, 100.0)).min(FASTEST);
        let rise = log_uniform(generator, 2.0, 25.0);
        stretches.push(straight((at, at + rise), (creep, top)));
        at += rise;
        let fall = log_uniform(generator, 5.0, 40.0);
        let memory = fall * uniform(generator, 0.1, 0.4);
        stretches.push(relaxing((at, at + fall), (top, creep), memory));
        at += fall;
        rest = 365.0 * uniform(generator, 0.5, 1.1);
    }
    stretches
}

/// The velocity of a fit, mm/day, at most.
const FASTEST_FIT: f64 = 300.0;

/// Slow between fits, fast in them.
fn fits(end: f64, creep: f64, generator: &mut impl Rng) -> Vec<Stretch> {
    let every = end / log_uniform(generator, 5.0, 60.0);
    let (mut stretches, mut at) = (Vec::new(), 0.0);
    while at < end {
        let hold = every * uniform(generator, 0.4, 1.6);
        stretches.push(straight((at, at + hold), (0.3 * creep, 0.3 * creep)));
        at += hold;
        let slip = every * log_uniform(generator, 0.01, 0.2);
        let fast = (creep.max(0.02) * log_uniform(generator, 6.0, 600.0)).min(FASTEST_FIT);
        stretches.push(straight((at, at + slip), (fast, fast)));
        at += slip;
    }
    stretches
}

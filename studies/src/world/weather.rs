//! What weather adds to a slope: pulses of velocity, a season, and roughness.

use super::Family;
use crate::random::{happens, log_uniform, normal, uniform};
use rand::{Rng, RngExt};
use std::f64::consts::TAU;

/// Pulses of a life, at most.
const MOST_PULSES: usize = 400;

/// How fast a slope that rain loads gets in a storm, in multiples of its creep: from 1 to 231 mm in a day at Century Mine, from
/// 0.1 to 300 mm/day at Veslemannen.
const RAIN: (f64, f64) = (0.5, 300.0);

/// What storms are multiples of where the creep is less, mm/day: of any slope, and of one that rain drives.
const LEAST: (f64, f64) = (0.2, 1.0);

/// A pulse of velocity: it rises within days and fades.
#[derive(Debug, Clone, Copy)]
struct Pulse {
    at: f64,
    /// Multiples of the creep.
    size: f64,
    rise: f64,
    fade: f64,
}

/// The weather of one life.
#[derive(Debug)]
pub(super) struct Weather {
    pulses: Vec<Pulse>,
    /// What the sizes of pulses are multiples of where the creep is less, mm/day.
    least: f64,
    /// Standard deviation and memory, days, of ln of the velocity, and where it stands.
    roughness: (f64, f64),
    rough: f64,
    /// Amplitude and phase of ln of the velocity over the year, and of its sharper swing.
    season: (f64, f64),
    swing: (f64, f64),
}

impl Pulse {
    fn velocity(&self, days: f64) -> f64 {
        let since = days - self.at;
        if since <= 0.0 || since > 12.0 * self.fade + 5.0 * self.rise {
            return 0.0;
        }
        self.size * (1.0 - (-since / self.rise).exp()) * (-since / self.fade).exp()
    }
}

/// How often pulses come, a year, and the bounds of their size, rise and fading.
struct WeatherKind {
    often: f64,
    size: (f64, f64),
    rise: (f64, f64),
    fade: (f64, f64),
}

impl WeatherKind {
    fn pulses(&self, end: f64, generator: &mut impl Rng) -> Vec<Pulse> {
        let (mut at, mut pulses) = (0.0, Vec::new());
        while pulses.len() < MOST_PULSES {
            at -= (1.0 - generator.random::<f64>()).ln() * 365.25 / self.often;
            if at > end {
                break;
            }
            pulses.push(Pulse {
                at,
                size: log_uniform(generator, self.size.0, self.size.1),
                rise: log_uniform(generator, self.rise.0, self.rise.1),
                fade: log_uniform(generator, self.fade.0, self.fade.1),
            });
        }
        pulses
    }
}

impl Weather {
    pub(super) fn draw(family: Family, end: f64, generator: &mut impl Rng) -> Self {
        let rough = if happens(generator, 0.7) {
            log_uniform(generator, 0.03, 0.4)
        } else {
            0.0
        };
        let memory = log_uniform(generator, 0.01, 0.3) * end.min(60.0);
        let season = if happens(generator, 0.4) {
            log_uniform(generator, 0.1, 0.6)
        } else {
            0.0
        };
        let swing = if family == Family::Season {
            log_uniform(generator, 0.35, 1.2)
        } else {
            0.0
        };
        Self {
            pulses: pulses(family, end, generator),
            least: if family == Family::Rain {
                LEAST.1
            } else {
                LEAST.0
            },
            roughness: (rough, memory),
            rough: 0.0,
            season: (season, uniform(generator, 0.0, TAU)),
            swing: (swing, uniform(generator, 0.0, TAU)),
        }
    }

    /// The velocity at `days`, after a step of time, of a slope that would go at `velocity`, with its creep.
    pub(super) fn velocity(
        &mut self,
        (days, step): (f64, f64),
        velocity: f64,
        creep: f64,
        generator: &mut impl Rng,
    ) -> f64 {
        let (size, memory) = self.roughness;
        let fresh = -(-2.0 * step / memory).exp_m1();
        self.rough += (-step / memory).exp_m1() * self.rough
            + size * fresh.max(0.0).sqrt() * normal(generator);
        let year = days / 365.25 * TAU;
        let season = self.season.0 * (year + self.season.1).sin();
        let turn = year + self.swing.1;
        let swing = self.swing.0 * (turn.sin() + 0.4 * (2.0 * turn).sin());
        let pulses: f64 = self.pulses.iter().map(|pulse| pulse.velocity(days)).sum();
        velocity * (self.rough + season + swing).exp() + creep.max(self.least) * pulses
    }
}

fn pulses(family: Family, end: f64, generator: &mut impl Rng) -> Vec<Pulse> {
    let kind = if family == Family::Rain {
        let storms = log_uniform(generator, 5.0, 40.0);
        let least = 3.0 * 365.25 / end * uniform(generator, 0.3, 1.5);
        WeatherKind {
            often: storms.max(least),
            size: RAIN,
            rise: (0.02, 1.0),
            fade: (0.3, 12.0),
        }
    } else if family == Family::FreezeThaw {
        WeatherKind {
            often: 60.0,
            size: (0.5, 10.0),
            rise: (0.05, 0.3),
            fade: (0.2, 1.5),
        }
    } else if happens(generator, 0.25) {
        WeatherKind {
            often: log_uniform(generator, 3.0, 20.0),
            size: (0.2, 4.0),
            rise: (0.02, 1.0),
            fade: (0.3, 10.0),
        }
    } else {
        return Vec::new();
    };
    kind.pulses(end, generator)
}

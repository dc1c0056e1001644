//! Slopes with a = 0 under the load of a reservoir, measured day by day with seeded noise.

use jiff::ToSpan;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use slipwatch::reading::{Reading, Sample, Timestamp};

pub(crate) const RESERVOIR: &str = "reservoir_level_m";
/// Mean delay of every response here, days.
pub(crate) const DELAY: f64 = 8.0;

pub(crate) fn start() -> Timestamp {
    "2020-01-01T00:00:00Z".parse().unwrap()
}

/// A slope with a = 0: v = v_0 e^f / (1 - tau / life), tau the integral of e^f.
#[derive(Clone, Copy)]
pub(crate) struct Slope {
    /// mm/day.
    pub(crate) v: f64,
    /// Days under no load; infinite: it stands.
    pub(crate) life: f64,
    /// Log-load for a metre of the reservoir.
    pub(crate) gain: f64,
}

/// What is measured at it: daily displacements until it fails, and the reservoir's level.
pub(crate) struct Measured {
    pub(crate) readings: Vec<Reading>,
    pub(crate) samples: Vec<Sample>,
    pub(crate) fails: Option<Timestamp>,
}

impl Slope {
    /// Under a reservoir of `level` m at each day, by steps of an hour; noise of half a millimetre.
    pub(crate) fn measured(self, days: i64, level: impl Fn(f64) -> f64) -> Measured {
        let mut generator = Pcg64::seed_from_u64(11);
        let (mut felt, mut tau, mut slip) = (level(0.0), 0.0, 0.0);
        let mut measured = Measured {
            readings: Vec::new(),
            samples: Vec::new(),
            fails: None,
        };
        for hour in 0..24 * days {
            let time = start() + hour.hours();
            let day = hour as f64 / 24.0;
            if hour % 24 == 0 {
                measured.samples.push(Sample {
                    time,
                    value: level(day),
                });
                measured.readings.push(Reading {
                    time,
                    value: slip + generator.random::<f64>() - 0.5,
                    sigma: None,
                });
            }
            felt += (level(day) - felt) / DELAY / 24.0;
            let pace = (self.gain * felt).exp();
            tau += pace / 24.0;
            if tau >= self.life {
                measured.fails = Some(time);
                break;
            }
            slip += self.v * pace / (1.0 - tau / self.life) / 24.0;
        }
        measured
    }
}

/// Wells up and down by some tens of centimetres, as a reservoir does.
pub(crate) fn restless(day: f64) -> f64 {
    let wave = |period: f64, size: f64| size * (std::f64::consts::TAU * day / period).sin();
    wave(23.0, 0.25) + wave(41.0, 0.35) + wave(67.0, 0.3)
}

/// Rises by `height` over some weeks about `middle`, and falls again.
pub(crate) fn flood(day: f64, middle: f64, height: f64) -> f64 {
    height * (-((day - middle) / 14.0).powi(2)).exp()
}

//! The loads that act on simulated slopes, which nobody declares.

use super::Fate;
use crate::random::{log_uniform, normal};
use rand::{Rng, RngExt};

/// Step of the load, days.
pub(super) const STEP_DAYS: f64 = 0.1;
/// Days in a year, for the season.
const YEAR: f64 = 365.25;

/// (days, log-load) over the whole life of a slope of that fate.
pub(super) fn of(fate: Fate, end: f64, generator: &mut impl Rng) -> Vec<(f64, f64)> {
    let mut knots = undeclared(end, generator);
    match fate {
        Fate::Seasonal => {
            let melts = melts(end, generator);
            add(&mut knots, |days| {
                melts.iter().map(|melt| melt.at(days)).sum()
            });
        }
        Fate::Stepped => {
            let steps = steps(end, generator);
            add(&mut knots, |days| {
                steps.iter().map(|step| step.at(days)).sum()
            });
        }
        Fate::Failing
        | Fate::Saturating
        | Fate::Steady
        | Fate::Settling
        | Fate::Reset
        | Fate::Noisy => {}
    }
    knots
}

fn add(knots: &mut [(f64, f64)], more: impl Fn(f64) -> f64) {
    for (days, load) in knots {
        *load += more(*days);
    }
}

/// (days, log-load) of a load that is a random process, under a weak season on every second slope.
pub(super) fn undeclared(end: f64, generator: &mut impl Rng) -> Vec<(f64, f64)> {
    let sigma = generator.random_range(0.0..0.25);
    let memory = log_uniform(generator, 3.0, 40.0);
    let season = if generator.random::<bool>() {
        generator.random_range(0.1..0.4)
    } else {
        0.0
    };
    let phase = generator.random_range(0.0..std::f64::consts::TAU);
    let keep = f64::exp(-STEP_DAYS / memory);
    let mut load = sigma * normal(generator);
    let mut knots = Vec::new();
    let mut index = 0_u32;
    loop {
        let days = STEP_DAYS * f64::from(index);
        let seasonal = season * (std::f64::consts::TAU * days / YEAR + phase).sin();
        knots.push((days, load + seasonal));
        if days > end {
            return knots;
        }
        load = load * keep + sigma * f64::sqrt(1.0 - keep * keep) * normal(generator);
        index += 1;
    }
}

/// One year's melt, or its autumn rain.
struct Melt {
    start: f64,
    /// Log-load at its peak.
    size: f64,
    rise: f64,
    fall: f64,
}

impl Melt {
    fn at(&self, days: f64) -> f64 {
        let since = days - self.start;
        if since <= 0.0 {
            return 0.0;
        }
        let shape = |t: f64| (1.0 - (-t / self.rise).exp()) * (-t / self.fall).exp();
        let peak = self.rise * (self.fall / self.rise).ln_1p();
        self.size * shape(since) / shape(peak)
    }
}

/// The melts of every year, no two alike, and on every second slope a shorter peak in autumn.
fn melts(end: f64, generator: &mut impl Rng) -> Vec<Melt> {
    let size = log_uniform(generator, 2.0, 10.0).ln();
    let (rise, fall) = (
        generator.random_range(4.0..15.0),
        generator.random_range(25.0..80.0),
    );
    let first = generator.random_range(-YEAR..0.0);
    let autumn = generator
        .random::<bool>()
        .then(|| size * generator.random_range(0.2..0.6));
    let mut melts = Vec::new();
    let mut spring = first;
    while spring < end {
        melts.push(Melt {
            start: spring + 10.0 * normal(generator),
            size: size * generator.random_range(0.6..1.0),
            rise,
            fall,
        });
        if let Some(size) = autumn {
            melts.push(Melt {
                start: spring + generator.random_range(120.0..190.0),
                size: size * generator.random_range(0.5..1.0),
                rise: generator.random_range(1.0..4.0),
                fall: generator.random_range(5.0..20.0),
            });
        }
        spring += YEAR;
    }
    melts
}

/// A load that is put on at once.
struct Step {
    at: f64,
    size: f64,
    holds: f64,
    /// After that it decays over so many days; `None`: it is taken off at once.
    decays: Option<f64>,
}

impl Step {
    fn at(&self, days: f64) -> f64 {
        let since = days - self.at;
        if since < 0.0 {
            return 0.0;
        }
        let left = since - self.holds;
        if left < 0.0 {
            return self.size;
        }
        self.decays
            .map_or(0.0, |decays| self.size * (-left / decays).exp())
    }
}

fn steps(end: f64, generator: &mut impl Rng) -> Vec<Step> {
    let count = generator.random_range(1..=3);
    let step = |_| Step {
        at: end * generator.random_range(0.1..0.95),
        size: log_uniform(generator, 3.0, 30.0).ln(),
        holds: log_uniform(generator, 1.0, 15.0),
        decays: generator
            .random::<bool>()
            .then(|| log_uniform(generator, 2.0, 30.0)),
    };
    (0..count).map(step).collect()
}

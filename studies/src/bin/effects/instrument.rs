//! Effects of the reading: offsets, temperature, means over an interval, noise that remembers.

use super::scene::{Planned, Scene};
use super::truth::TrueEffect;
use super::weather::{Covariate, Response, YEAR, moments};
use rand_pcg::Pcg64;
use slipwatch::effects::Kind;
use slipwatch::model::Load;
use studies::random::{count, happens, log_uniform_by_exp, normal, sign, uniform};

/// One effect of the reading; sizes are in standard deviations of the white noise.
#[derive(Debug, Clone)]
pub(crate) enum SceneInstrument {
    /// The reading jumps by so much.
    Offset { day: f64, noises: f64 },
    /// One value a reading, of unit variance, times so much.
    Thermal { shape: Vec<f64>, noises: f64 },
    /// A wave of the year that is 0 on that day and rises.
    Yearly { day: f64, noises: f64 },
    /// Velocities are means over so many days before.
    IntervalMean { window: f64 },
    /// AR(1) of this memory in days.
    Remembering { memory: f64, noises: f64 },
    /// A random walk whose step over `interval` days is so much.
    RandomWalk { interval: f64, noises: f64 },
}

/// Days between two readings' jumps, in intervals: closer ones are outliers.
const LEAST_BETWEEN_OFFSETS: f64 = 15.0;

/// Plans the effects of that kind; `None` where the scene has no place for them.
pub(crate) fn plan(rng: &mut Pcg64, scene: &Scene, kind: Kind) -> Option<Vec<Planned>> {
    match kind.name() {
        "offset" => offsets(rng, scene),
        "thermal" => thermal(rng, scene).map(|one| vec![one]),
        "seasonal-reading" => yearly(rng, scene).map(|one| vec![one]),
        "interval-mean" => Some(vec![interval_mean(rng, scene)]),
        "correlated-noise" => Some(vec![noise(rng, scene)]),
        _ => None,
    }
}

fn offsets(rng: &mut Pcg64, scene: &Scene) -> Option<Vec<Planned>> {
    let mut days: Vec<f64> = (0..count(rng, 1, 3))
        .map(|_| uniform(rng, 0.08, 0.92) * scene.length())
        .collect();
    days.sort_by(f64::total_cmp);
    let least = LEAST_BETWEEN_OFFSETS * scene.schedule.interval;
    if days.windows(2).any(|pair| pair[1] - pair[0] < least) {
        return None;
    }
    let mut planned = Vec::new();
    for day in days {
        let noises = sign(rng, 0.5) * log_uniform_by_exp(rng, 8.0, 40.0);
        let read = &scene.schedule.days;
        let before = read.partition_point(|one| *one < day) as f64 / read.len() as f64;
        let mut truth = TrueEffect::of(Kind::OFFSET);
        truth.at = scene.time(day);
        truth.unit = Some("mm".to_owned());
        truth.rms_over_noise = noises.abs() * (before * (1.0 - before)).sqrt();
        planned.push(Planned::instrument(
            SceneInstrument::Offset { day, noises },
            truth,
        ));
    }
    Some(planned)
}

fn thermal(rng: &mut Pcg64, scene: &Scene) -> Option<Planned> {
    let weather = scene
        .weather
        .iter()
        .find(|one| one.covariate == Covariate::Temperature)?;
    let mean_delay = if happens(rng, 0.3) {
        0.0
    } else {
        log_uniform_by_exp(rng, 0.5, 12.0) * scene.schedule.interval.max(weather.step)
    };
    let response = Response {
        mean_delay,
        shape: 1,
    };
    let load = Load::new(weather.responded(response)).ok()?;
    let felt: Vec<f64> = scene
        .schedule
        .days
        .iter()
        .map(|day| load.at(*day))
        .collect();
    let (mean, spread) = moments(&felt);
    if spread < 1e-6 {
        return None;
    }
    let noises = sign(rng, 0.5) * log_uniform_by_exp(rng, 3.0, 12.0);
    let mut truth = TrueEffect::of(Kind::THERMAL);
    truth.channel = Some(Covariate::Temperature.name().to_owned());
    truth.lag_days = Some(mean_delay);
    truth.response_shape = Some(1);
    truth.unit = Some("mm".to_owned());
    truth.rms_over_noise = noises.abs();
    let shape = felt.iter().map(|value| (value - mean) / spread).collect();
    Some(Planned::instrument(
        SceneInstrument::Thermal { shape, noises },
        truth,
    ))
}

fn yearly(rng: &mut Pcg64, scene: &Scene) -> Option<Planned> {
    let noises = log_uniform_by_exp(rng, 2.0, 8.0);
    let mut truth = TrueEffect::of(Kind::SEASONAL_READING);
    truth.period_days = Some(YEAR);
    truth.unit = Some("mm".to_owned());
    truth.rms_over_noise = noises * std::f64::consts::FRAC_1_SQRT_2;
    let day = uniform(rng, 0.0, YEAR);
    let planned = Planned::instrument(SceneInstrument::Yearly { day, noises }, truth);
    (scene.length() > 2.5 * YEAR).then_some(planned)
}

fn interval_mean(rng: &mut Pcg64, scene: &Scene) -> Planned {
    let window = log_uniform_by_exp(rng, 2.0, 20.0).round() * scene.schedule.interval;
    let mut truth = TrueEffect::of(Kind::INTERVAL_MEAN);
    truth.size = Some(window);
    truth.unit = Some("day".to_owned());
    Planned::instrument(SceneInstrument::IntervalMean { window }, truth)
}

fn noise(rng: &mut Pcg64, scene: &Scene) -> Planned {
    let mut truth = TrueEffect::of(Kind::CORRELATED_NOISE);
    let interval = scene.schedule.interval;
    if happens(rng, 0.3) {
        let noises = log_uniform_by_exp(rng, 0.3, 1.0);
        "random walk".clone_into(&mut truth.what);
        truth.rms_over_noise = noises * (scene.length() / interval / 6.0).sqrt();
        return Planned::instrument(SceneInstrument::RandomWalk { interval, noises }, truth);
    }
    let most = (scene.length() / interval / 12.0).clamp(6.0, 50.0);
    let memory = log_uniform_by_exp(rng, 5.0, most) * interval;
    let noises = log_uniform_by_exp(rng, 1.5, 4.0);
    "AR(1)".clone_into(&mut truth.what);
    truth.lag_days = Some(memory);
    truth.rms_over_noise = noises;
    Planned::instrument(SceneInstrument::Remembering { memory, noises }, truth)
}

impl SceneInstrument {
    /// What it adds to each reading, in standard deviations of the white noise; `None` for a mean over an
    /// interval, which adds nothing.
    pub(crate) fn adds(&self, rng: &mut Pcg64, days: &[f64]) -> Option<Vec<f64>> {
        match self {
            Self::Offset { day, noises } => {
                let jump = |one: &f64| if one >= day { *noises } else { 0.0 };
                Some(days.iter().map(jump).collect())
            }
            Self::Thermal { shape, noises } => Some(shape.iter().map(|one| one * noises).collect()),
            Self::Yearly { day, noises } => {
                let phase = |one: &f64| std::f64::consts::TAU * (one - day) / YEAR;
                Some(days.iter().map(|one| noises * phase(one).sin()).collect())
            }
            Self::IntervalMean { .. } => None,
            Self::Remembering { memory, noises } => Some(remembering(rng, days, *memory, *noises)),
            Self::RandomWalk { interval, noises } => {
                let mut sum = 0.0;
                let mut last = 0.0;
                let walk = days.iter().map(|day| {
                    let span: f64 = day - last;
                    last = *day;
                    sum += noises * (span / interval).sqrt() * normal(rng);
                    sum
                });
                Some(walk.collect())
            }
        }
    }

    pub(crate) fn is_noise(&self) -> bool {
        matches!(self, Self::Remembering { .. } | Self::RandomWalk { .. })
    }
}

/// A stationary AR(1) at any times.
fn remembering(rng: &mut Pcg64, days: &[f64], memory: f64, spread: f64) -> Vec<f64> {
    let mut value = 0.0;
    let mut last = f64::NEG_INFINITY;
    days.iter()
        .map(|day| {
            let keep = (-(day - last) / memory).exp();
            last = *day;
            value = value * keep + spread * (1.0 - keep * keep).sqrt() * normal(rng);
            value
        })
        .collect()
}

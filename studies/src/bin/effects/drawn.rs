//! One series with a known effect in it, from its seed.
//!
//! How draws are conditioned: everything is drawn again until the slope outlives the record, its velocity
//! spans no more than a factor of `MOST_SPAN`, and each effect inside the law would show by itself: the noise
//! is set so that what the best constant-load law leaves of the noiseless motion with that effect alone has
//! an rms of `SHOWS` times the noise (log-uniform, for the weakest effect), and draws in which this noise is no
//! noise of an instrument are dropped. Effects of the reading have their sizes in multiples of the noise.

use super::family::{Range, Recipe, SceneFamily};
use super::instrument::SceneInstrument;
use super::read::{self, SceneSlope};
use super::scene::{Place, Planned, Scene};
use super::slope::{Path, SlopeEffect, path};
use super::truth::{TrueLaw, TrueNoise, Truth};
use super::{ground, instrument};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use slipwatch::effects::{self, Kind};
use slipwatch::fit::{ConstantLoad, Exponent, PointReadings};
use slipwatch::reading::{Channel, Quantity, Sample, Series};
use studies::random::{happens, log_uniform_by_exp, uniform};

/// One drawn slope: the series to explain, what stands beside it, and the truth.
#[derive(Debug, Clone)]
pub(crate) struct Drawn {
    pub(crate) series: Series,
    pub(crate) channels: Vec<Channel>,
    pub(crate) neighbours: Vec<Series>,
    pub(crate) truth: Truth,
}

/// rms over noise of the weakest effect inside the law.
const SHOWS: (f64, f64) = (3.0, 30.0);
/// Noise over the whole motion, for displacements.
const SHARE_OF_MOTION: (f64, f64) = (2e-5, 1.0 / 40.0);
/// Noise over the velocity, for velocities.
const SHARE_OF_VELOCITY: (f64, f64) = (0.003, 0.15);
/// The fastest over the slowest velocity.
const MOST_SPAN: f64 = 300.0;
/// Of displacement noise, mm: an extensometer to a satellite receiver.
const NOISE_MM: (f64, f64) = (0.02, 3.0);
/// A slope that moves farther is none that is read, mm.
const FARTHEST_MM: f64 = 30_000.0;
/// Mm/day at the beginning, for slopes whose velocity is read.
const FIRST_VELOCITY: (f64, f64) = (0.02, 20.0);
/// And none that is faster still stands, mm/day.
const FASTEST: f64 = 800.0;
/// The chance that white noise has an AR(1) beside it that is no effect of the family.
const REMEMBERS: f64 = 0.12;
/// More draws than any family needs.
const MOST_DRAWS: u32 = 20_000;

/// The `index`-th series of a family; `None` if no draw meets the conditions.
pub(crate) fn drawn(family: SceneFamily, range: Range, index: u64) -> Option<Drawn> {
    let seed = family.seed(range, index);
    let mut rng = Pcg64::seed_from_u64(seed);
    // Before the draws, or what is easily shown would crowd out what is not.
    let recipe = family.recipe(&mut rng);
    (1..=MOST_DRAWS).find_map(|draws| {
        let mut one = attempt(&mut rng, family, &recipe)?;
        one.truth.seed = seed;
        one.truth.draws = draws;
        Some(one)
    })
}

/// The planned effects, by where they work.
struct Plan {
    effects: Vec<Planned>,
    /// Days of the mean that velocities are read as.
    window: Option<f64>,
}

impl Plan {
    fn slope_effects(&self) -> Vec<SlopeEffect> {
        let of = |one: &Planned| match &one.place {
            Place::SlopeEffect(ground) => Some(ground.clone()),
            Place::Instrument(_) => None,
        };
        self.effects.iter().filter_map(of).collect()
    }

    fn has(&self, kind: Kind) -> bool {
        self.effects.iter().any(|one| one.truth.effect == kind)
    }
}

fn plan(rng: &mut Pcg64, scene: &Scene, kinds: &[Kind]) -> Option<Plan> {
    let mut effects = Vec::new();
    for kind in kinds {
        if kind.is_of_the_reading() {
            effects.extend(instrument::plan(rng, scene, *kind)?);
        } else {
            effects.push(ground::plan(rng, scene, *kind)?);
        }
    }
    let window = effects.iter().find_map(|one| match one.place {
        Place::Instrument(SceneInstrument::IntervalMean { window }) => Some(window),
        Place::Instrument(_) | Place::SlopeEffect(_) => None,
    });
    Some(Plan { effects, window })
}

fn attempt(rng: &mut Pcg64, family: SceneFamily, recipe: &Recipe) -> Option<Drawn> {
    let mut scene = Scene::draw(rng, recipe)?;
    let mut plan = plan(rng, &scene, &recipe.kinds)?;
    let days = scene.schedule.days.clone();
    let whole = sound(path(&scene.law, &plan.slope_effects(), &days)?)?;
    let seen = match plan.window {
        None => whole.clone(),
        Some(window) => read::means(&scene, &plan.slope_effects(), window)?,
    };
    let noise = noise(rng, &scene, &mut plan, (&whole, &seen))?;
    let size = size(rng, &scene, &whole, noise)?;
    if let Some(window) = plan.window {
        scene.schedule.days.retain(|day| *day >= window);
    }
    let slope = SceneSlope {
        scene: &scene,
        seen: &seen,
        days: &days,
        mm: size,
        noise: noise
            * if scene.quantity == Quantity::Velocity {
                1.0
            } else {
                size
            },
    };
    let remembers =
        happens(rng, REMEMBERS) && !plan.has(Kind::CORRELATED_NOISE) && !plan.effects.is_empty();
    let background = remembers.then(|| SceneInstrument::Remembering {
        memory: uniform(rng, 2.0, 5.0) * scene.schedule.interval,
        noises: uniform(rng, 0.7, 1.2),
    });
    let instruments = plan.effects.iter().filter_map(|one| match &one.place {
        Place::Instrument(one) => Some(one),
        Place::SlopeEffect(_) => None,
    });
    let (series, prediction) = slope.read(rng, instruments.chain(&background))?;
    if !plan.slope_effects().is_empty() && !shows(&slope, &series, &prediction) {
        return None;
    }
    let (neighbours, groups) = read::neighbours(rng, &slope, plan.has(Kind::PARTITION))?;
    let truth = truth(family, &scene, plan, (&slope, background.as_ref()));
    let mut drawn = Drawn {
        channels: channels(&scene)?,
        series,
        neighbours,
        truth,
    };
    drawn.truth.prediction = prediction;
    drawn.truth.readings = drawn.series.readings.len();
    for effect in &mut drawn.truth.effects {
        if effect.effect == Kind::PARTITION {
            effect.groups.clone_from(&groups);
        }
    }
    (drawn.truth.readings >= 150).then_some(drawn)
}

/// A path of a slope that stands and moves forward.
fn sound(path: Path) -> Option<Path> {
    let fastest = path.velocity.iter().copied().fold(0.0, f64::max);
    let slowest = path.velocity.iter().copied().fold(f64::INFINITY, f64::min);
    (slowest > 0.0 && fastest / slowest < MOST_SPAN).then_some(path)
}

/// rms of what the best constant-load law leaves, in the unit of displacements or as a share of velocities.
fn left_by_the_plain_law(scene: &Scene, days: &[f64], path: &Path) -> Option<f64> {
    let values = match scene.quantity {
        Quantity::Displacement => &path.displacement,
        Quantity::Velocity => &path.velocity,
    };
    let readings = PointReadings::new(
        scene.quantity,
        days.iter().copied().zip(values.iter().copied()),
    );
    let rms = ConstantLoad::fit(&readings, Exponent::Free).best()?.rms;
    match scene.quantity {
        Quantity::Displacement => Some(rms),
        Quantity::Velocity => Some(rms / root_mean_square(values)),
    }
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// The noise's standard deviation, over the unit of the path or over the velocity, such that every effect of
/// the motion shows; writes down how much each does.
fn noise(
    rng: &mut Pcg64,
    scene: &Scene,
    plan: &mut Plan,
    (whole, seen): (&Path, &Path),
) -> Option<f64> {
    let days = &scene.schedule.days;
    let mut weakest = f64::INFINITY;
    for one in &mut plan.effects {
        let rms = match &one.place {
            Place::SlopeEffect(ground) => {
                let alone = path(&scene.law, std::slice::from_ref(ground), days)?;
                left_by_the_plain_law(scene, days, &alone)?
            }
            Place::Instrument(SceneInstrument::IntervalMean { .. }) => {
                let blurred = whole.velocity.iter().zip(&seen.velocity);
                let change: Vec<f64> = blurred
                    .map(|(at_once, mean)| mean / at_once - 1.0)
                    .collect();
                root_mean_square(&change).min(left_by_the_plain_law(scene, days, seen)?)
            }
            Place::Instrument(_) => continue,
        };
        one.truth.rms_over_noise = rms;
        weakest = weakest.min(rms);
    }
    let (least, most) = match scene.quantity {
        Quantity::Displacement => {
            let motion = whole.displacement.last()?;
            (motion * SHARE_OF_MOTION.0, motion * SHARE_OF_MOTION.1)
        }
        Quantity::Velocity => SHARE_OF_VELOCITY,
    };
    let noise = if weakest.is_finite() {
        weakest / log_uniform_by_exp(rng, SHOWS.0, SHOWS.1)
    } else {
        log_uniform_by_exp(rng, most / 50.0, most)
    };
    for one in &mut plan.effects {
        if !matches!(&one.place, Place::Instrument(one) if !matches!(one, SceneInstrument::IntervalMean { .. }))
        {
            one.truth.rms_over_noise /= noise;
        }
    }
    (noise > least && noise < most).then_some(noise)
}

/// Whether the plain law leaves as much of the readings without noise as the weakest effect must show, fitted by the second of the
/// program's searches too: where the first ends in a poor law, an effect seems to show that the better law accounts for.
fn shows(slope: &SceneSlope, series: &Series, prediction: &[f64]) -> bool {
    let mut noiseless = series.clone();
    for (reading, value) in noiseless.readings.iter_mut().zip(prediction) {
        reading.value = *value;
    }
    let left = effects::error_given(&noiseless, &[], &[], None, &effects::Options::default());
    let noise = match slope.scene.quantity {
        Quantity::Displacement => slope.noise,
        Quantity::Velocity => slope.noise * root_mean_square(prediction),
    };
    left.and_then(|error| error.fit.before)
        .is_some_and(|left| left >= SHOWS.0 * noise)
}

/// How many mm the slope slips where its path slips 1.
fn size(rng: &mut Pcg64, scene: &Scene, whole: &Path, noise: f64) -> Option<f64> {
    let mm = match scene.quantity {
        Quantity::Displacement => log_uniform_by_exp(rng, NOISE_MM.0, NOISE_MM.1) / noise,
        Quantity::Velocity => log_uniform_by_exp(rng, FIRST_VELOCITY.0, FIRST_VELOCITY.1),
    };
    let fastest = whole.velocity.iter().copied().fold(0.0, f64::max);
    (whole.displacement.last()? * mm < FARTHEST_MM && fastest * mm < FASTEST).then_some(mm)
}

fn channels(scene: &Scene) -> Option<Vec<Channel>> {
    let channel = |weather: &super::weather::SceneWeather| {
        let samples = weather.recorded().map(|(day, value)| {
            let time = scene.time(day)?;
            Some(Sample { time, value })
        });
        Some(Channel {
            name: weather.covariate.name().to_owned(),
            unit: Some(weather.covariate.unit().to_owned()),
            stated: None,
            samples: samples.collect::<Option<_>>()?,
        })
    };
    let mut channels: Vec<Channel> = scene.weather.iter().map(channel).collect::<Option<_>>()?;
    channels.sort_by(|one, other| one.name.cmp(&other.name));
    Some(channels)
}

fn truth(
    family: SceneFamily,
    scene: &Scene,
    plan: Plan,
    (slope, background): (&SceneSlope, Option<&SceneInstrument>),
) -> Truth {
    let mut noise = TrueNoise {
        white: slope.noise,
        correlated: 0.0,
        memory_days: None,
        is_share_of_velocity: scene.quantity == Quantity::Velocity,
    };
    let instruments = plan.effects.iter().filter_map(|one| match &one.place {
        Place::Instrument(one) => Some(one),
        Place::SlopeEffect(_) => None,
    });
    for one in instruments.chain(background) {
        match one {
            SceneInstrument::Remembering { memory, noises } => {
                noise.correlated = noises * slope.noise;
                noise.memory_days = Some(*memory);
            }
            SceneInstrument::RandomWalk { noises, .. } => noise.correlated = noises * slope.noise,
            SceneInstrument::Offset { .. }
            | SceneInstrument::Thermal { .. }
            | SceneInstrument::Yearly { .. }
            | SceneInstrument::IntervalMean { .. } => {}
        }
    }
    let effects = plan.effects.into_iter().map(|one| {
        let mut truth = one.truth;
        match one.place {
            Place::Instrument(
                SceneInstrument::Offset { noises, .. }
                | SceneInstrument::Thermal { noises, .. }
                | SceneInstrument::Yearly { noises, .. },
            ) => {
                let gain = noises * slope.noise;
                truth.gain_per_sd = (truth.effect == Kind::THERMAL).then_some(gain);
                let has_size = [Kind::OFFSET, Kind::SEASONAL_READING].contains(&truth.effect);
                truth.size = has_size.then_some(gain);
            }
            // Where the slope slips so many mm instead of 1, the load falls by so much less for each.
            Place::SlopeEffect(
                SlopeEffect::RateLimit { eta: per_mm } | SlopeEffect::Geometry { k: per_mm },
            ) => {
                truth.size = Some(per_mm / slope.mm);
            }
            Place::SlopeEffect(_) | Place::Instrument(_) => {}
        }
        truth
    });
    Truth {
        family: family.name().to_owned(),
        seed: 0,
        effects: effects.collect(),
        background_noise_remembers: background.is_some(),
        law: TrueLaw::scaled(&scene.law, slope.mm),
        noise,
        interval_days: scene.schedule.interval,
        length_days: scene.length(),
        readings: 0,
        draws: 0,
        prediction: Vec::new(),
    }
}

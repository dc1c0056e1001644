//! Effects inside the law, drawn for a scene: loads, jumps of the state, changes of the friction, loads that
//! follow the motion, and loads that no label fits.

use super::laws;
use super::scene::{Place, Planned, Scene};
use super::slope::{SlopeEffect, path};
use super::truth::TrueEffect;
use super::weather::{Covariate, Response, SceneWeather, YEAR, moments};
use rand_pcg::Pcg64;
use slipwatch::effects::{Form, Kind};
use slipwatch::model::Load;
use std::f64::consts::TAU;
use studies::random::{happens, log_uniform_by_exp, normal, one_of, sign, uniform};

/// Days of the principal lunar and solar tides and of the lunar diurnal one.
const M2: f64 = 12.420_601_2 / 24.0;
const S2: f64 = 0.5;
const O1: f64 = 25.819_342 / 24.0;

/// Plans an effect of that kind; `None` where the scene has no place for it.
pub(crate) fn plan(rng: &mut Pcg64, scene: &Scene, kind: Kind) -> Option<Planned> {
    match kind.name() {
        "hydrological" => hydrological(rng, scene),
        "seasonal" => seasonal(rng, scene),
        "tide" => tide(rng, scene),
        "load-step" => Some(load_step(rng, scene)),
        "state-reset" => Some(state_reset(rng, scene)),
        "friction-change" => Some(friction_change(rng, scene)),
        "rate-limit" => Some(rate_limit(rng)),
        "geometry" => Some(geometry(rng, scene)),
        "unexplained" => outside(rng, scene),
        "partition" => Some(parting(rng, scene)),
        _ => None,
    }
}

fn hydrological(rng: &mut Pcg64, scene: &Scene) -> Option<Planned> {
    // The scene's first covariate is the one that was asked for.
    let weather = scene.weather.first()?;
    let mut planned = driven(rng, scene, weather)?;
    planned.truth.channel = Some(weather.covariate.name().to_owned());
    Some(planned)
}

/// The load that a covariate's response brings.
fn driven(rng: &mut Pcg64, scene: &Scene, weather: &SceneWeather) -> Option<Planned> {
    let response = Response {
        mean_delay: scene.mean_delay(rng, weather.step),
        shape: one_of(rng, &[(0.6, 1), (0.2, 2), (0.2, 3)]),
    };
    let is_reservoir = weather.covariate == Covariate::Reservoir;
    let form = if is_reservoir && happens(rng, 0.5) {
        Form::Rate
    } else {
        Form::Level
    };
    // Water in the slope speeds it up; a reservoir before it may do either, by drawing down more often.
    let (felt, sign) = match form {
        Form::Rate => (weather.responded_by_rate(response), sign(rng, 0.3)),
        Form::Level if is_reservoir => (weather.responded(response), sign(rng, 0.7)),
        Form::Level => (weather.responded(response), 1.0),
    };
    let at_readings = Load::new(felt.clone()).ok()?;
    let values: Vec<f64> = scene
        .schedule
        .days
        .iter()
        .map(|day| at_readings.at(*day))
        .collect();
    let (mean, spread) = moments(&values);
    if spread <= 0.0 {
        return None;
    }
    let gain = sign * log_uniform_by_exp(rng, 0.3, 1.2);
    let knots = felt
        .into_iter()
        .map(|(day, value)| (day, gain * (value - mean) / spread))
        .collect();
    let mut truth = TrueEffect::of(Kind::HYDROLOGICAL);
    truth.form = Some(form);
    truth.lag_days = Some(response.mean_delay);
    truth.response_shape = Some(response.shape);
    truth.gain_per_sd = Some(gain);
    Some(Planned::ground(SlopeEffect::Load(knots), truth))
}

/// A load at every `step` days.
fn sampled(scene: &Scene, step: f64, f: impl Fn(f64) -> f64) -> SlopeEffect {
    let mut knots = Vec::new();
    let mut day = 0.0;
    while day < scene.length() + step {
        knots.push((day, f(day)));
        day += step;
    }
    SlopeEffect::Load(knots)
}

fn seasonal(rng: &mut Pcg64, scene: &Scene) -> Option<Planned> {
    let (yearly, phase) = (log_uniform_by_exp(rng, 0.25, 1.0), uniform(rng, 0.0, TAU));
    let half = if happens(rng, 0.5) {
        yearly * uniform(rng, 0.1, 0.4)
    } else {
        0.0
    };
    let other = uniform(rng, 0.0, TAU);
    let load = sampled(scene, 2.0, |day| {
        let angle = TAU * day / YEAR;
        yearly * (angle + phase).sin() + half * (2.0 * angle + other).sin()
    });
    let mut truth = TrueEffect::of(Kind::SEASONAL);
    truth.period_days = Some(YEAR);
    truth.size = Some(yearly);
    (scene.length() > 2.5 * YEAR).then(|| Planned::ground(load, truth))
}

fn tide(rng: &mut Pcg64, scene: &Scene) -> Option<Planned> {
    let lunar = log_uniform_by_exp(rng, 0.2, 0.8);
    let parts = [
        (M2, lunar),
        (S2, lunar * uniform(rng, 0.2, 0.5)),
        (O1, lunar * uniform(rng, 0.15, 0.6)),
    ]
    .map(|(period, size)| (period, size, uniform(rng, 0.0, TAU)));
    let load = sampled(scene, 1.0 / 96.0, |day| {
        parts
            .iter()
            .map(|(period, size, phase)| size * (TAU * day / period + phase).sin())
            .sum()
    });
    let mut truth = TrueEffect::of(Kind::TIDE);
    truth.period_days = Some(M2);
    truth.size = Some(lunar);
    (scene.schedule.interval < M2 / 4.0).then(|| Planned::ground(load, truth))
}

fn step_of(rng: &mut Pcg64) -> f64 {
    sign(rng, 0.5) * log_uniform_by_exp(rng, 0.4, 1.5)
}

fn load_step(rng: &mut Pcg64, scene: &Scene) -> Planned {
    let (day, size) = (scene.some_day(rng), step_of(rng));
    let mut truth = TrueEffect::of(Kind::LOAD_STEP);
    truth.at = scene.time(day);
    truth.size = Some(size);
    let knots = vec![(0.0, 0.0), (day, 0.0), (day, size)];
    Planned::ground(SlopeEffect::Load(knots), truth)
}

fn state_reset(rng: &mut Pcg64, scene: &Scene) -> Planned {
    let day = scene.some_day(rng);
    let factor = loop {
        let factor: f64 = log_uniform_by_exp(rng, 0.3, 3.0);
        if factor.ln().abs() > 0.25 {
            break factor;
        }
    };
    let mut truth = TrueEffect::of(Kind::STATE_RESET);
    truth.at = scene.time(day);
    truth.size = Some(factor);
    Planned::ground(SlopeEffect::StateReset { day, factor }, truth)
}

fn friction_change(rng: &mut Pcg64, scene: &Scene) -> Planned {
    let day = scene.some_day(rng);
    let law = laws::draw(rng, &laws::ANY, scene.length() - day);
    let mut truth = TrueEffect::of(Kind::FRICTION_CHANGE);
    truth.at = scene.time(day);
    truth.what = format!(
        "after it r = {:.4e}, kappa = {:.4e}, p = {:.4} from y = 1, the velocity as it was",
        law.r, law.kappa, law.p
    );
    Planned::ground(SlopeEffect::FrictionChange { day, law }, truth)
}

fn rate_limit(rng: &mut Pcg64) -> Planned {
    let eta = log_uniform_by_exp(rng, 0.02, 0.6);
    let mut truth = TrueEffect::of(Kind::RATE_LIMIT);
    truth.size = Some(eta);
    truth.unit = Some("day/mm".to_owned());
    Planned::ground(SlopeEffect::RateLimit { eta }, truth)
}

fn geometry(rng: &mut Pcg64, scene: &Scene) -> Planned {
    let alone = path(&scene.law, &[], &[0.0, scene.length()]);
    let slip = alone.map_or(scene.length(), |path| path.displacement[1]);
    let k = log_uniform_by_exp(rng, 0.5, 8.0) / slip;
    let mut truth = TrueEffect::of(Kind::GEOMETRY);
    truth.size = Some(k);
    truth.unit = Some("1/mm".to_owned());
    Planned::ground(SlopeEffect::Geometry { k }, truth)
}

/// What makes one group leave the other.
fn parting(rng: &mut Pcg64, scene: &Scene) -> Planned {
    let mut planned = match one_of(rng, &[(0.6, 0), (0.2, 1), (0.2, 2)]) {
        0 => load_step(rng, scene),
        1 => state_reset(rng, scene),
        _ => friction_change(rng, scene),
    };
    planned.truth.what = format!("by a {}: {}", planned.truth.effect, planned.truth.what);
    planned.truth.effect = Kind::PARTITION;
    planned
}

/// A load outside the table.
fn outside(rng: &mut Pcg64, scene: &Scene) -> Option<Planned> {
    let length = scene.length();
    let size = sign(rng, 0.5) * log_uniform_by_exp(rng, 0.5, 1.5);
    let mut truth = TrueEffect::of(Kind::UNEXPLAINED);
    truth.size = Some(size);
    let fine = length / 2000.0;
    let (what, load) = match one_of(rng, &[(1.0, 0), (1.0, 1), (1.0, 2), (1.0, 3), (1.0, 4)]) {
        0 => {
            let (from, span) = (
                uniform(rng, 0.15, 0.5) * length,
                uniform(rng, 0.15, 0.4) * length,
            );
            let knots = vec![(0.0, 0.0), (from, 0.0), (from + span, size)];
            ("a ramp of the load", SlopeEffect::Load(knots))
        }
        1 => {
            let (centre, width) = (scene.some_day(rng), uniform(rng, 0.03, 0.1) * length);
            let pulse = |day: f64| size * (-0.5 * ((day - centre) / width).powi(2)).exp();
            ("a pulse of the load", sampled(scene, fine, pulse))
        }
        2 => {
            let mut walk = 0.0;
            let steps: Vec<f64> = (0..400).map(|_| normal(rng)).collect();
            let knots = steps.iter().enumerate().map(|(index, step)| {
                walk += size * step / 20.0;
                (length * index as f64 / 399.0, walk)
            });
            (
                "a random walk of the load",
                SlopeEffect::Load(knots.collect()),
            )
        }
        3 => {
            let phase = uniform(rng, 0.0, TAU);
            let (slow, fast) = (uniform(rng, 1.5, 3.0), uniform(rng, 8.0, 20.0));
            let chirp = |day: f64| {
                let s = day / length;
                0.7 * size * (TAU * s * (slow + 0.5 * (fast - slow) * s) + phase).sin()
            };
            ("a chirp of the load", sampled(scene, fine, chirp))
        }
        _ => {
            // A reservoir's year could be distinguished from none of the table's.
            let covariate = one_of(rng, &Covariate::WATER_WITHOUT_A_YEAR);
            let hidden = SceneWeather::draw(rng, covariate, length);
            let planned = driven(rng, scene, &hidden)?;
            truth = planned.truth;
            truth.effect = Kind::UNEXPLAINED;
            let Place::SlopeEffect(load) = planned.place else {
                return None;
            };
            ("a driver whose channel is not given", load)
        }
    };
    what.clone_into(&mut truth.what);
    truth.at = None;
    Some(Planned::ground(load, truth))
}

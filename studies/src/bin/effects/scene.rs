//! One slope before it is read: its law, the times, the weather, and the effects planned for it.

use super::family::Recipe;
use super::instrument::SceneInstrument;
use super::laws;
use super::schedule::Schedule;
use super::slope::SlopeEffect;
use super::truth::TrueEffect;
use super::weather::{Covariate, SceneWeather};
use rand_pcg::Pcg64;
use slipwatch::effects::Kind;
use slipwatch::model::Law;
use slipwatch::reading::{Quantity, Timestamp, after_days};
use studies::random::{count, happens, log_uniform_by_exp, one_of, uniform};

/// The slope and what is around it. Its law has unit velocity; the noise gives it a size later.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    pub(crate) schedule: Schedule,
    pub(crate) quantity: Quantity,
    pub(crate) law: Law,
    pub(crate) weather: Vec<SceneWeather>,
    pub(crate) first: Timestamp,
}

/// Where an effect works.
#[derive(Debug, Clone)]
pub(crate) enum Place {
    SlopeEffect(SlopeEffect),
    Instrument(SceneInstrument),
}

/// An effect and what is to be said of it.
#[derive(Debug, Clone)]
pub(crate) struct Planned {
    pub(crate) place: Place,
    pub(crate) truth: TrueEffect,
}

impl Planned {
    pub(crate) fn ground(ground: SlopeEffect, truth: TrueEffect) -> Self {
        let place = Place::SlopeEffect(ground);
        Self { place, truth }
    }

    pub(crate) fn instrument(instrument: SceneInstrument, truth: TrueEffect) -> Self {
        let place = Place::Instrument(instrument);
        Self { place, truth }
    }
}

impl Scene {
    pub(crate) fn draw(rng: &mut Pcg64, recipe: &Recipe) -> Option<Self> {
        let schedule = Schedule::draw(rng, recipe.need)?;
        let length = schedule.length();
        let quantity = if happens(rng, recipe.chance_of_velocity) {
            Quantity::Velocity
        } else {
            Quantity::Displacement
        };
        let law = laws::draw(rng, recipe.characters, length);
        let covariates = covariates(rng, &recipe.kinds);
        let weather = covariates
            .into_iter()
            .map(|covariate| SceneWeather::draw(rng, covariate, length))
            .collect();
        let beginning = Timestamp::from_second(1_325_376_000).ok()?;
        Some(Self {
            quantity,
            law,
            weather,
            first: after_days(beginning, uniform(rng, 0.0, 3650.0).floor())?,
            schedule,
        })
    }

    pub(crate) fn length(&self) -> f64 {
        self.schedule.length()
    }

    /// A day in the middle of the record.
    pub(crate) fn some_day(&self, rng: &mut Pcg64) -> f64 {
        uniform(rng, 0.2, 0.8) * self.length()
    }

    pub(crate) fn time(&self, day: f64) -> Option<Timestamp> {
        after_days(self.first, day)
    }

    pub(crate) fn mean_delay(&self, rng: &mut Pcg64, step: f64) -> f64 {
        let least = self.schedule.interval.max(step);
        let most = (self.length() / 8.0).min(60.0);
        log_uniform_by_exp(rng, least.min(most), most)
    }
}

/// One to four, among them what the kinds need.
fn covariates(rng: &mut Pcg64, kinds: &[Kind]) -> Vec<Covariate> {
    let mut chosen = Vec::new();
    if kinds.contains(&Kind::HYDROLOGICAL) {
        chosen.push(one_of(rng, &Covariate::WATER));
    }
    if kinds.contains(&Kind::THERMAL) {
        chosen.push(Covariate::Temperature);
    }
    let wanted = count(rng, 1, 4).max(chosen.len());
    while chosen.len() < wanted {
        let one = one_of(rng, &Covariate::ALL.map(|one| (1.0, one)));
        if !chosen.contains(&one) {
            chosen.push(one);
        }
    }
    chosen
}

//! Covariates beside a slope: rain, a reservoir's level, a river's flow, air temperature, pore pressure.
//!
//! Each has a weather of its own, so that none is related to another but by the season.

use rand_pcg::Pcg64;
use std::f64::consts::TAU;
use studies::random::{happens, log_uniform_by_exp, normal, one_of, sign, uniform};

pub(crate) const YEAR: f64 = 365.25;
/// Days before the first reading over which the hidden weather runs, so that the slowest response has settled.
const WARM_UP: f64 = 240.0;

/// What a channel measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Covariate {
    Rain,
    Reservoir,
    River,
    Temperature,
    PorePressure,
}

impl Covariate {
    pub(crate) const ALL: [Self; 5] = [
        Self::Rain,
        Self::Reservoir,
        Self::River,
        Self::Temperature,
        Self::PorePressure,
    ];
    /// Those that water makes.
    pub(crate) const WATER: [(f64, Self); 4] = [
        (0.3, Self::Rain),
        (0.3, Self::Reservoir),
        (0.2, Self::River),
        (0.2, Self::PorePressure),
    ];

    /// Those of them that have hardly a season.
    pub(crate) const WATER_WITHOUT_A_YEAR: [(f64, Self); 2] =
        [(0.5, Self::Rain), (0.5, Self::PorePressure)];

    /// The channel's name, unit last.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Rain => "rain_mm",
            Self::Reservoir => "reservoir_level_m",
            Self::River => "river_flow_m3_s",
            Self::Temperature => "air_temperature_c",
            Self::PorePressure => "pore_pressure_kpa",
        }
    }

    pub(crate) fn unit(self) -> &'static str {
        match self {
            Self::Rain => "mm",
            Self::Reservoir => "m",
            Self::River => "m3_s",
            Self::Temperature => "c",
            Self::PorePressure => "kpa",
        }
    }
}

/// A covariate on an even grid.
#[derive(Debug, Clone)]
pub(crate) struct SceneWeather {
    pub(crate) covariate: Covariate,
    /// Days of the first value, before the first reading.
    start: f64,
    /// Days between values.
    pub(crate) step: f64,
    pub(crate) values: Vec<f64>,
    /// Days from which the channel is recorded.
    recorded_from: f64,
}

/// How a covariate's response is delayed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Response {
    /// Days.
    pub(crate) mean_delay: f64,
    /// 1 is an exponential response, more a gamma of this shape.
    pub(crate) shape: usize,
}

impl SceneWeather {
    /// For a record of `length` days, read as finely as its length allows.
    pub(crate) fn draw(rng: &mut Pcg64, covariate: Covariate, length: f64) -> Self {
        let step = if length <= 100.0 {
            1.0 / 24.0
        } else if length <= 500.0 {
            0.25
        } else {
            1.0
        };
        let start = -(WARM_UP / step).round() * step;
        let count = Grid::count((length - start) / step);
        let grid = Grid { start, step, count };
        let values = match covariate {
            Covariate::Rain => grid.rain(rng),
            Covariate::Reservoir => grid.reservoir(rng),
            Covariate::River => grid.river(rng),
            Covariate::Temperature => grid.temperature(rng),
            Covariate::PorePressure => grid.pore_pressure(rng),
        };
        let lead = if happens(rng, 0.7) {
            uniform(rng, 0.2, 1.0) * 180.0_f64.min(length)
        } else {
            0.0
        };
        Self {
            covariate,
            start,
            step,
            values,
            recorded_from: -lead,
        }
    }

    /// (days, value) as it is recorded.
    pub(crate) fn recorded(&self) -> impl Iterator<Item = (f64, f64)> {
        let from = self.recorded_from - 1e-9;
        self.on_days(&self.values)
            .filter(move |(day, _)| *day >= from)
    }

    /// (days, value) of what the covariate's values bring about; the whole of the hidden past counts.
    pub(crate) fn responded(&self, response: Response) -> Vec<(f64, f64)> {
        let delayed = delay(&self.values, self.step, response);
        self.on_days(&delayed)
            .filter(|(day, _)| *day >= -self.step)
            .collect()
    }

    /// The same of its change per day.
    pub(crate) fn responded_by_rate(&self, response: Response) -> Vec<(f64, f64)> {
        let mut rates: Vec<f64> = self
            .values
            .windows(2)
            .map(|pair| (pair[1] - pair[0]) / self.step)
            .collect();
        rates.insert(0, rates.first().copied().unwrap_or(0.0));
        let delayed = delay(&rates, self.step, response);
        self.on_days(&delayed)
            .filter(|(day, _)| *day >= -self.step)
            .collect()
    }

    fn on_days<'a>(&'a self, values: &'a [f64]) -> impl Iterator<Item = (f64, f64)> + 'a {
        values
            .iter()
            .enumerate()
            .map(|(index, value)| (self.start + self.step * index as f64, *value))
    }
}

/// Values after a chain of `shape` equal stores whose mean delays add up.
fn delay(values: &[f64], step: f64, response: Response) -> Vec<f64> {
    let keep = (-step * response.shape as f64 / response.mean_delay).exp();
    let mut delayed = values.to_vec();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    for _ in 0..response.shape {
        let mut store = mean;
        for value in &mut delayed {
            store = store * keep + *value * (1.0 - keep);
            *value = store;
        }
    }
    delayed
}

/// Mean and standard deviation.
pub(crate) fn moments(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f64>()
        / count;
    (mean, variance.sqrt())
}

struct Grid {
    start: f64,
    step: f64,
    count: usize,
}

impl Grid {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a record has some ten thousand steps"
    )]
    fn count(steps: f64) -> usize {
        steps.ceil() as usize + 2
    }

    fn season(&self, index: usize, phase: f64) -> f64 {
        (TAU * (self.start + self.step * index as f64) / YEAR + phase).sin()
    }

    /// Spells of rain, more of it in one half of the year; mm in a step.
    fn rain(&self, rng: &mut Pcg64) -> Vec<f64> {
        let dry_days = log_uniform_by_exp(rng, 2.0, 8.0);
        let wet_days = log_uniform_by_exp(rng, 0.4, 1.5);
        let mm_per_day = log_uniform_by_exp(rng, 6.0, 25.0);
        let (phase, swing) = (uniform(rng, 0.0, TAU), uniform(rng, 0.0, 0.5));
        let mut is_wet = false;
        let mut heaviness = 1.0;
        (0..self.count)
            .map(|index| {
                let wetness = 1.0 + swing * self.season(index, phase);
                let spell = if is_wet { wet_days } else { dry_days / wetness };
                if happens(rng, 1.0 - (-self.step / spell).exp()) {
                    is_wet = !is_wet;
                    heaviness = (0.8 * normal(rng)).exp();
                }
                if !is_wet {
                    return 0.0;
                }
                let amount = mm_per_day * heaviness * self.step * (0.5 * normal(rng)).exp();
                (amount * 10.0).round() / 10.0
            })
            .collect()
    }

    /// A year's filling and emptying, with the operators' own slower and faster changes.
    fn reservoir(&self, rng: &mut Pcg64) -> Vec<f64> {
        let phase = uniform(rng, 0.0, TAU);
        let (metres, own_share) = (log_uniform_by_exp(rng, 3.0, 20.0), uniform(rng, 0.25, 0.7));
        let memory = log_uniform_by_exp(rng, 4.0, 30.0);
        let own = self.random_process(rng, memory, 2);
        (0..self.count)
            .map(|index| {
                let level = self.season(index, phase) + 0.25 * self.season(2 * index, 2.0 * phase);
                650.0 + metres * (level * (1.0 - own_share) + own[index] * own_share)
            })
            .map(|level| (level * 100.0).round() / 100.0)
            .collect()
    }

    /// Floods that recede over a base flow with a season of its own.
    fn river(&self, rng: &mut Pcg64) -> Vec<f64> {
        let rain = self.rain(rng);
        let recession = Response {
            mean_delay: log_uniform_by_exp(rng, 1.5, 10.0),
            shape: 1,
        };
        let floods = delay(&rain, self.step, recession);
        let (mean, _) = moments(&floods);
        let base = log_uniform_by_exp(rng, 2.0, 60.0);
        let (phase, swing) = (uniform(rng, 0.0, TAU), uniform(rng, 0.1, 0.6));
        (0..self.count)
            .map(|index| {
                let snow = 1.0 + swing * self.season(index, phase);
                let flow = base * (snow + floods[index] / mean.max(1e-9));
                flow * (0.02 * normal(rng)).exp()
            })
            .collect()
    }

    /// The year, the day where the grid shows it, and a few days' weather.
    fn temperature(&self, rng: &mut Pcg64) -> Vec<f64> {
        let (yearly, daily) = (uniform(rng, 6.0, 12.0), uniform(rng, 2.0, 6.0));
        let memory = log_uniform_by_exp(rng, 1.5, 5.0);
        let weather = self.random_process(rng, memory, 1);
        let (mean, spread) = (uniform(rng, 2.0, 12.0), uniform(rng, 2.0, 4.0));
        let (phase, hour) = (uniform(rng, 0.0, TAU), uniform(rng, 0.0, TAU));
        (0..self.count)
            .map(|index| {
                let day = self.start + self.step * index as f64;
                let diurnal = if self.step < 1.0 {
                    (TAU * day + hour).sin()
                } else {
                    0.0
                };
                mean + yearly * self.season(index, phase)
                    + daily * diurnal
                    + spread * weather[index]
            })
            .map(|degrees| (degrees * 10.0).round() / 10.0)
            .collect()
    }

    /// Water seeping in from a rain that no gauge here has seen.
    fn pore_pressure(&self, rng: &mut Pcg64) -> Vec<f64> {
        let rain = self.rain(rng);
        let seepage = Response {
            mean_delay: log_uniform_by_exp(rng, 4.0, 40.0),
            shape: one_of(rng, &[(0.5, 1), (0.5, 2)]),
        };
        let seeped = delay(&rain, self.step, seepage);
        let (mean, spread) = moments(&seeped);
        let (base, swing) = (
            uniform(rng, 20.0, 120.0),
            log_uniform_by_exp(rng, 1.0, 10.0),
        );
        seeped
            .iter()
            .map(|value| {
                base + swing * (value - mean) / spread.max(1e-9) + 0.02 * swing * normal(rng)
            })
            .collect()
    }

    /// Noise of unit variance smoothed by stores of `memory` days.
    fn random_process(&self, rng: &mut Pcg64, memory: f64, shape: usize) -> Vec<f64> {
        let noise: Vec<f64> = (0..self.count).map(|_| normal(rng)).collect();
        let response = Response {
            mean_delay: memory * shape as f64,
            shape,
        };
        let smooth = delay(&noise, self.step, response);
        let (mean, spread) = moments(&smooth);
        let turn = sign(rng, 0.5);
        smooth
            .iter()
            .map(|value| turn * (value - mean) / spread)
            .collect()
    }
}

//! One inversion as it is reported: the best fit, what the readings leave open, and what follows from it.
//!
//! The best fit and the alternatives are those of the constant-load law by unweighted least squares. The regime comes from the
//! posterior twice: where the load may change, as the monitor has it, and in its special case of a constant load, of which the
//! intervals of the parameters are too; where m is given, of the laws of that posterior with about this m alone. The failure time
//! comes from the panel that the monitor uses.

mod estimate;
mod growth;
mod held;
mod remarks;
mod report;
mod sweep;
mod together;

pub use estimate::{Estimate, Parameters};
pub use report::{
    Alternative, Alternatives, FitReport, FittedFailureTime, FittedInverseVelocity, FittedRegime,
    UnderPrior,
};
pub use sweep::{SweepOptions, SweepReport, SweepRow, sweep, sweep_showing};
pub use together::{ApartReport, GroupReport, TogetherReport, together};

use crate::fit::{
    Assumptions, ConstantLoad, Exponent, LawDraws, Observations, PointReadings, Rate, Solution,
    widen_merged,
};
use crate::forecast::{FARTHEST_INTERCEPT, HORIZON_DAYS, InverseVelocityLine, outlook};
use crate::model::{Accuracy, Law, Trajectory};
use crate::reading::{LengthUnit, Quantity, Series, TimeUnit, Timestamp, Unit, after_days};
use jiff::SignedDuration;

/// What is asked of an inversion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InversionOptions {
    /// First instant of the readings used.
    pub from: Option<Timestamp>,
    /// Last instant of the readings used.
    pub until: Option<Timestamp>,
    /// Whether m is fitted or given.
    pub exponent: Exponent,
    /// Passing this velocity is failure, mm/day.
    pub critical_velocity_mm_per_day: f64,
    /// How long it takes to bring everyone out; for the text only.
    pub evacuation_time: SignedDuration,
    /// How far the forecast looks, days; at most [`HORIZON_DAYS`].
    pub horizon_days: f64,
}

impl Default for InversionOptions {
    fn default() -> Self {
        Self {
            from: None,
            until: None,
            exponent: Exponent::Free,
            critical_velocity_mm_per_day: 1000.0,
            evacuation_time: SignedDuration::from_hours(24),
            horizon_days: HORIZON_DAYS,
        }
    }
}

/// The readings of one inversion, chosen and in the science's units.
#[derive(Debug, Clone)]
pub struct Inversion {
    series: Series,
    observations: Observations,
    options: InversionOptions,
}

impl Inversion {
    /// Chooses the readings that `options` ask for; what is not finite is left out.
    pub fn new(series: &Series, options: &InversionOptions) -> Self {
        let mut chosen = Series {
            readings: Vec::new(),
            ..series.clone()
        };
        let inside = |time: Timestamp| {
            options.from.is_none_or(|from| time >= from)
                && options.until.is_none_or(|until| time <= until)
        };
        let sound = |value: f64| (value * series.unit.factor()).is_finite();
        let readings = series.readings.iter();
        chosen.readings = readings
            .filter(|reading| inside(reading.time) && reading.is_sound() && sound(reading.value))
            .copied()
            .collect();
        chosen.put_in_order();
        let observations = Observations::of(&chosen);
        Self {
            series: chosen,
            observations,
            options: *options,
        }
    }

    /// The readings used.
    pub fn series(&self) -> &Series {
        &self.series
    }

    /// The constant-load fit, unweighted, the readings taken as point values in their own unit.
    pub fn least_squares(&self) -> ConstantLoad {
        let pairs = self
            .series
            .readings
            .iter()
            .zip(&self.observations.values)
            .map(|(reading, observation)| (observation.t_days, reading.value));
        let readings = PointReadings::new(self.series.quantity(), pairs);
        ConstantLoad::fit(&readings, self.options.exponent)
    }

    /// Everything there is to say; `seconds` is what [`Self::least_squares`] took, by the caller's clock.
    pub fn report(&self, least_squares: &ConstantLoad, seconds: f64) -> FitReport {
        let critical = self.options.critical_velocity_mm_per_day;
        let outlook = outlook(&self.observations, critical).map(|(outlook, _)| outlook);
        let rates = self.rates();
        // A stuck instrument's readings have a posterior too, and it would name a regime.
        let is_informative = !least_squares.outcome.says_nothing();
        let posterior = is_informative
            .then(|| self.posterior(&rates, least_squares))
            .flatten()
            .and_then(|posterior| held::under(self.options.exponent, posterior));
        let settled = posterior.as_ref().filter(|posterior| posterior.suffices);
        let is_m_free = matches!(self.options.exponent, Exponent::Free);
        let onset = posterior.as_ref().map(LawDraws::onset);
        let regime = FittedRegime::of(posterior.as_ref());
        let regime_under_load = outlook
            .as_ref()
            .filter(|_| is_informative && is_m_free)
            .map(FittedRegime::under_load);
        let has_stood_still = remarks::has_stood_still(&rates);
        let both = (&regime, regime_under_load.as_ref());
        let best = least_squares.best();
        let first = self.series.readings.first().map(|reading| reading.time);
        FitReport {
            benchmark: self.series.benchmark.clone(),
            quantity: self.series.quantity(),
            unit: self.series.unit,
            readings: self.series.readings.len(),
            first,
            last: self.series.readings.last().map(|reading| reading.time),
            onset: onset.map_or(first, |onset| self.start_at(onset.median_days)),
            onset_low: onset.and_then(|onset| self.start_at(onset.low_days)),
            onset_high: onset.and_then(|onset| self.start_at(onset.high_days)),
            parameters: estimate::parameters(self, best, settled),
            alternatives: Alternatives::of(self, least_squares),
            transition_time: best
                .and_then(|best| best.law.transition_days())
                .and_then(|days| self.time_at(days)),
            failure_time: FittedFailureTime::of(self, outlook.as_ref().map(|one| &one.collapse)),
            critical_velocity_time: FittedFailureTime::of(
                self,
                outlook.as_ref().map(|one| &one.passage),
            ),
            prior_sensitivity: UnderPrior::each(self, posterior.as_ref()),
            inverse_velocity: self.inverse_velocity(&rates, regime.probability_accelerating),
            remarks: remarks::remarks(posterior.as_ref(), both, has_stood_still),
            has_stood_still,
            regime,
            regime_under_load,
            rms: best.map(|best| best.rms).filter(|rms| rms.is_finite()),
            evaluations: least_squares.evaluations,
            seconds,
            termination: least_squares.outcome.to_string(),
        }
    }

    /// The posterior of a constant load, of which the minima of the misfit are known. Point velocities that were merged count as means
    /// up to the middle between readings, and laws hold from the first reading on at the earliest.
    fn posterior(&self, rates: &[Rate], least_squares: &ConstantLoad) -> Option<LawDraws> {
        let is_of_points =
            self.series.quantity() == Quantity::Velocity && self.observations.averaging_days == 0.0;
        let mut rates = rates.to_vec();
        if is_of_points {
            widen_merged(&mut rates);
        }
        let now = rates.last()?.to;
        let likely: Vec<Law> = least_squares
            .minima
            .iter()
            .filter_map(|minimum| {
                let law = law_in_mm_per_day(self, minimum);
                let y = Trajectory::solve(&law, now, Accuracy::Fit).at(now)?.y;
                (y.is_finite() && y > 0.0).then(|| law.from_y(y))
            })
            .collect();
        let mut draws = LawDraws::with(&rates, &Assumptions::CONSTANT_LOAD, &likely)?;
        if is_of_points {
            draws.from_days = draws.from_days.max(0.0);
            for span in &mut draws.spans_days {
                *span = span.min(now);
            }
        }
        Some(draws)
    }

    fn rates(&self) -> Vec<Rate> {
        self.observations.all_rates()
    }

    fn inverse_velocity(&self, rates: &[Rate], accelerating: Option<f64>) -> FittedInverseVelocity {
        let line = InverseVelocityLine::fit(InverseVelocityLine::newest(rates));
        let alpha = if accelerating.is_some_and(|probability| probability >= 0.5) {
            growth::exponent(rates)
        } else {
            None
        };
        let (now, length) = match (rates.first(), self.observations.values.last()) {
            (Some(first), Some(last)) => (last.t_days, last.t_days - first.from),
            _ => (0.0, 0.0),
        };
        let is_prediction =
            |days: &f64| *days > now - 1.0 && *days < now + FARTHEST_INTERCEPT * length;
        FittedInverseVelocity {
            failure_time: line
                .and_then(|line| line.intercept_days)
                .filter(is_prediction)
                .and_then(|days| self.time_at(days)),
            r_squared: line.map(|line| line.r_squared).filter(|r| r.is_finite()),
            alpha,
        }
    }

    /// The instant `days` after the first reading.
    fn time_at(&self, days: f64) -> Option<Timestamp> {
        after_days(self.series.readings.first()?.time, days)
    }

    /// The same, and the first reading for what its averaging began before it.
    fn start_at(&self, days: f64) -> Option<Timestamp> {
        self.time_at(days.max(0.0))
    }

    /// Velocities of the readings' unit in one mm/day.
    fn velocity_per_mm_per_day(&self) -> f64 {
        1.0 / self.velocity_unit().factor()
    }

    /// The unit of `v_i` and D: the readings' own, or its length per day for displacements.
    fn velocity_unit(&self) -> Unit {
        match self.series.unit {
            Unit::Length(length) => Unit::Rate(length, TimeUnit::Day),
            rate @ Unit::Rate(..) => rate,
        }
    }

    /// The length that `D_c` is in.
    fn length_unit(&self) -> LengthUnit {
        match self.series.unit {
            Unit::Length(length) | Unit::Rate(length, _) => length,
        }
    }
}

/// The law of a solution with its velocity in mm/day.
fn law_in_mm_per_day(inversion: &Inversion, solution: &Solution) -> Law {
    Law {
        v_i: solution.law.v_i / inversion.velocity_per_mm_per_day(),
        ..solution.law
    }
}

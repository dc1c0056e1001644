//! Laws drawn from the posterior, between those of the table: what intervals of parameters are made of.

use super::assumptions::Assumptions;
use super::population::{DrawnLaw, Population};
use super::search::GridSearch;
use super::{Ensemble, FEWEST_RATES, LawSample};
use crate::fit::Rate;
use crate::model::Law;
use std::collections::BTreeSet;

/// Rounds before anything is drawn, how often rates are doubted meanwhile, rounds after that, and in how many of those the
/// population is taken.
const BEFORE: usize = 80;
const BEFORE_AGAIN: usize = 200;
const DOUBTED: usize = 40;
const AFTER: usize = 288;
const TAKEN: usize = 16;
/// How often the population begins again where what was drawn does not suffice, and how many different laws do.
const AGAIN: usize = 3;
const FEWEST_DIFFERENT: usize = 300;
/// Between the first third and the last of what was drawn the mean of ln of the density moves by no more than this at rest, and by no more
/// than that while a population only grows narrower: then what it leaves open is too wide, and not too narrow.
const AT_REST: f64 = 1.0;
const STILL_NARROWING: f64 = 8.0;
/// The least standard deviation of ln of the density: one of a normal posterior of one dimension is 0.7, of seven 1.9.
const LEAST_SPREAD: f64 = 0.8;

/// When the law began to hold, days since the epoch of the rates; the bounds hold 90 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Onset {
    /// 5 % quantile.
    pub low_days: f64,
    /// Median: the first reading where that is the likelier.
    pub median_days: f64,
    /// 95 % quantile.
    pub high_days: f64,
}

/// Laws drawn from the posterior, each since when it holds.
#[derive(Debug, Clone, PartialEq)]
pub struct LawDraws {
    /// The laws.
    pub ensemble: Ensemble,
    /// Start of the first rate used, days.
    pub from_days: f64,
    /// How far back from the present each law holds, days, in the order of the samples.
    pub spans_days: Vec<f64>,
    /// Laws that were weighed.
    pub evaluations: usize,
    /// Whether they are so many different ones, and the likeliest among them, that their quantiles mean something.
    pub suffices: bool,
}

impl LawDraws {
    /// Draws laws that agree with `rates`, oldest first; `None` with fewer than five, or where none of them moves.
    pub fn of(rates: &[Rate], assumed: &Assumptions) -> Option<Self> {
        Self::with(rates, assumed, &[])
    }

    /// The same where laws of today are known that may be about the likeliest: where what is drawn does not suffice, it is drawn
    /// again about these. Readings that scatter little leave so narrow a range open that a population that begins with the
    /// table of laws may come to stand still beside it.
    pub fn with(rates: &[Rate], assumed: &Assumptions, likely: &[Law]) -> Option<Self> {
        let (first, last) = (rates.first()?, rates.last()?);
        let moves = rates.iter().any(|rate| rate.velocity > 0.0);
        if rates.len() < FEWEST_RATES || !moves || last.to <= first.from {
            return None;
        }
        let mut search = GridSearch::new(rates, assumed);
        let cells = search.cells(rates)?;
        let mut population = Population::about(&cells, search)?;
        let mut drawn = draw(&mut population, false);
        let mut suffices = suffices(&mut population, &drawn);
        for _ in 0..AGAIN {
            if suffices && moved(&drawn) <= AT_REST {
                break;
            }
            if !suffices {
                population.begin_again(likely);
            }
            drawn = draw(&mut population, true);
            suffices = self::suffices(&mut population, &drawn);
        }
        let draws = Self::from(&population, &drawn, first.from, last.to)?;
        Some(Self { suffices, ..draws })
    }

    fn from(
        population: &Population,
        drawn: &[DrawnLaw],
        from_days: f64,
        now_days: f64,
    ) -> Option<Self> {
        let record = population.record();
        let count = record.from.len();
        let weight = 1.0 / drawn.len() as f64;
        let variance = drawn.iter().map(|one| one.variance).sum::<f64>() * weight;
        let samples = drawn.iter().map(|one| LawSample {
            law: one.law(record.centre),
            weight,
        });
        let spans = drawn
            .iter()
            .map(|one| record.from[count - one.started.rates]);
        (!drawn.is_empty()).then(|| Self {
            ensemble: Ensemble {
                now_days,
                samples: samples.collect(),
                scatter: variance.sqrt(),
            },
            from_days,
            spans_days: spans.collect(),
            evaluations: population.evaluations(),
            suffices: true,
        })
    }

    /// When the law began to hold.
    pub fn onset(&self) -> Onset {
        let mut spans = self.spans_days.clone();
        // The longest span is the earliest start.
        spans.sort_by(|a, b| b.total_cmp(a));
        let at = |part: usize| {
            let index = (part * spans.len() / 20).min(spans.len().saturating_sub(1));
            let span = spans.get(index);
            span.map_or(self.from_days, |span| self.ensemble.now_days - span)
        };
        Onset {
            low_days: at(1),
            median_days: at(10),
            high_days: at(19),
        }
    }
}

/// Lets the population come to rest, for longer where it is there again, and then takes it now and then.
fn draw(population: &mut Population, again: bool) -> Vec<DrawnLaw> {
    let before = if again { BEFORE_AGAIN } else { BEFORE };
    for round in 1..=before {
        population.round();
        if round.is_multiple_of(DOUBTED) {
            population.doubt();
            if again && round < before {
                population.leave_behind();
            }
        }
    }
    let mut drawn: Vec<DrawnLaw> = Vec::new();
    for round in 1..=AFTER {
        population.round();
        if round.is_multiple_of(TAKEN) {
            drawn.extend(population.draw());
        }
    }
    drawn
}

fn mean_ln(drawn: &[DrawnLaw]) -> f64 {
    drawn.iter().map(|one| one.ln).sum::<f64>() / drawn.len().max(1) as f64
}

/// How far the mean of ln of the density moves from the first third to the last of what was drawn.
fn moved(drawn: &[DrawnLaw]) -> f64 {
    let third = drawn.len() / 3;
    (mean_ln(&drawn[drawn.len() - third..]) - mean_ln(&drawn[..third])).abs()
}

/// Whether what was drawn are different laws, not far from rest, and no likelier one is known.
fn suffices(population: &mut Population, drawn: &[DrawnLaw]) -> bool {
    let different: BTreeSet<u64> = drawn.iter().map(|one| one.ln.to_bits()).collect();
    let whole = mean_ln(drawn);
    let squares = drawn.iter().map(|one| (one.ln - whole).powi(2));
    let spread = (squares.sum::<f64>() / drawn.len().max(1) as f64).sqrt();
    let lns = drawn.iter().map(|one| one.ln);
    let best = lns.fold(f64::NEG_INFINITY, f64::max);
    different.len() >= FEWEST_DIFFERENT
        && moved(drawn) <= STILL_NARROWING
        && spread >= LEAST_SPREAD
        && !population.knows_likelier(best)
}

impl DrawnLaw {
    /// The law now.
    fn law(&self, centre: f64) -> Law {
        let (mean, variance) = self.level;
        let ln_velocity = centre + mean + variance.max(0.0).sqrt() * self.deviate;
        let past = &self.shape.past;
        Law::from_fit(ln_velocity.exp(), past.r, past.kappa, past.p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{Observation, Observations, RateOptions};
    use crate::model::{Accuracy, Trajectory};
    use crate::reading::Quantity;
    use crate::regime::Regime;

    /// Sixty daily velocities of a law, which scatter by 3 %.
    fn rates(law: &Law) -> Vec<Rate> {
        scattered(law, 0.1)
    }

    /// Sixty daily velocities of a law, evenly within half of `width` of it.
    fn scattered(law: &Law, width: f64) -> Vec<Rate> {
        let solution = Trajectory::solve(law, 60.0, Accuracy::Full);
        let value = |day: u32| {
            let share = (f64::from(day) * 0.618_033_988_75 + 0.37).fract();
            let velocity = solution.at(f64::from(day)).unwrap().velocity;
            velocity * (1.0 + width * (share - 0.5))
        };
        let values = (0..60).map(|day| Observation {
            t_days: f64::from(day),
            value: value(day),
            sigma: None,
        });
        let observations = Observations {
            quantity: Quantity::Velocity,
            averaging_days: 0.0,
            values: values.collect(),
        };
        observations.rates(0..60, RateOptions::default())
    }

    fn share(draws: &LawDraws, is: impl Fn(&Law) -> bool) -> f64 {
        let samples = draws.ensemble.samples.iter();
        samples
            .filter(|one| is(&one.law))
            .map(|one| one.weight)
            .sum()
    }

    #[test]
    fn the_truth_is_among_the_laws_of_a_constant_load_and_they_are_the_same_each_time() {
        let law = Law::from_paper(1.35, 0.6, 70.0, 1.0).unwrap();
        let rates = rates(&law);
        let draws = LawDraws::of(&rates, &Assumptions::CONSTANT_LOAD).unwrap();
        assert_eq!(
            LawDraws::of(&rates, &Assumptions::CONSTANT_LOAD).unwrap(),
            draws
        );
        let now = law.from_y(
            Trajectory::solve(&law, 59.0, Accuracy::Full)
                .at(59.0)
                .unwrap()
                .y,
        );
        for (name, of) in [
            ("v", (|law: &Law| law.v_i) as fn(&Law) -> f64),
            ("r", |law| law.r),
            ("kappa", |law| law.kappa),
            ("p", |law| law.p),
        ] {
            let below = share(&draws, |one| of(one) < of(&now));
            assert!((0.02..0.98).contains(&below), "{name}: {below}");
        }
        assert!(draws.onset().low_days <= 1.0, "{:?}", draws.onset());
        assert!(share(&draws, |one| one.r > 0.0) > 0.999);
    }

    #[test]
    fn the_less_readings_scatter_the_less_is_left_open() {
        let law = Law::from_paper(1.35, 0.6, 70.0, 1.0).unwrap();
        let width = |scatter: f64| {
            let draws = LawDraws::of(&scattered(&law, scatter), &Assumptions::CONSTANT_LOAD);
            let laws = draws.unwrap().ensemble.samples;
            let mut all: Vec<f64> = laws.iter().map(|one| one.law.r).collect();
            all.sort_by(f64::total_cmp);
            let (low, high) = (all[all.len() / 20], all[all.len() * 19 / 20]);
            high - low
        };
        let (wide, narrow) = (width(0.1), width(0.001));
        assert!(narrow < 0.1 * wide, "{narrow} {wide}");
    }

    #[test]
    fn where_the_load_may_change_the_same_readings_leave_more_laws_open() {
        let law = Law::from_paper(1.35, 0.6, 70.0, 1.0).unwrap();
        let rates = rates(&law);
        let spread = |assumed: &Assumptions| {
            let draws = LawDraws::of(&rates, assumed).unwrap();
            let samples = &draws.ensemble.samples;
            let mean = samples
                .iter()
                .map(|one| one.weight * one.law.r)
                .sum::<f64>();
            let square = |one: &LawSample| one.weight * (one.law.r - mean).powi(2);
            samples.iter().map(square).sum::<f64>().sqrt()
        };
        let constant = spread(&Assumptions::CONSTANT_LOAD);
        let changing = spread(&Assumptions::CHANGING_LOAD);
        assert!(changing > 1.1 * constant, "{changing} {constant}");
    }

    #[test]
    fn under_other_priors_the_laws_are_the_same_and_weigh_otherwise() {
        let law = Law::from_paper(0.5, 0.1, 20.0, 1.0).unwrap();
        let draws = LawDraws::of(&rates(&law), &Assumptions::CONSTANT_LOAD).unwrap();
        for other in super::super::OtherPrior::ALL {
            let under = draws.under(other);
            assert_eq!(under.samples.len(), draws.ensemble.samples.len());
            let total: f64 = under.samples.iter().map(|one| one.weight).sum();
            assert!((total - 1.0).abs() < 1e-9, "{other:?}: {total}");
        }
        let watched = draws.under(super::super::OtherPrior::OfWatchedSlopes);
        let unstable = |samples: &[LawSample]| {
            let is = |one: &&LawSample| one.law.regime() == Regime::UnstableDecelerating;
            samples.iter().filter(is).map(|one| one.weight).sum::<f64>()
        };
        let (before, after) = (
            unstable(&draws.ensemble.samples),
            unstable(&watched.samples),
        );
        assert!(after >= before, "{after} {before}");
    }
}

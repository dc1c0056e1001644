//! The posterior of the law from a window of rates, as a weighted, quasi-random sample.
//!
//! The coordinates are those of the present: velocity, slope r and curvature kappa of the inverse
//! velocity at the window's last reading. The law runs backwards from there through the readings, so
//! no sample has failed already, and a forecast starts where the slope is now. What is taken for granted
//! stands in [`prior`], how readings scatter in [`scatter`]: size, correlated share and memory of the
//! scatter are unknowns like the law's own, and averaged over. Normal approximations about the modes say
//! where to draw; the weights say how probable each draw is.

mod mode;
mod onset;
mod past;
mod prior;
mod proposal;
mod scatter;
mod sensitivity;
mod window;

pub use onset::Onset;
pub use prior::P_PRIOR;
pub use sensitivity::OtherPrior;

use super::rates::Rate;
use crate::model::Law;
use mode::{LN_V, Mode, ModeBench, ModeProblem, Point, Sign};
use onset::OnsetStart;
use past::PastShape;
use proposal::{Side, Whole};
use scatter::Texture;
use serde::{Deserialize, Serialize};
use window::Window;

/// One law out of the posterior, with t = 0 at the present.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LawSample {
    /// The law.
    pub law: Law,
    /// Its share of the probability.
    pub weight: f64,
}

/// A weighted sample of laws that agree with the readings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ensemble {
    /// The present: the time of the last reading used, days.
    pub now_days: f64,
    /// The laws; their weights sum to 1.
    pub samples: Vec<LawSample>,
    /// Relative scatter of a rate about the law.
    pub scatter: f64,
}

/// The posterior and how it came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Posterior {
    /// The laws.
    pub ensemble: Ensemble,
    /// OnsetStart of the first rate used, days.
    pub from_days: f64,
    /// How far back from the present each law holds, days, in the order of the samples.
    pub spans_days: Vec<f64>,
    /// Solutions of the law that were computed.
    pub evaluations: usize,
    /// Draws that the weighted sample is worth (Kish).
    pub effective_draws: f64,
}

/// One law as it was drawn.
#[derive(Debug, Clone, Copy)]
struct Draft {
    law: Law,
    span_days: f64,
    whole: Whole,
    /// Where the span lies in its range, from -1 to 1.
    along: f64,
    texture: usize,
    log_posterior: f64,
    /// ln of the density of the mixture of the proposals so far, each times the number drawn from it.
    log_mixture: f64,
    log_weight: f64,
}

/// How much is drawn.
#[derive(Debug, Clone, Copy)]
struct Effort {
    /// Laws drawn in each round.
    draws: u32,
    /// Rounds, at least and at most.
    rounds: (u32, u32),
    /// Even draws that they must be worth to end sooner.
    worth: f64,
}

/// Of 90 % intervals of 1,000 drawn series, 85 to 88 % hold the truth (studies/src/bin/calibration); 80 to 86 % where 128 laws a round were to
/// be worth 110 even draws.
const EFFORT: Effort = Effort {
    draws: 512,
    rounds: (4, 16),
    worth: 1000.0,
};
/// A start this much less probable than the likeliest, in ln, is left out.
const HOPELESS: f64 = 6.0;
/// Steps of a search before and after the size of the scatter is known.
const ROUNDS: (usize, usize) = (6, 10);
/// Where in its range p is when a search starts.
const FIRST_P: f64 = 0.3;
/// asinh of kappa L when a search starts.
const FIRST_KAPPAS: [f64; 2] = [0.5, 2.5];
/// Fewer rates than this leave nothing over to estimate the scatter from.
const FEWEST_RATES: usize = 5;

impl Posterior {
    /// Fits the law to all of `rates`, as if it held from the first on.
    /// `None` when there are too few rates or none of them moves.
    pub fn fit(rates: &[Rate]) -> Option<Self> {
        let window = window_of(rates)?;
        let textures = scatter::textures(&window);
        let mut bench = ModeBench::new(rates.len());
        let start = OnsetStart::first(&window);
        let sides = Sign::BOTH
            .into_iter()
            .filter_map(|sign| {
                let problem = start.problem(&window, sign);
                let starts = starts(&problem, rates);
                let found = side(problem, &mut bench, &textures, &starts);
                found.map(|(_, side)| side)
            })
            .collect();
        let drafts = draw(&mut bench, &textures, sides, &EFFORT);
        Self::of(&window, &drafts, bench.evaluations)
    }

    /// Fits the law to `rates` from each of several starts on, and averages over them.
    /// `None` when there are too few rates or none of them moves.
    pub fn over_onsets(rates: &[Rate]) -> Option<Self> {
        let window = window_of(rates)?;
        let textures = scatter::textures(&window);
        let few = scatter::few(&textures);
        let mut bench = ModeBench::new(rates.len());
        let mut screened: Vec<(ModeProblem<'_>, Summit, f64)> = Vec::new();
        for start in OnsetStart::candidates(&window) {
            for sign in Sign::BOTH {
                let problem = start.problem(&window, sign);
                let starts = starts(&problem, rates);
                if let Some((summit, side)) = side(problem, &mut bench, &few, &starts) {
                    screened.push((problem, summit, side.log_evidence));
                }
            }
        }
        let best = screened
            .iter()
            .map(|one| one.2)
            .fold(f64::NEG_INFINITY, f64::max);
        // Both signs of the likeliest start stay, so that neither is out of the question.
        let likeliest = screened.iter().find(|one| one.2 >= best)?.0.span_days;
        screened.retain(|one| {
            one.2 > best - HOPELESS || one.0.span_days.to_bits() == likeliest.to_bits()
        });
        let sides = screened
            .iter()
            .filter_map(|(problem, summit, _)| {
                let start = problem.point(summit.shape, summit.ln_v);
                let starts = (vec![start], summit.log_size);
                let found = side(*problem, &mut bench, &textures, &starts);
                found.map(|(_, side)| side)
            })
            .collect();
        let drafts = draw(&mut bench, &textures, sides, &EFFORT);
        Self::of(&window, &drafts, bench.evaluations)
    }

    fn of(window: &Window, drafts: &[Draft], evaluations: usize) -> Option<Self> {
        let logs: Vec<f64> = drafts.iter().map(|draft| draft.log_weight).collect();
        let total = proposal::log_sum(&logs);
        if !total.is_finite() {
            return None;
        }
        let weighed = drafts
            .iter()
            .map(|draft| (draft, (draft.log_weight - total).exp()))
            .filter(|(_, weight)| *weight > 1e-9);
        let mut samples = Vec::with_capacity(drafts.len());
        let mut spans_days = Vec::with_capacity(drafts.len());
        let (mut log_size, mut squares) = (0.0, 0.0);
        for (draft, weight) in weighed {
            samples.push(LawSample {
                law: draft.law,
                weight,
            });
            spans_days.push(draft.span_days);
            log_size += weight * draft.whole[4];
            squares += weight * weight;
        }
        Some(Self {
            ensemble: Ensemble {
                now_days: window.now_days,
                samples,
                scatter: log_size.exp(),
            },
            from_days: window.now_days - window.length_days,
            spans_days,
            evaluations,
            effective_draws: 1.0 / squares,
        })
    }
}

fn window_of(rates: &[Rate]) -> Option<Window> {
    (rates.len() >= FEWEST_RATES)
        .then(|| Window::new(rates))
        .flatten()
}

/// The most probable law on one side with white scatter, and ln of the size of that.
#[derive(Debug, Clone, Copy)]
struct Summit {
    shape: PastShape,
    ln_v: f64,
    log_size: f64,
}

/// Finds the mode of one side, and draws up the proposal about it.
fn side<'a>(
    problem: ModeProblem<'a>,
    bench: &mut ModeBench,
    textures: &[Texture],
    (starts, log_size): &(Vec<Point>, f64),
) -> Option<(Summit, Side<'a>)> {
    let white = &textures[0];
    let size = log_size.exp();
    let found = starts
        .iter()
        .filter_map(|start| problem.search(bench, *start, white, size, ROUNDS.0))
        .min_by(|a: &Mode, b: &Mode| a.cost.total_cmp(&b.cost))?;
    let mut log_size = *log_size;
    if problem.evaluate(bench, &found.at) {
        (log_size, _) = white.size(problem.window, &bench.residuals, log_size, 4);
    }
    let Mode { at, .. } = problem.search(bench, found.at, white, log_size.exp(), ROUNDS.1)?;
    let summit = Summit {
        shape: problem.shape(&at),
        ln_v: at[LN_V],
        log_size,
    };
    let side = Side::new(problem, bench, at, textures, log_size)?;
    Some((summit, side))
}

/// Where to look from, and ln of the size of the scatter there: a line through the recent and the older
/// velocity with some kappas.
fn starts(problem: &ModeProblem<'_>, rates: &[Rate]) -> (Vec<Point>, f64) {
    let (low, high) = problem.sign.p_range();
    let (ln_v, change) = line(problem, rates);
    let p = low + (high - low) * FIRST_P;
    let bent = |kappa: f64| Point::new(p, kappa, change, ln_v);
    let starts = match problem.sign {
        Sign::Positive => FIRST_KAPPAS.map(bent),
        Sign::Negative => FIRST_KAPPAS.map(|kappa| bent(-kappa)),
    };
    (starts.to_vec(), prior::SCATTER.0.ln() + 0.7)
}

/// ln of the recent velocity, and asinh of the slope of a line through it and the older one.
fn line(problem: &ModeProblem<'_>, rates: &[Rate]) -> (f64, f64) {
    let from = problem.window.now_days - problem.span_days;
    let count = rates.iter().filter(|rate| rate.to > from).count().max(1);
    let rates = &rates[rates.len() - count..];
    let mean = |rates: &[Rate]| {
        let velocities = rates.iter().map(|rate| rate.velocity.max(0.0));
        velocities.sum::<f64>() / rates.len().max(1) as f64
    };
    let all = mean(rates).max(1e-12);
    let recent = mean(&rates[count - (count / 6).max(1)..]).max(0.05 * all);
    let older = mean(&rates[..(count / 3).max(1)]).max(0.02 * all);
    let slope = (recent / older - 1.0).clamp(-0.7, 50.0);
    (recent.ln(), slope.asinh())
}

/// Draws laws from each side in rounds, every round from a proposal that the ones before have taught.
fn draw(
    bench: &mut ModeBench,
    textures: &[Texture],
    sides: Vec<Side<'_>>,
    effort: &Effort,
) -> Vec<Draft> {
    let mut said: Vec<f64> = sides.iter().map(|side| side.log_evidence).collect();
    let mut lots: Vec<Lot<'_>> = sides.into_iter().map(Lot::new).collect();
    for round in 0..effort.rounds.1 {
        for (index, number) in numbers(&said, effort.draws).into_iter().enumerate() {
            let lot = &mut lots[index];
            lot.draw(bench, textures, (round * effort.draws, number));
            let logs: Vec<f64> = lot.drafts.iter().map(|draft| draft.log_weight).collect();
            said[index] = proposal::log_sum(&logs);
        }
        let enough = round + 1 >= effort.rounds.0;
        if enough && worth(lots.iter().flat_map(|lot| &lot.drafts)) >= effort.worth {
            break;
        }
    }
    lots.into_iter().flat_map(|lot| lot.drafts).collect()
}

/// What was drawn from one side, and from which proposals.
#[derive(Debug)]
struct Lot<'a> {
    next: Side<'a>,
    /// Proposals used, each with the number drawn from it.
    used: Vec<(Side<'a>, u32)>,
    drafts: Vec<Draft>,
}

impl<'a> Lot<'a> {
    fn new(side: Side<'a>) -> Self {
        Self {
            next: side,
            used: Vec::new(),
            drafts: Vec::new(),
        }
    }

    /// Draws `number` more, weighs all again against the mixture of the proposals that they came from
    /// (Owen and Zhou 2000: no draw weighs more than any of them would make it), and shapes the next proposal by them.
    fn draw(&mut self, bench: &mut ModeBench, textures: &[Texture], (first, number): (u32, u32)) {
        let one = |at| self.next.draw(bench, textures, first + at);
        let fresh: Vec<Draft> = (0..number).filter_map(one).collect();
        let density = |side: &Side<'_>, number: u32, draft: &Draft| {
            f64::from(number.max(1)).ln() + side.log_density(draft)
        };
        for draft in &mut self.drafts {
            let one = density(&self.next, number, draft);
            draft.log_mixture = proposal::log_sum(&[draft.log_mixture, one]);
        }
        self.used.push((self.next.clone(), number));
        self.drafts.extend(fresh.into_iter().map(|draft| {
            let each = self.used.iter();
            let each = each.map(|(side, number)| density(side, *number, &draft));
            let log_mixture = proposal::log_sum(&each.collect::<Vec<f64>>());
            Draft {
                log_mixture,
                ..draft
            }
        }));
        for draft in &mut self.drafts {
            draft.log_weight = draft.log_posterior - draft.log_mixture;
        }
        if let Some(better) = self.next.refitted(&self.drafts) {
            self.next = better;
        }
    }
}

/// How many of `count` draws each side gets: its share of the evidence, and some whatever that is.
fn numbers(evidences: &[f64], count: u32) -> Vec<u32> {
    let total = proposal::log_sum(evidences);
    let groups = u32::try_from(evidences.len().max(1)).unwrap_or(1);
    let fewest = count / (4 * groups);
    let free = f64::from(count - fewest * groups);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a count"
    )]
    let number = |log: &f64| fewest + (free * (log - total).exp()).round() as u32;
    if total.is_finite() {
        evidences.iter().map(number).collect()
    } else {
        vec![count / groups; evidences.len()]
    }
}

/// How many even draws a weighted sample is worth (Kish).
fn worth<'a>(drafts: impl Iterator<Item = &'a Draft>) -> f64 {
    let logs: Vec<f64> = drafts.map(|draft| draft.log_weight).collect();
    let twice: Vec<f64> = logs.iter().map(|log| 2.0 * log).collect();
    let worth = (2.0 * proposal::log_sum(&logs) - proposal::log_sum(&twice)).exp();
    if worth.is_finite() { worth } else { 0.0 }
}

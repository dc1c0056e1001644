//! How much a search finds without any effect: covariates at the wrong time, and readings made of noise alone.

use super::candidates::{delays, in_load, in_reading, responses};
use super::definition::{EffectDefinition, Trying};
use super::frame::{Frame, Frames, dot};
use super::kind::{Form, Kind};
use super::linear::Linear;
use super::problem::Problem;
use super::quantiles::upper_median;
use super::response::Driver;
use super::term::Term;
use crate::reading::NORMAL_MEDIAN;
use nalgebra::DMatrix;
use rand::RngExt as _;
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64Mcg;

/// A covariate is never shifted by less than this share of its record: it would still be at its right time.
pub(super) const LEAST_SHIFT: f64 = 0.06;
/// No p-value is claimed below it.
const LEAST_P: f64 = 1e-6;

/// The null gains: the best gains of many searches without any effect.
#[derive(Debug, Clone, Default)]
pub(super) struct NullGains {
    gains: Vec<f64>,
    /// The terms behind the largest of them, with their gains, where covariates were searched.
    pub(super) largest: Vec<(Term, f64)>,
}

/// An innovation of noise is no larger than so many standard deviations, which are taken from the median size.
const LARGEST: f64 = 4.0;

/// Directions that are multiplied at once with all series of noise: a product of matrices reads each of them from the
/// memory once for many products.
const AT_ONCE: usize = 128;
/// How many of the largest null gains are refitted in full.
const REFITTED: usize = 4;
/// The scale of a law known from n gains is taken as larger by this over n.
const FEW: f64 = 3.0;

impl NullGains {
    /// The same gains `times` as large.
    pub(super) fn amplified(mut self, times: f64) -> Self {
        for gain in &mut self.gains {
            *gain *= times;
        }
        self
    }

    /// The chance that one of two searches without any effect gains as much.
    pub(super) fn p_of_two(&self, gain: f64) -> f64 {
        (2.0 * self.p_value(gain)).min(1.0)
    }

    /// The chance that a search without any effect gains as much: by rank, and beyond the largest by Gumbel's law for maxima.
    pub(super) fn p_value(&self, gain: f64) -> f64 {
        let n = self.gains.len() as f64;
        if self.gains.is_empty() {
            return 1.0;
        }
        let above = self
            .gains
            .iter()
            .filter(|null_gains| **null_gains >= gain)
            .count();
        if above > 0 {
            return (above as f64 + 1.0) / (n + 1.0);
        }
        let tail = beyond(&self.gains, gain, 1.0);
        tail.clamp(LEAST_P, 1.0).min(1.0 / (n + 1.0))
    }
}

/// The gains of a few whole searches without any effect.
#[derive(Debug, Clone, Default)]
pub(super) struct WholeGains(Vec<f64>);

impl WholeGains {
    pub(super) fn push(&mut self, gain: f64) {
        self.0.push(gain);
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// How many of them are as large.
    pub(super) fn reaching(&self, gain: f64) -> usize {
        self.0.iter().filter(|one| **one >= gain).count()
    }

    /// The chance that one more gains as much: by rank, and beyond the largest by Gumbel's law, whose scale so few leave open.
    pub(super) fn p_value(&self, gain: f64) -> f64 {
        let n = self.len() as f64;
        let reaching = self.reaching(gain);
        if n < 2.0 || reaching > 0 {
            return (reaching as f64 + 1.0) / (n + 1.0);
        }
        beyond(&self.0, gain, 1.0 + FEW / n).clamp(LEAST_P, 1.0)
    }

    /// The chance that one of two such searches gains as much.
    pub(super) fn p_of_two(&self, gain: f64) -> f64 {
        (2.0 * self.p_value(gain)).min(1.0)
    }
}

/// The chance of one as large as `gain` by Gumbel's law for maxima, of which these are some; its scale `wider` than theirs.
fn beyond(gains: &[f64], gain: f64, wider: f64) -> f64 {
    let n = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / n;
    let variance = gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / n;
    let scale = wider * (variance * 6.0).sqrt() / std::f64::consts::PI;
    // Euler's constant places the mean of Gumbel's law.
    let place = mean - 0.577_215_664_9 * scale;
    -(-(-(gain - place) / scale.max(1e-9)).exp()).exp_m1()
}

/// What a search over covariates goes through.
#[derive(Clone, Copy)]
pub(super) struct SearchedCovariates<'a> {
    pub(super) problem: &'a Problem,
    /// The effects that are tried.
    pub(super) effects: &'static [&'static EffectDefinition],
    pub(super) linear: &'a Linear,
    pub(super) frames: &'a Frames,
}

/// The whole search over every covariate, on covariates shifted round in time (and in every other one run
/// backwards): all by the same share, so that what they have in common stays.
pub(super) fn shifted_covariates(
    searched: SearchedCovariates<'_>,
    drivers: &[Driver],
    count: usize,
    seed: u64,
) -> NullGains {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let before = searched.frames.deviance();
    let finds = (0..count).filter_map(|k| {
        let share = random.random_range(LEAST_SHIFT..1.0 - LEAST_SHIFT);
        let each = drivers.iter().filter_map(|driver| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a share of a length"
            )]
            let by = (share * driver.len() as f64) as usize;
            let other = driver.shifted(by, k % 2 == 1);
            best_response(searched, &other)
        });
        let best = each.min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((best.0, before - best.1))
    });
    let mut finds: Vec<(Term, f64)> = finds.collect();
    finds.sort_by(|a, b| b.1.total_cmp(&a.1));
    let gains = finds.iter().map(|(_, gain)| *gain).collect();
    finds.truncate(REFITTED);
    NullGains {
        gains,
        largest: finds,
    }
}

/// The likeliest response of one covariate with its -2 ln likelihood: a coarser search than that for the covariate
/// itself, which gains less for it.
fn best_response(searched: SearchedCovariates<'_>, driver: &Driver) -> Option<(Term, f64)> {
    let problem = searched.problem;
    let delays = delays(problem, driver);
    let coarse: Vec<f64> = delays.into_iter().step_by(2).collect();
    let tried = searched.effects.iter();
    let tried = tried.filter(|definition| definition.is_tried_through(driver.kind));
    let each = tried.flat_map(|definition| {
        let kind = Kind::of(definition);
        if let Trying::CovariateInReading(_) = definition.trying {
            let coarse = coarse.iter();
            let terms = coarse.filter_map(|days| in_reading(problem, kind, driver, 1, *days));
            return terms.collect();
        }
        let forms = [Form::Level, Form::Rate].into_iter();
        let terms = forms
            .flat_map(|form| responses(form, &coarse))
            .filter(|response| response.stages == 2 || response.mean_days == 0.0)
            .filter_map(|response| in_load(problem, kind, driver, response));
        terms.collect::<Vec<Term>>()
    });
    let mut terms = Vec::new();
    let mut columns = Vec::new();
    for term in each {
        columns.extend(searched.linear.columns(problem, &term));
        terms.push(term);
    }
    let deviances = searched.frames.deviance_with_each(&columns);
    let each = terms.into_iter().zip(deviances);
    each.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// What one thing that was tried adds to each frame's directions, and what it costs.
#[derive(Debug, Clone)]
pub(super) struct Tried {
    /// By frame.
    pub(super) directions: Vec<Vec<Vec<f64>>>,
    pub(super) cost: f64,
}

impl Tried {
    pub(super) fn new(frames: &Frames, columns: &[Vec<f64>], cost: f64) -> Self {
        let each = frames.each.iter();
        Self {
            directions: each.map(|frame| frame.new_directions(columns)).collect(),
            cost,
        }
    }

    /// The least -2 ln likelihood with it, and its cost, for what is left of readings in each frame.
    pub(super) fn deviance(&self, frames: &Frames, left: &[(Vec<f64>, f64)]) -> f64 {
        let each = frames.each.iter().zip(&self.directions).zip(left);
        each.map(|((frame, directions), (residual, misfit))| {
            frame.deviance(misfit - Frame::taken(directions, residual)) + frame.cost()
        })
        .fold(f64::INFINITY, f64::min)
            + self.cost
    }
}

/// What the innovations of the surrogates are like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Innovations {
    /// As they are, in another order.
    AsTheyAre,
    /// No larger than noise has them: where noise remembers, a jump of the reading or of the velocity is one innovation, and
    /// wherever the order puts it, it is that jump again.
    WithoutJumps,
}

/// The whole search over what needs no covariate, on readings made of the likeliest noise: its own innovations in
/// another order.
pub(super) fn noise_alone(
    frames: &Frames,
    tried: &[Tried],
    kind: Innovations,
    count: usize,
    seed: u64,
) -> NullGains {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let best = &frames.each[frames.best()];
    let mut innovations = frames.innovations().to_vec();
    if kind == Innovations::WithoutJumps {
        let sizes = innovations.iter().map(|u| u.abs()).collect();
        let most = LARGEST * upper_median(sizes) / NORMAL_MEDIAN;
        for innovation in &mut innovations {
            *innovation = innovation.clamp(-most, most);
        }
    }
    let readings: Vec<Vec<f64>> = (0..count)
        .map(|_| {
            innovations.shuffle(&mut random);
            best.whitener.colour(&innovations)
        })
        .collect();
    let before = vec![f64::INFINITY; count];
    let (mut before, mut least) = (before.clone(), before);
    for (index, frame) in frames.each.iter().enumerate() {
        let noise = NoiseInFrame::new(frame, &readings);
        for (before, misfit) in before.iter_mut().zip(&noise.misfits) {
            *before = before.min(frame.deviance(*misfit) + frame.cost());
        }
        noise.least(frame, index, tried, &mut least);
    }
    let gains = before.iter().zip(&least);
    NullGains {
        gains: gains.map(|(before, least)| before - least).collect(),
        largest: Vec::new(),
    }
}

/// Series of noise as one frame sees them: what the model leaves of each, a column a series, and its square.
struct NoiseInFrame {
    left: DMatrix<f64>,
    misfits: Vec<f64>,
}

impl NoiseInFrame {
    fn new(frame: &Frame, readings: &[Vec<f64>]) -> Self {
        let left: Vec<Vec<f64>> = readings
            .iter()
            .map(|one| frame.project_noise(one))
            .collect();
        let length = left.first().map_or(0, Vec::len);
        Self {
            misfits: left.iter().map(|one| dot(one, one)).collect(),
            left: DMatrix::from_iterator(length, left.len(), left.into_iter().flatten()),
        }
    }

    /// The least -2 ln likelihood of each series with one of `tried`, in this frame, which is the one of that index,
    /// where it is less than `least` has.
    fn least(&self, frame: &Frame, index: usize, tried: &[Tried], least: &mut [f64]) {
        let mut from = 0;
        while from < tried.len() {
            let (mut rows, mut next) = (0, from);
            while next < tried.len() && rows < AT_ONCE {
                rows += tried[next].directions[index].len();
                next += 1;
            }
            let some = &tried[from..next];
            let directions = some.iter().flat_map(|one| &one.directions[index]);
            let values = directions.flatten().copied();
            let directions = DMatrix::from_iterator(self.left.nrows(), rows, values);
            let products = directions.transpose() * &self.left;
            for (series, misfit) in self.misfits.iter().enumerate() {
                let products = products.column(series);
                let mut row = 0;
                for one in some {
                    let last = row + one.directions[index].len();
                    let taken: f64 = (row..last).map(|row| products[row].powi(2)).sum();
                    let deviance = frame.deviance(misfit - taken) + frame.cost() + one.cost;
                    least[series] = least[series].min(deviance);
                    row = last;
                }
            }
            from = next;
        }
    }
}

#[cfg(test)]
mod tests;

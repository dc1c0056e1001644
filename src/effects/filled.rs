//! What fell while a gauge was out and the readings went on. It is put at what usually falls, and what that misses stays in every later displacement: it
//! bends the law, the size and the delay. Where the law has such a covariate, what fell is fitted with it, and the search is made again.

use super::act::{Act, mean_and_deviation};
use super::candidates::{delays, in_load, responses};
use super::kind::Form;
use super::problem::Problem;
use super::refit::{Fitted, Start, refit};
use super::response::{Driver, Response};
use super::search::Search;
use super::term::{Term, coefficients_of};
use crate::reading::CovariateKind;
use std::ops::Range;

/// The longest gaps of a covariate, and parts of each, in which what fell is free.
const MOST_GAPS: usize = 4;
const MOST_PARTS: usize = 4;

/// A covariate with what fell in its gaps as the readings fit it, and the law with it.
struct Filling {
    fitted: Fitted,
    driver: Driver,
}

impl Search<'_> {
    /// The covariates with what fell in the gaps of those that `full` has as it fits the readings; `None` where none explains them better by the margin.
    pub(super) fn filled(&mut self, full: &Fitted) -> Option<Vec<Driver>> {
        let mut drivers = self.drivers.to_vec();
        let mut full = full.clone();
        let mut is_any = false;
        for index in 0..full.terms.len() {
            let Some(filling) = self.filling(&full, index) else {
                continue;
            };
            let place = drivers
                .iter()
                .position(|one| one.index == filling.driver.index);
            drivers[place?] = filling.driver;
            full = filling.fitted;
            is_any = true;
        }
        is_any.then_some(drivers)
    }

    /// Of the term of that index, the others staying.
    fn filling(&mut self, full: &Fitted, index: usize) -> Option<Filling> {
        let problem = self.problem;
        let term = &full.terms[index];
        let driver = Driver::at(self.drivers, term.channel)?;
        let own = term.response.filter(|_| matches!(term.act, Act::Load(_)))?;
        if !matches!(driver.kind, CovariateKind::Rain | CovariateKind::Flow) {
            return None;
        }
        let parts = parts_of_gaps(problem, driver, own.mean_days);
        if parts.is_empty() {
            return None;
        }
        let last = full.terms.len() - 1;
        let base = self.with_term_moved(full, index, last);
        let delays = delays(problem, driver);
        let forms = [Form::Level, Form::Rate].into_iter();
        let others = forms.flat_map(|form| responses(form, &delays));
        let tried = std::iter::once(own).chain(others.filter(|other| other.stages == 1));
        let mut best: Option<(Fitted, Response)> = None;
        for response in tried {
            let Some(fitted) = self.with_parts_free(&base, driver, response, &parts) else {
                continue;
            };
            let is_better = best
                .as_ref()
                .is_none_or(|(best, _)| fitted.bic(problem) < best.bic(problem));
            if is_better {
                best = Some((fitted, response));
            }
        }
        let (free, response) = best?;
        let driver = with_amounts(problem, driver, (response, &free), &parts)?;
        // Held to what can have fallen, the parts still have to pay for themselves.
        let term = in_load(problem, term.kind, &driver, response)?;
        let count = parts.len();
        let mut start = Start::at(&free);
        let kept = start.parameters.len() - count;
        start.parameters.truncate(kept);
        *start.terms.last_mut()? = term;
        let fitted = refit(problem, &start, self.bank, &mut self.scratch)?;
        let paid = count as f64 * (problem.used as f64).ln() + self.options.bic_margin;
        let is_paid = fitted.bic(problem) < full.bic(problem) - paid;
        let fitted = self.with_term_moved(&fitted, last, index);
        is_paid.then_some(Filling { fitted, driver })
    }

    /// The joint fit of `base`, the newest term of which is that of `driver`, with this response and what fell in each part of the gaps free.
    fn with_parts_free(
        &mut self,
        base: &Fitted,
        driver: &Driver,
        response: Response,
        parts: &[Range<usize>],
    ) -> Option<Fitted> {
        let problem = self.problem;
        let term = base.terms.last()?;
        let mut free = in_load(problem, term.kind, driver, response)?;
        let columns = part_columns(problem, driver, response, parts)?;
        if let Act::Load(own) = &mut free.act {
            own.extend(columns.into_iter().map(|(column, _)| column));
        }
        let mut start = Start::at(base);
        let has_other_form = term.response.is_some_and(|own| own.form != response.form);
        if has_other_form {
            *start.parameters.last_mut()? = free.act.starts()[0];
        }
        start.parameters.extend(vec![0.0; parts.len()]);
        *start.terms.last_mut()? = free;
        refit(problem, &start, self.bank, &mut self.scratch)
    }
}

/// The values of a covariate within its longest gaps, in parts of about its delay.
fn parts_of_gaps(problem: &Problem, driver: &Driver, mean_days: f64) -> Vec<Range<usize>> {
    let (first, last) = (problem.t[0], problem.t[problem.t.len() - 1]);
    let mut gaps: Vec<Range<usize>> = driver
        .gaps_within(first, last)
        .map(|(from, until)| driver.places_between(from, until))
        .collect();
    gaps.retain(|gap| !gap.is_empty());
    gaps.sort_by_key(|gap| std::cmp::Reverse(gap.len()));
    gaps.truncate(MOST_GAPS);
    let long = mean_days.max(2.0 * problem.spacing) / driver.step();
    let mut parts = Vec::new();
    for gap in gaps {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small number of parts"
        )]
        let count = (gap.len() as f64 / long).ceil() as usize;
        let length = gap.len().div_ceil(count.clamp(1, MOST_PARTS));
        for start in gap.clone().step_by(length) {
            parts.push(start..(start + length).min(gap.end));
        }
    }
    parts
}

/// What one unit more in each part does to the response at the nodes, with standard deviation 1, and that deviation.
fn part_columns(
    problem: &Problem,
    driver: &Driver,
    response: Response,
    parts: &[Range<usize>],
) -> Option<Vec<(Vec<f64>, f64)>> {
    let known = driver.respond_in_unit(response, &problem.nodes);
    let each = parts.iter().map(|part| {
        let more = driver.with_more(part, 1.0);
        let more = more.respond_in_unit(response, &problem.nodes);
        let mut column: Vec<f64> = more.iter().zip(&known).map(|(m, k)| m - k).collect();
        let (_, deviation) = mean_and_deviation(&column);
        if !(deviation.is_finite() && deviation > 0.0) {
            return None;
        }
        for value in &mut column {
            *value /= deviation;
        }
        Some((column, deviation))
    });
    each.collect()
}

/// The covariate with what the free parts came to, no less than nothing and no more than ever fell.
fn with_amounts(
    problem: &Problem,
    driver: &Driver,
    (response, free): (Response, &Fitted),
    parts: &[Range<usize>],
) -> Option<Driver> {
    let last = free.terms.len() - 1;
    let own: &[f64] = &free.parameters[coefficients_of(problem, &free.terms, last)];
    let (gain, amounts) = own.split_first()?;
    let (_, spread) = mean_and_deviation(&driver.respond_in_unit(response, &problem.nodes));
    let columns = part_columns(problem, driver, response, parts)?;
    let mut filled = driver.clone();
    for ((part, amount), (_, deviation)) in parts.iter().zip(amounts).zip(columns) {
        let more = amount / deviation * spread / gain;
        filled = filled.with_more(part, more.is_finite().then_some(more)?);
    }
    Some(filled.held_to_what_was(driver))
}

/// Whether a term works through a covariate that has gaps within the record.
pub(super) fn has_gaps(problem: &Problem, drivers: &[Driver], term: &Term) -> bool {
    let (first, last) = (problem.t[0], problem.t[problem.t.len() - 1]);
    let driver = Driver::at(drivers, term.channel);
    driver.is_some_and(|driver| driver.gaps_within(first, last).next().is_some())
}

//! What entered early leaves again where what came later does its work.

use super::fresh::{best_of_starts, fresh_starts};
use super::judge::named;
use super::problem::Problem;
use super::refit::{Fitted, Start, likeliest, refit, towards, under_likeliest};
use super::search::{Accepted, Search};
use super::term::{Term, coefficients_of, time_of};

/// Steps towards the fit without a term, after which it is needed if the BIC is still higher by so many margins.
const FIRST_STEPS: usize = 5;
const BEYOND_DOUBT: f64 = 10.0;

impl Search<'_> {
    /// Takes out what is not needed beside the newest effect: one by one, that first without which the BIC is lowest, while
    /// it rises by less than the margin.
    pub(super) fn drop_needless(&mut self, full: &mut Fitted, accepted: &mut Vec<Accepted>) {
        while full.terms.len() > 1 {
            let each = 0..full.terms.len() - 1;
            let without: Vec<(usize, Fitted)> = each
                .filter_map(|index| Some((index, self.without(full, index)?)))
                .collect();
            let bic = |one: &Fitted| one.bic(self.problem);
            let least = without
                .into_iter()
                .min_by(|a, b| bic(&a.1).total_cmp(&bic(&b.1)));
            let Some((index, fitted)) = least else { return };
            let rise = bic(&fitted) - bic(full);
            if rise >= self.options.bic_margin {
                return;
            }
            let why = format!(
                "needless beside what was found after it: without it the BIC rises by {rise:.1} only"
            );
            self.refuse_after_all(&full.terms[index], &why);
            accepted.remove(index);
            *full = fitted;
        }
    }

    /// The joint fit without the term of that index; `None` where it is needed beyond doubt.
    fn without(&mut self, full: &Fitted, index: usize) -> Option<Fitted> {
        let problem = self.problem;
        let start = start_without(problem, full, index);
        let whitener = self.bank.iter().find(|one| one.noise == full.noise)?;
        let near = towards(problem, &start, whitener, (FIRST_STEPS, &mut self.scratch))?;
        if near.bic(problem) - full.bic(problem) > BEYOND_DOUBT * self.options.bic_margin {
            return None;
        }
        self.joint(start)
    }

    /// The joint fit without the term of that index, however much it is needed.
    pub(super) fn without_at_all(&mut self, full: &Fitted, index: usize) -> Option<Fitted> {
        self.joint(start_without(self.problem, full, index))
    }

    /// The likeliest fit of these terms, from `start` and from fresh laws.
    fn joint(&mut self, start: Start) -> Option<Fitted> {
        let (problem, bank) = (self.problem, self.bank);
        let mut fits = Vec::from_iter(refit(problem, &start, bank, &mut self.scratch));
        let mut starts = fresh_starts(problem, &start.terms);
        starts.push(start);
        if let Some(level) = best_of_starts(problem, &starts, &mut self.scratch) {
            let start = under_likeliest(problem, &level, bank, &mut self.scratch);
            fits.extend(refit(problem, &start, bank, &mut self.scratch));
        }
        likeliest(problem, fits.into_iter())
    }

    /// Says of the accepted candidate that this term is why it is none any more.
    pub(super) fn refuse_after_all(&mut self, term: &Term, why: &str) {
        let channel = named(term, self.drivers).channel;
        let at = time_of(self.problem, term);
        let own = self.candidates.iter_mut().find(|one| {
            one.rejected_because.is_none()
                && one.effect == term.kind
                && one.channel == channel
                && one.at == at
        });
        if let Some(candidate) = own {
            candidate.rejected_because = Some(why.to_owned());
        }
    }
}

/// `full` without the term of that index and its coefficients.
pub(super) fn start_without(problem: &Problem, full: &Fitted, index: usize) -> Start {
    let mut start = Start::at(full);
    start
        .parameters
        .drain(coefficients_of(problem, &full.terms, index));
    start.terms.remove(index);
    start
}

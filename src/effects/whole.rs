//! All effects together, judged once more at the end. Each was judged beside what had been found before it; what came after it has moved
//! the law, the delays and the sizes, and what is reported are the errors of all of them.

use super::judge::{
    Compared, StepErrors, WithoutAny, arrived_without_block, held_out, step_errors, without_block,
};
use super::problem::Problem;
use super::refit::Fitted;
use super::search::{Accepted, Search};
use super::term::{Scratch, Term};

/// What grows by no more than this factor has not grown.
const GROWN: f64 = 1.005;

/// The errors over a later block, mm or mm/day.
#[derive(Debug, Clone, Copy)]
struct BlockErrors {
    /// Root mean square, extrapolated over all of it, by the fit from leading starts and by the one that has arrived: how far a law drifts may
    /// turn on that alone.
    extrapolated: [f64; 2],
    /// Root mean square, each reading predicted from those before it.
    by_steps: f64,
}

impl BlockErrors {
    fn are_no_larger_than(self, other: Self) -> bool {
        let mut both = self.extrapolated.iter().zip(other.extrapolated);
        both.all(|(own, theirs)| *own <= theirs) && self.by_steps <= other.by_steps
    }
}

/// How a law with all its effects predicts its later block, beside that without any.
#[derive(Debug, Clone, Copy)]
struct Whole {
    /// The first reading of the block.
    from: usize,
    /// The errors from reading to reading, mm or mm/day.
    before: f64,
    after: f64,
    /// Whether the error extrapolated over all of the block falls.
    extrapolates_nearer: bool,
}

impl Whole {
    /// `None` where there is no later block, or the law cannot be fitted without it.
    fn of(
        problem: &Problem,
        laws: WithoutAny<'_>,
        full: &Fitted,
        share: f64,
        scratch: &mut Scratch,
    ) -> Option<Self> {
        let by_least_squares = Compared {
            before: laws.plain,
            after: full,
        };
        let held = held_out(problem, by_least_squares, share, scratch)?;
        let (plain, extrapolated) = held.errors(problem);
        let models = Compared {
            before: laws.null,
            after: full,
        };
        let steps = step_errors(problem, models, held.from, full.terms.len(), scratch)?;
        Some(Self {
            from: held.from,
            before: steps.before,
            after: steps.after,
            extrapolates_nearer: extrapolated < plain,
        })
    }

    /// Whether the readings of the block are predicted worse with the effects than without any, each from those before it: clearly, or a little and
    /// no better over all of it. From reading to reading a law with many readings between its bends is as good as any, and its noise decides.
    fn is_worse(&self, problem: &Problem) -> bool {
        let is_clear = self.after > GROWN * self.before || !self.extrapolates_nearer;
        self.after > self.before && is_clear && StepErrors::is_a_figure(problem, self.before)
    }
}

/// Whether the later block of `full` is predicted worse with its effects than without any, from reading to reading.
pub(super) fn is_worse_than_none(
    problem: &Problem,
    laws: WithoutAny<'_>,
    full: &Fitted,
    share: f64,
    scratch: &mut Scratch,
) -> bool {
    let whole = Whole::of(problem, laws, full, share, scratch);
    !full.terms.is_empty() && whole.is_some_and(|whole| whole.is_worse(problem))
}

impl Search<'_> {
    /// Takes out, that first which gains least, each effect without which the later block is predicted no worse in either way; and all of
    /// them where what is left predicts it worse than none.
    pub(super) fn judge_together(
        &mut self,
        laws: WithoutAny<'_>,
        full: &mut Fitted,
        accepted: &mut Vec<Accepted>,
    ) {
        let (problem, share) = (self.problem, self.options.held_out_share);
        // What blurs the readings, or has happened once, says nothing of what comes.
        let says_what_comes = |term: &Term| term.kind.definition().says_what_comes;
        if !full.terms.iter().any(says_what_comes) {
            return;
        }
        while !full.terms.is_empty() {
            let whole = Whole::of(problem, laws, full, share, &mut self.scratch);
            let Some(whole) = whole else { return };
            if let Some((index, without)) = self.not_needed(laws, full, accepted, &whole) {
                let why = "beside all others it helps to predict no held-out reading";
                self.refuse_after_all(&full.terms[index], why);
                accepted.remove(index);
                *full = without;
            } else if whole.is_worse(problem) {
                let why = "with all effects together the held-out readings are predicted worse than without any";
                for term in std::mem::take(&mut full.terms) {
                    self.refuse_after_all(&term, why);
                }
                accepted.clear();
                full.clone_from(laws.null);
            } else {
                return;
            }
        }
    }

    /// The effect of the smallest gain without which the block is predicted no worse, and the law without it. What says nothing of what
    /// comes is asked only where all together predict it worse than none.
    fn not_needed(
        &mut self,
        laws: WithoutAny<'_>,
        full: &Fitted,
        accepted: &[Accepted],
        whole: &Whole,
    ) -> Option<(usize, Fitted)> {
        let is_worse = whole.is_worse(self.problem);
        let with = self.errors_of(laws, full, whole.from)?;
        let is_asked =
            |index: &usize| is_worse || full.terms[*index].kind.definition().says_what_comes;
        let mut order: Vec<usize> = (0..full.terms.len()).filter(is_asked).collect();
        order.sort_by(|a, b| accepted[*a].bic_gain.total_cmp(&accepted[*b].bic_gain));
        order.into_iter().find_map(|index| {
            let without = if full.terms.len() == 1 {
                laws.null.clone()
            } else {
                self.without_at_all(full, index)?
            };
            let errors = self.errors_of(laws, &without, whole.from)?;
            errors.are_no_larger_than(with).then_some((index, without))
        })
    }

    /// What a law with some of the effects, or with none, predicts of the readings from `from` on.
    fn errors_of(
        &mut self,
        laws: WithoutAny<'_>,
        fitted: &Fitted,
        from: usize,
    ) -> Option<BlockErrors> {
        let (problem, scratch) = (self.problem, &mut self.scratch);
        let leading = without_block(problem, fitted, from, scratch)?;
        let arrived = arrived_without_block(problem, fitted, from, scratch)?;
        let models = Compared {
            before: laws.null,
            after: fitted,
        };
        let steps = step_errors(problem, models, from, fitted.terms.len(), scratch)?;
        let by_steps = if fitted.terms.is_empty() {
            steps.before
        } else {
            steps.after
        };
        Some(BlockErrors {
            extrapolated: [leading, arrived].map(|one| one.rms(problem, from..problem.t.len())),
            by_steps,
        })
    }
}

#[cfg(test)]
mod tests;

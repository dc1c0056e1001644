//! What people declare to be there, put into the law together, and each judged beside all others.

use super::backward::start_without;
use super::candidates::follows_season;
use super::diagnosis::Judged;
use super::explain::{TOO_FEW, explained_by};
use super::explanation::{Candidate, DeclaredEffect, Effect, Explained, Explanation};
use super::findings::{Findings, findings};
use super::given::{Cause, fits_best_before, put_in, shapes};
use super::judge::coefficients;
use super::kind::Kind;
use super::options::Options;
use super::problem::Problem;
use super::ready::Ready;
use super::refit::{Fitted, Start, refit};
use super::search::{Accepted, Refitted, Search, SearchResult};
use super::surrogate::{Innovations, Tried};
use super::term::Scratch;
use super::upslope;
use super::verdict::{Verdict, effect};
use crate::reading::{Channel, Series, Timestamp, after_days, days_since};

/// Why a cause is no part of the law of a record.
const NOT_SEEN: &str = "it cannot be put into the law: the record is too short for it, too widely sampled, or of a quantity \
                        that does not show it";
/// The same, of a covariate.
const NO_COVER: &str =
    "it cannot be put into the law: the covariate stands still, or covers too little of the record";
/// The same, of readings that fall.
const UPSLOPE: &str = "the readings fall: nothing is judged before their sign is right";
/// Of all figures, where something was refused.
const ALL_IN: &str = "All that was declared is in the law of these errors and of this forecast, also what does not stand.";

/// Explains `series` by the effects that are declared, and by no others. All are put into the law and fitted together. Each is
/// judged by what it adds to the law with all others, as [`explain`](super::explain()) judges what it finds; but it competes with
/// no other kind, and its chance of gaining as much from nothing is that of its own delays or times alone. What
/// does not stand stays in the law: errors and forecast are those of all that was declared. `progress` is called with the
/// share done, 0 to 1.
pub fn explain_given(
    series: &Series,
    channels: &[Channel],
    causes: &[Cause],
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> Explanation {
    let is_named = |channel: &&Channel| {
        let mut named = causes.iter().filter_map(|cause| cause.channel.as_ref());
        named.any(|name| *name == channel.name)
    };
    let channels: Vec<Channel> = channels.iter().filter(is_named).cloned().collect();
    let mut given = Vec::new();
    let look = |cleaned: &Series, channels: &[Channel], is_drawn: bool| {
        let mut remarks = Vec::new();
        let ready = Ready::of(cleaned, channels, &mut remarks);
        let refused = ready
            .as_ref()
            .and_then(|ready| upslope::refused(&ready.problem, cleaned.unit, &mut remarks));
        if let Some(refused) = refused {
            given = causes.iter().map(|one| not_put_in(one, UPSLOPE)).collect();
            return (refused, remarks);
        }
        let law = ready
            .as_ref()
            .and_then(|ready| DeclaredLaw::of(ready, causes, is_drawn, options, progress));
        let (Some(ready), Some(law)) = (&ready, law) else {
            remarks.push(TOO_FEW.to_owned());
            given = causes.iter().map(|one| not_put_in(one, TOO_FEW)).collect();
            return (Findings::none(cleaned.unit), remarks);
        };
        let elsewhere = moved(causes, &law.terms, &ready.problem);
        let (findings, judged) = law.findings(ready, causes, options);
        let is_refused = |one: &DeclaredEffect| one.rejected_because.is_some();
        if judged.iter().any(is_refused) && !findings.known_load.parts.is_empty() {
            remarks.push(ALL_IN.to_owned());
        }
        remarks.extend(elsewhere);
        given = judged;
        progress(1.0);
        (findings, remarks)
    };
    let explanation = explained_by(series, &channels, options, look);
    Explanation {
        given,
        ..explanation
    }
}

/// What was found of one term that was declared.
#[derive(Debug)]
struct DeclaredTerm {
    how: Accepted,
    held_out: Option<f64>,
    rejected_because: Option<String>,
    /// When it would fit best, of what happened at a declared time.
    fits_best: Option<Timestamp>,
}

/// The law with all that was declared and can be put into it.
#[derive(Debug)]
struct DeclaredLaw {
    /// The plain law under its likeliest noise.
    null: Fitted,
    full: Fitted,
    /// By term of `full`, which cause it is, and what was found of it.
    terms: Vec<(usize, DeclaredTerm)>,
    candidates: Vec<Candidate>,
}

impl DeclaredLaw {
    fn of(
        ready: &Ready,
        causes: &[Cause],
        is_drawn: bool,
        options: &Options,
        progress: &mut dyn FnMut(f64),
    ) -> Option<Self> {
        progress(0.05);
        let mut search = ready.search(options, is_drawn);
        let null = search.null(&ready.plain)?;
        let (full, placed) = put_in(&mut search, null.clone(), causes)?;
        let mut terms = Vec::new();
        for (index, cause) in placed.into_iter().enumerate() {
            progress(0.3 + 0.6 * index as f64 / causes.len() as f64);
            terms.push((cause, search.declared(&full, index, &causes[cause])?));
        }
        Some(Self {
            null,
            full,
            terms,
            candidates: search.candidates,
        })
    }

    /// What is reported of it, and each cause with its judgement.
    fn findings(
        self,
        ready: &Ready,
        causes: &[Cause],
        options: &Options,
    ) -> (Findings, Vec<DeclaredEffect>) {
        let mut scratch = Scratch::default();
        let of_term = |(index, (_, found)): (usize, &(usize, DeclaredTerm))| {
            effect(ready, &self.full, index, &found.how, &mut scratch)
        };
        let effects: Vec<Effect> = self.terms.iter().enumerate().map(of_term).collect();
        let each = causes.iter().enumerate();
        let given = each.map(|(cause, declared)| {
            let place = self.terms.iter().position(|(own, _)| *own == cause);
            place.map_or_else(
                || not_put_in(declared, reason(declared)),
                |index| self.judgement(declared, index, &effects[index]),
            )
        });
        let given: Vec<DeclaredEffect> = given.collect();
        let mut standing: Vec<usize> = (0..effects.len())
            .filter(|index| self.terms[*index].1.rejected_because.is_none())
            .collect();
        standing.sort_by(|a, b| effects[*b].bic_gain.total_cmp(&effects[*a].bic_gain));
        let last = if standing.is_empty() {
            &self.null
        } else {
            &self.full
        };
        let judged = Judged::of(&ready.problem, last, &ready.bank, &mut scratch);
        // Noise that remembers is no effect that was declared, and without one it stands for all that is not explained.
        let is_left = judged.is_some_and(|judged| {
            let remembers = standing.is_empty() && judged.memory_gain() > options.bic_margin;
            judged.load_gain() > options.bic_margin || remembers
        });
        let is_any_refused = standing.len() < causes.len();
        let verdict = self.verdict(&effects, &standing, is_left, is_any_refused);
        let found = SearchResult {
            plain: ready.plain.clone(),
            null: self.null,
            full: self.full,
            accepted: Vec::new(),
            candidates: self.candidates,
            withheld: None,
            has_slow_load: false,
            may_have_acted: Vec::new(),
            is_daily: false,
        };
        let findings = findings(ready, found, verdict, options, &mut scratch);
        (findings, given)
    }

    fn judgement(&self, declared: &Cause, index: usize, effect: &Effect) -> DeclaredEffect {
        let found = &self.terms[index].1;
        DeclaredEffect {
            declared: declared.to_string(),
            effect: Some(effect.clone()),
            held_out: found.held_out,
            rejected_because: found.rejected_because.clone(),
        }
    }

    /// What stands, that first which gains most; `is_left`: structure is left in the residual.
    fn verdict(
        &self,
        effects: &[Effect],
        standing: &[usize],
        is_left: bool,
        is_any_refused: bool,
    ) -> Verdict {
        let mut stand: Vec<Effect> = standing
            .iter()
            .map(|index| effects[*index].clone())
            .collect();
        let explained = match (stand.is_empty(), is_left || is_any_refused) {
            (true, _) => Explained::None,
            (false, true) => Explained::Partly,
            (false, false) => Explained::Full,
        };
        if stand.is_empty() {
            let kind = if is_left {
                Kind::UNEXPLAINED
            } else {
                Kind::NONE
            };
            stand.push(Effect::of(kind));
        }
        let ties = standing
            .iter()
            .flat_map(|index| self.terms[*index].1.how.ties.clone());
        Verdict {
            effects: stand,
            explained,
            cannot_separate_from: ties.collect(),
            full: self.full.clone(),
        }
    }
}

/// Which causes would fit best at another time than the one that was declared.
fn moved(causes: &[Cause], terms: &[(usize, DeclaredTerm)], problem: &Problem) -> Vec<String> {
    let each = terms.iter().filter_map(|(index, found)| {
        let cause = &causes[*index];
        let (declared, best) = (cause.at?, found.fits_best?);
        let days = days_since(declared, best);
        (days.abs() > 1.5 * problem.spacing).then(|| {
            format!(
                "{cause}: it fits best at {best:.0}, {:.1} days {}; it is judged at the time that was declared.",
                days.abs(),
                if days > 0.0 { "later" } else { "earlier" }
            )
        })
    });
    each.collect()
}

fn reason(cause: &Cause) -> &'static str {
    if cause.kind.has_channel() {
        NO_COVER
    } else {
        NOT_SEEN
    }
}

fn not_put_in(cause: &Cause, reason: &str) -> DeclaredEffect {
    DeclaredEffect {
        declared: cause.to_string(),
        effect: None,
        held_out: None,
        rejected_because: Some(reason.to_owned()),
    }
}

impl Search<'_> {
    /// What the term of that index, which is `cause`, adds to the law with all others.
    fn declared(&mut self, full: &Fitted, index: usize, cause: &Cause) -> Option<DeclaredTerm> {
        let problem = self.problem;
        let base = self.without_at_all(full, index)?;
        let start = with_last(problem, full, index);
        let fitted = refit(problem, &start, self.bank, &mut self.scratch)?;
        let term = fitted.terms.last()?.clone();
        let one = Refitted {
            gain: base.bic(problem) - fitted.bic(problem),
            follows_season: follows_season(problem, &term),
            rms: fitted.rms(problem, 0..problem.used),
            term,
            fitted,
            p_value: 1.0,
        };
        let (one, best) = self.as_declared(&base, one, cause)?;
        let fits_best = best.and_then(|at| after_days(problem.epoch, problem.t[at]));
        let (held_out, objection) = self.judged(&base, &one);
        let rejected_because = objection.map(|objection| objection.why);
        self.note(&one.term, &one, held_out, rejected_because.clone());
        let how = Accepted {
            bic_gain: one.gain,
            p_value: one.p_value,
            ties: Vec::new(),
        };
        Some(DeclaredTerm {
            how: one.with_season(how, problem),
            held_out,
            rejected_because,
            fits_best,
        })
    }

    /// With the chance that its kind, at the delays or times that it may have, gains as much without any effect; and before which reading it would
    /// fit best, where its time is declared.
    fn as_declared(
        &mut self,
        base: &Fitted,
        one: Refitted,
        cause: &Cause,
    ) -> Option<(Refitted, Option<usize>)> {
        let (count, seed) = (self.options.surrogates, self.options.seed);
        let ground = self.ground(base)?;
        let terms = shapes(&ground, cause);
        let best = fits_best_before(&ground, cause);
        let of_noise = |kind| {
            let tried: Vec<Tried> = terms.iter().map(|term| ground.tried(term)).collect();
            let null_gains = ground.null_gains_of_noise(&tried, kind, count, seed + 1);
            null_gains.p_value(one.gain)
        };
        let p_value = if one.term.is_jump_of_reading() {
            of_noise(Innovations::WithoutJumps)
        } else if let Some(channel) = one.term.channel {
            let place = ground.drivers.iter().position(|own| own.index == channel)?;
            let own = &ground.drivers[place..=place];
            let null_gains = ground.null_gains_of(own, count, seed);
            // The null gains have paid for nothing.
            let paid = one.gain + ground.cost(&one.term);
            let shifted = self.amplified(base, null_gains).p_value(paid);
            if one.is_its_own_shift(shifted) {
                of_noise(Innovations::AsTheyAre)
            } else {
                shifted
            }
        } else {
            of_noise(Innovations::AsTheyAre)
        };
        let one = Refitted { p_value, ..one }.judged_by_astronomy();
        Some((one, best))
    }
}

/// `full` with the term of that index at the end.
fn with_last(problem: &Problem, full: &Fitted, index: usize) -> Start {
    let mut start = start_without(problem, full, index);
    let own = coefficients(problem, full, index);
    start.parameters.extend_from_slice(own);
    start.terms.push(full.terms[index].clone());
    start
}

#[cfg(test)]
mod tests;

//! The search: one effect after another, each refitted with the law and judged, while any earns its place.

use super::act::{Act, amplitudes};
use super::candidates;
use super::definition::Support;
use super::explanation::Candidate;
use super::fresh::{best_of_starts, plain_starts};
use super::inverted::inverted_starts;
use super::judge::{WithoutAny, newest_coefficients};
use super::kind::Kind;
use super::noise::{Noise, Whitener};
use super::objection::Judgement;
use super::options::Options;
use super::problem::Problem;
use super::refit::{Fitted, Start, refit_every_memory};
use super::response::Driver;
use super::rival::Rival;
use super::surrogate::NullGains;
use super::term::{Scratch, Term, law_parameters, time_of};
use crate::reading::Timestamp;

/// Most effects in one law.
const MOST_EFFECTS: usize = 10;
/// A search's p-value must lie under this.
pub(super) const SIGNIFICANT: f64 = 0.01;

/// So much of the usual starts' error the law of an inversion must leave at most.
const FAR_NEARER: f64 = 0.7;

/// By how much of the BIC a fit is better for the search to begin with it again.
const BETTER: f64 = 1.0;

/// The load steps by less than this where the velocity's own jump goes unseen, e-folds.
const LEAST_JUMP: f64 = 0.1;

/// Sets of constituents that are tried, with a margin for noise of another kind than those of the bank.
const ASTRONOMICAL: f64 = 20.0;

/// Why nothing is concluded from a drawn or interpolated curve by its shape alone.
const NO_READINGS: &str =
    "the values are not raw readings: they are smoother than any instrument gives";

/// One effect that was accepted.
#[derive(Debug, Clone)]
pub(super) struct Accepted {
    pub(super) bic_gain: f64,
    pub(super) p_value: f64,
    /// What would have done as well.
    pub(super) ties: Vec<Rival>,
}

/// What would be accepted of values that are not raw readings, were they readings.
#[derive(Debug, Clone, Copy)]
pub(super) struct Withheld {
    pub(super) kind: Kind,
    pub(super) at: Option<Timestamp>,
    bic_gain: f64,
}

/// What a search came to.
pub(super) struct SearchResult {
    /// The plain law by least squares, and under its likeliest noise.
    pub(super) plain: Fitted,
    pub(super) null: Fitted,
    /// The law with every effect accepted, under the likeliest noise.
    pub(super) full: Fitted,
    /// By term of `full`.
    pub(super) accepted: Vec<Accepted>,
    pub(super) candidates: Vec<Candidate>,
    /// What gains most, in the last round, of what was refused because the values are not raw readings.
    pub(super) withheld: Option<Withheld>,
    /// Whether a load that nothing measures accounts for what is left better than any effect.
    pub(super) has_slow_load: bool,
    /// Of what was refused in the last round, what may have acted all the same.
    pub(super) may_have_acted: Vec<Rival>,
    /// Whether a daily cycle is left that may be a tide's, melt water's or the instrument's.
    pub(super) is_daily: bool,
}

/// What may be added to a law.
pub(super) enum OneMore {
    /// Effects, the law refitted with them.
    Effect(Fitted, Vec<Accepted>),
    /// No effect: a load that nothing measures, with which the law was refitted, explains more than any. And what it gains.
    SlowLoad(Fitted, f64),
}

/// What of an effect was declared by people, and is not searched for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DeclaredPart {
    /// Nothing.
    Nothing,
    /// That it is there.
    Effect,
    /// And when: it is not moved to another reading.
    EffectAndTime,
}

/// A search at work.
pub(super) struct Search<'a> {
    pub(super) problem: &'a Problem,
    pub(super) drivers: &'a [Driver],
    pub(super) bank: &'a [Whitener],
    pub(super) options: &'a Options,
    /// Whether the values are not raw readings: smoother than any instrument's.
    pub(super) is_drawn: bool,
    pub(super) declared: DeclaredPart,
    pub(super) scratch: Scratch,
    pub(super) candidates: Vec<Candidate>,
    pub(super) withheld: Option<Withheld>,
    /// Whether a tide was refused in this round because a daily cycle explains the same.
    pub(super) is_daily: bool,
    /// Whether the event found in this round cannot be separated from a load that changes over a while and that nothing measures.
    pub(super) is_slow_alike: bool,
    /// Of what was refused in this round, what may have acted all the same: a slow load cannot be separated from it, or slip looks the same.
    pub(super) may_have_acted: Vec<Rival>,
    /// The law without any effect, by which all effects together are judged.
    pub(super) null: Option<Fitted>,
}

impl<'a> Search<'a> {
    /// Before anything was tried; `is_drawn`: the values are smoother than any instrument's.
    pub(super) fn new(
        problem: &'a Problem,
        drivers: &'a [Driver],
        bank: &'a [Whitener],
        options: &'a Options,
        is_drawn: bool,
    ) -> Self {
        Self {
            problem,
            drivers,
            bank,
            options,
            is_drawn,
            declared: DeclaredPart::Nothing,
            scratch: Scratch::default(),
            candidates: Vec::new(),
            withheld: None,
            may_have_acted: Vec::new(),
            is_daily: false,
            is_slow_alike: false,
            null: None,
        }
    }

    /// The same through other covariates, before anything was tried. It has the scratch of this one, which is to be given back.
    pub(super) fn through_others<'b>(&mut self, drivers: &'b [Driver]) -> Search<'b>
    where
        'a: 'b,
    {
        Search {
            scratch: std::mem::take(&mut self.scratch),
            ..Search::new(
                self.problem,
                drivers,
                self.bank,
                self.options,
                self.is_drawn,
            )
        }
    }
}

/// A refitted candidate.
pub(super) struct Refitted {
    pub(super) term: Term,
    pub(super) fitted: Fitted,
    /// By least squares, mm or mm/day.
    pub(super) rms: f64,
    /// Whether it is a covariate that mostly repeats itself from year to year.
    pub(super) follows_season: bool,
    pub(super) gain: f64,
    pub(super) p_value: f64,
}

impl Refitted {
    /// What follows the year cannot be distinguished from the season.
    pub(super) fn with_season(&self, mut how: Accepted, problem: &Problem) -> Accepted {
        let season = Rival::from(Kind::SEASONAL);
        let seen = candidates::are_two_years(problem);
        if self.follows_season && seen && !how.ties.contains(&season) {
            how.ties.push(season);
        }
        how
    }

    /// Whether it is a step of the load by which the velocity itself hardly jumps: all that it does is to change the pace
    /// at which the slope ages, which is a change of its friction.
    pub(super) fn hardly_jumps(&self) -> bool {
        let size = self.fitted.parameters.last();
        matches!(self.term.act, Act::Step) && size.is_some_and(|size| size.abs() < LEAST_JUMP)
    }

    /// The standard deviation of its log-load; `None` where it is none.
    pub(super) fn load_sd(&self) -> Option<f64> {
        let is_load = matches!(self.term.act, Act::Load(_));
        let squares = newest_coefficients(&self.fitted)
            .iter()
            .map(|gain| gain * gain);
        is_load.then(|| squares.sum::<f64>().sqrt())
    }

    /// The amplitude of the largest of its waves.
    pub(super) fn wave_amplitude(&self) -> f64 {
        amplitudes(newest_coefficients(&self.fitted)).fold(0.0, f64::max)
    }

    /// Whether it is the same effect, with whatever delay.
    pub(super) fn is_as(&self, other: &Self) -> bool {
        let form = |one: &Self| one.term.response.map(|response| response.form);
        let same = self.term.kind == other.term.kind && self.term.channel == other.term.channel;
        same && form(self) == form(other)
    }

    /// Two searches were made, and either could have spoken.
    pub(super) fn judged_by(self, null_gains: &NullGains, gain: f64) -> Self {
        Self {
            p_value: null_gains.p_of_two(gain),
            ..self
        }
    }
}

impl Refitted {
    /// The periods of a tide are known beforehand: what a search over all kinds and times gains from nothing is no measure
    /// of it, and the likelihood that the gain stands for is enough.
    pub(super) fn judged_by_astronomy(self) -> Self {
        if self.term.kind.definition().support != Support::Astronomy {
            return self;
        }
        let by_chance = ASTRONOMICAL * (-0.5 * self.gain).exp();
        Self {
            p_value: self.p_value.min(by_chance),
            ..self
        }
    }
}

/// The plain law by least squares; `None` where no start leads to a motion. That which the law's inversion leads to is taken only where the
/// usual starts miss it by far: one that is a little nearer to the readings has bent towards what an effect does, and hides it.
pub(super) fn plain(problem: &Problem, scratch: &mut Scratch) -> Option<Fitted> {
    let usual = best_of_starts(problem, &plain_starts(problem), scratch);
    let inverted = best_of_starts(problem, &inverted_starts(problem, scratch), scratch);
    let Some(usual) = usual else {
        return inverted;
    };
    let rms = |fitted: &Fitted| fitted.rms(problem, 0..problem.used);
    let is_far = |inverted: &Fitted| rms(inverted) < FAR_NEARER * rms(&usual);
    inverted.filter(is_far).or(Some(usual))
}

impl Search<'_> {
    /// The plain law under its likeliest noise.
    pub(super) fn null(&mut self, plain: &Fitted) -> Option<Fitted> {
        let mut starts = plain_starts(self.problem);
        starts.truncate(2);
        starts.push(Start::at(plain));
        let fits = starts.iter().filter_map(|start| {
            refit_every_memory(self.problem, start, self.bank, &mut self.scratch)
        });
        fits.min_by(|a, b| a.bic(self.problem).total_cmp(&b.bic(self.problem)))
    }

    /// The whiteners of that noise.
    pub(super) fn whiteners_of(&self, noise: Noise) -> Vec<Whitener> {
        let own = self.bank.iter().filter(|one| one.noise == noise);
        own.cloned().collect()
    }

    /// Adds effects to the plain law until none earns its place.
    pub(super) fn run(
        mut self,
        plain: Fitted,
        progress: &mut dyn FnMut(f64),
    ) -> Option<SearchResult> {
        let mut plain = plain;
        let mut null = self.null(&plain)?;
        let mut full = null.clone();
        let mut accepted = Vec::new();
        let mut has_slow_load = false;
        for round in 0..MOST_EFFECTS {
            progress(0.1 + 0.8 * round as f64 / MOST_EFFECTS as f64);
            let noted = self.candidates.clone();
            self.null = Some(null.clone());
            let (next, how) = match self.one_more(&full, round) {
                Some(OneMore::Effect(next, how)) => (next, how),
                Some(OneMore::SlowLoad(next, _)) => (next, Vec::new()),
                None => break,
            };
            if let Some(better) = self.better_without(&full, &next) {
                if accepted.is_empty() {
                    (plain, null) = (self.nearer(plain, &better), better.clone());
                }
                (full, self.candidates) = (better, noted);
                continue;
            }
            has_slow_load = how.is_empty();
            if has_slow_load {
                break;
            }
            full = next;
            accepted.extend(how);
            self.drop_needless(&mut full, &mut accepted);
            self.settle_delays(&mut full);
        }
        let laws = WithoutAny {
            plain: &plain,
            null: &null,
        };
        self.judge_together(laws, &mut full, &mut accepted);
        self.refuse_beside_a_late_covariate(&null, &mut full, &mut accepted);
        Some(SearchResult {
            plain,
            null,
            full,
            accepted,
            candidates: self.candidates,
            withheld: self.withheld,
            has_slow_load,
            may_have_acted: self.may_have_acted,
            is_daily: self.is_daily,
        })
    }

    /// `base` fitted again from the law that `next` has with one effect more: where that is the better one without this effect too, the
    /// effect was credited with what a poor fit had missed.
    fn better_without(&mut self, base: &Fitted, next: &Fitted) -> Option<Fitted> {
        let mut start = Start::at(base);
        let law = law_parameters(self.problem);
        start.parameters[..law].copy_from_slice(&next.parameters[..law]);
        let fitted = refit_every_memory(self.problem, &start, self.bank, &mut self.scratch)?;
        (fitted.bic(self.problem) < base.bic(self.problem) - BETTER).then_some(fitted)
    }

    /// The plain law by least squares from that of `better`, or `plain` where that is nearer to the readings.
    fn nearer(&mut self, plain: Fitted, better: &Fitted) -> Fitted {
        let found = best_of_starts(self.problem, &[Start::at(better)], &mut self.scratch);
        let nearer = found.filter(|found| found.deviance < plain.deviance);
        nearer.unwrap_or(plain)
    }

    /// Why not; `None` for what may be accepted. The held-out error with it over that without comes first.
    pub(super) fn judged(&mut self, base: &Fitted, one: &Refitted) -> Judgement {
        if let Some(reason) = self.refused_at_once(one) {
            let after_all = self.predicted_after_all(base, one);
            return after_all.map_or((None, Some(reason)), |held| (Some(held), None));
        }
        if let Some(reason) = self.daily_instead(base, one) {
            return (None, Some(reason.into()));
        }
        if self.is_drawn && !one.term.kind.has_independent_evidence() {
            self.withhold(one);
            return (None, Some(NO_READINGS.to_owned().into()));
        }
        if one.term.is_jump_of_reading() && self.takes_several_readings(&one.fitted) {
            let reason = "the jump goes on over the readings beside it: motion looks the same";
            return (None, Some(reason.to_owned().into()));
        }
        if !one.term.kind.definition().says_what_comes {
            return (None, None);
        }
        self.held_out(base, one)
    }

    fn withhold(&mut self, one: &Refitted) {
        if self.withheld.is_none_or(|best| best.bic_gain < one.gain) {
            let at = time_of(self.problem, &one.term);
            self.withheld = Some(Withheld {
                kind: one.term.kind,
                at,
                bic_gain: one.gain,
            });
        }
    }

    pub(super) fn note(
        &mut self,
        term: &Term,
        one: &Refitted,
        held: Option<f64>,
        reason: Option<String>,
    ) {
        let channel = Driver::at(self.drivers, term.channel).map(|driver| driver.name.clone());
        let candidate = Candidate {
            effect: term.kind,
            channel,
            form: term.response.map(|response| response.form),
            at: time_of(self.problem, term),
            lag_days: term.response.map(|response| response.mean_days),
            bic_gain: one.gain,
            // Of what gains too little none is computed.
            p_value: (one.gain >= self.options.bic_margin || one.p_value < 1.0)
                .then_some(one.p_value),
            held_out: held,
            rejected_because: reason,
        };
        let is_same = |old: &Candidate| {
            old.effect == candidate.effect
                && old.channel == candidate.channel
                && old.form == candidate.form
        };
        // The latest word on one thing stands, unless it had been accepted, or what was accepted since accounts for what it gained.
        let margin = self.options.bic_margin;
        let is_accounted_for =
            |old: &Candidate| is_same(old) && old.bic_gain >= margin && candidate.bic_gain < margin;
        if self.candidates.iter().any(is_accounted_for) {
            return;
        }
        (self.candidates).retain(|old| !is_same(old) || old.rejected_because.is_none());
        self.candidates.push(candidate);
    }
}

#[cfg(test)]
mod tests;

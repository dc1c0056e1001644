//! What a candidate must gain before a later block is looked at.

use super::candidates::is_one_wave;
use super::definition::{Support, Trying};
use super::judge::{named, objection};
use super::noise::Memory;
use super::objection::{Objection, ObjectionWeight};
use super::refit::Fitted;
use super::search::{DeclaredPart, Refitted, SIGNIFICANT, Search};
use super::slip_alike::may_be_slip;

/// So many times the usual margin of the BIC is asked of what only the shape of the readings supports: on walks of .05 to .5 of the white
/// noise 26 of 32 false ones gained less, and none of 70 true ones.
pub(super) const BY_SHAPE: f64 = 2.0;
/// And under noise that remembers, which is seldom quite like one of the bank, of all but jumps of the reading: 5 of 26 drawn records without any effect
/// had one at a fall of 11 to 20, a measured one (BLKM, Salmon Falls Creek) a decoy beside its lake at 21; the smallest of 30 true ones was 68.
const BY_MEMORY: f64 = 2.5;
/// And a covariate with a memory of more than this share of the record must gain so many times the margin: six of 73 measured and drawn series whose
/// covariates had nothing to do with them were put on one, at gains of 10 to 33, four of them with a memory of .39 to .50 of the record.
const SLOW: f64 = 1.0 / 3.0;
const BY_SLOW_RESPONSE: f64 = 4.0;
/// One with a memory of more than this share must gain so many times the margin: of 13 false covariates of measured and drawn records six had such a
/// memory and gained 14 to 25; 13 right ones with such a memory gained 33 to 468.
pub(super) const SLOW_COURSE: f64 = 0.2;
const BY_SLOW_COURSE: f64 = 2.5;
/// A covariate that is one wave of a year, in a record that does not show that the year repeats, must gain so many times the margin: every other slow
/// course looks like it. Six of ten false ones gained less, and none of 120 right ones.
const BY_ONE_WAVE: f64 = 4.0;

/// A covariate that gains as much from nothing in fewer of the cases is named beside what gains less.
const NEARLY_SIGNIFICANT: f64 = 0.1;

impl Search<'_> {
    /// Why not, before any later block is looked at: what it gains, by chance too, and what the physics allow.
    pub(super) fn refused_at_once(&self, one: &Refitted) -> Option<Objection> {
        let margin = self.margin(one);
        if one.gain < margin {
            let (moves, by) = if one.gain < 0.0 {
                ("rises", -one.gain)
            } else {
                ("falls", one.gain)
            };
            let why = format!("the BIC {moves} by {by:.1}; a fall of {margin} is required");
            return Some(why.into());
        }
        let (problem, fitted, drivers) = (self.problem, &one.fitted, self.drivers);
        let by_physics = || self.objection_to_any(fitted);
        let may_have_acted = |why| Objection {
            why,
            weight: ObjectionWeight::MayHaveActed,
        };
        if one.p_value >= SIGNIFICANT {
            let (share, most) = (100.0 * one.p_value, 100.0 * SIGNIFICANT);
            let why = format!(
                "without any effect a search gains as much in {share:.1} % of cases; under {most:.0} % is required"
            );
            let is_nearly = one.term.channel.is_some() && one.p_value < NEARLY_SIGNIFICANT;
            return Some(if is_nearly && by_physics().is_none() {
                may_have_acted(why)
            } else {
                why.into()
            });
        }
        by_physics().map(Objection::from).or_else(|| {
            // Who declares an offset knows that it was the instrument.
            let is_open = self.declared == DeclaredPart::Nothing;
            let slip = is_open.then(|| may_be_slip(problem, fitted, drivers))?;
            slip.map(may_have_acted)
        })
    }

    /// Why the newest term, or one before it now that it is there, is not what the physics allow; `None` if all are.
    fn objection_to_any(&self, fitted: &Fitted) -> Option<String> {
        let (problem, drivers) = (self.problem, self.drivers);
        let to_newest = objection(problem, fitted, drivers);
        let last = fitted.terms.len().saturating_sub(1);
        to_newest.or_else(|| {
            (0..last).find_map(|index| {
                let why = objection(problem, &self.with_term_moved(fitted, index, last), drivers)?;
                let name = named(&fitted.terms[index], drivers);
                Some(format!("beside it {name} is not what it may be: {why}"))
            })
        })
    }

    /// Whether it gains the margin, seldom by chance, and nothing of the physics is against it: it is refused because more is asked of its kind.
    pub(super) fn is_refused_for_its_gain_alone(&self, one: &Refitted) -> bool {
        let is_between = (self.options.bic_margin..self.margin(one)).contains(&one.gain);
        let is_seldom = one.p_value < SIGNIFICANT;
        is_between && is_seldom && objection(self.problem, &one.fitted, self.drivers).is_none()
    }

    /// By how much the BIC has to fall. A walk of the readings that is so small that the law takes it up leaves bends which no noise of the
    /// bank is like: what only the shape of the readings shows, and what happened at a time, has to gain more.
    fn margin(&self, one: &Refitted) -> f64 {
        let definition = one.term.kind.definition();
        let is_dated = matches!(definition.trying, Trying::Once(_) | Trying::JumpOfReading);
        let is_by_shape = is_dated || definition.support == Support::Nothing;
        // Jumps of the reading stand out of noise that remembers: true ones gain 12 to 20.
        let remembers = one.fitted.noise.memory == Memory::Reading;
        let is_jump = matches!(definition.trying, Trying::JumpOfReading);
        let mut times: f64 = 1.0;
        if is_by_shape && !remembers {
            times = BY_SHAPE;
        } else if remembers && !is_jump {
            times = BY_MEMORY;
        }
        if self.is_slower_than(one, SLOW) {
            times = times.max(BY_SLOW_RESPONSE);
        } else if self.is_slower_than(one, SLOW_COURSE) {
            times = times.max(BY_SLOW_COURSE);
        }
        if is_one_wave(self.problem, &one.term) {
            times = times.max(BY_ONE_WAVE);
        }
        times * self.options.bic_margin
    }

    /// Whether a covariate acts over so long a time, as a share of the record, that what it does follows any slow bend.
    pub(super) fn is_slower_than(&self, one: &Refitted, share: f64) -> bool {
        let response = one.term.response;
        response.is_some_and(|own| own.memory_days() > share * self.problem.span())
    }
}

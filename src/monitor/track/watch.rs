//! The watch over the residual: looks at it now and then, says when it has structure, and asks for a search.

use super::adopted::Adopted;
use super::forecast::Forecast;
use super::{StepContext, Track};
use crate::alert::{AlertCause, Policy};
use crate::effects::{Effect, Kind, KnownLoad, Rival, residual_structure};
use crate::forecast::measurably_moves;
use crate::monitor::event::{Event, EventKind, Unexplained};
use crate::monitor::search::{MOST_READINGS, SearchFinding, SearchJob};
use crate::monitor::{Explain, search};
use crate::reading::{Series, Timestamp, days_since};
use serde::{Deserialize, Serialize};

/// Fewer readings are not tested.
const FEWEST: u64 = 40;
/// Readings that a test goes over.
const MOST_TESTED: usize = 400;
/// Fall of the BIC from which on the residual has structure.
const STRUCTURE: f64 = 20.0;
/// A load of less than this, e-folds of velocity, is worth a search but nobody's attention: a third more or less
/// of a slope's velocity is what slopes do.
const WORTH_REPORTING: f64 = 0.3;
/// Two finds of one event lie no further apart than this share of the record.
const SAME_TIME: f64 = 0.05;

/// When was looked, what was said, what was asked for.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Watch {
    taken: u64,
    looked: u64,
    searched: u64,
    /// A search has been asked for and has not come back.
    is_searching: bool,
    /// As of the last look.
    has_structure: bool,
    /// The structure last reported.
    #[serde(rename = "told")]
    reported: Option<f64>,
    known: Vec<KnownEffect>,
}

/// An effect that has been reported.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct KnownEffect {
    kind: Kind,
    channel: Option<String>,
    at: Option<Timestamp>,
    is_adopted: bool,
}

impl Watch {
    /// One more reading; says whether it is time to look: an eighth more than the last time.
    fn is_due(&mut self) -> bool {
        let due = self.taken >= FEWEST && 8 * self.taken >= 9 * self.looked;
        if due {
            self.looked = self.taken;
        }
        due
    }

    pub(super) fn count(&mut self) {
        self.taken += 1;
    }

    /// Whether the newest search has found an effect.
    pub(super) fn has_effect(&self) -> bool {
        !self.known.is_empty()
    }

    /// How many readings there were.
    pub(super) fn taken(&self) -> u64 {
        self.taken
    }

    /// Whether structure of this size is to be reported: when it is new, or has doubled since.
    fn is_news(&mut self, structure: Option<f64>) -> bool {
        let Some(gain) = structure else {
            self.reported = None;
            return false;
        };
        let is_news = self.reported.is_none_or(|reported| gain >= 2.0 * reported);
        if is_news {
            self.reported = Some(gain);
        }
        is_news
    }
}

impl Track {
    /// Looks at the residual of the law in force, where it is time to.
    pub(super) fn watch(
        &mut self,
        policy: &Policy,
        time: Timestamp,
        forecast: &Forecast,
        context: &StepContext<'_>,
    ) -> Option<Event> {
        if self.declared.is_shaken(time) || !self.watch.is_due() {
            return None;
        }
        let moves = measurably_moves(&forecast.plain.rates);
        let found = if moves {
            residual_structure(&self.in_force(context))
        } else {
            None
        };
        let found = found.filter(|found| found.bic_gain >= STRUCTURE);
        self.watch.has_structure = found.is_some();
        let worth = found.filter(|found| found.load_sd >= WORTH_REPORTING);
        if !self.watch.is_news(worth.map(|found| found.bic_gain)) {
            return None;
        }
        let found = worth?;
        self.look_until(policy, time, AlertCause::UnexplainedResidual);
        let kind = Unexplained::Structure {
            bic_gain: found.bic_gain,
            load_sd: found.load_sd,
            since: self.by_calendar(found.since, context),
        };
        Some(self.event(time, EventKind::UnexplainedResidual(kind)))
    }

    /// The readings as the law in force sees them: by the load's clock, where one is adopted.
    fn in_force(&self, context: &StepContext<'_>) -> Series {
        let by_clock = self.adopted.as_ref().and_then(|adopted| {
            let channels = context.covariates.list();
            adopted.readings(&self.history, &channels)
        });
        let observations = by_clock.as_ref().unwrap_or(&self.history.observations);
        self.history
            .series(&self.benchmark, observations, MOST_TESTED)
    }

    /// When that was, of a time by the clock of the law in force.
    fn by_calendar(&self, time: Timestamp, context: &StepContext<'_>) -> Timestamp {
        let channels = context.covariates.list();
        let adopted = self.adopted.as_ref();
        adopted
            .and_then(|adopted| adopted.by_calendar(&self.history, &channels, time))
            .unwrap_or(time)
    }

    /// Whether there is something to explain, or an effect to keep up with the readings, and a third more of
    /// these than at the last search.
    fn wants_search(&self, explain: Explain) -> bool {
        let watch = &self.watch;
        let grown = watch.searched == 0 || 3 * watch.taken >= 4 * watch.searched;
        let wanted = watch.has_structure || self.adopted.is_some();
        explain != Explain::Off && wanted && grown && !watch.is_searching
    }

    /// The search that is to be made after this reading, where one is.
    pub(in crate::monitor) fn search(
        &mut self,
        critical: f64,
        context: &StepContext<'_>,
    ) -> Option<SearchJob> {
        if !self.wants_search(context.phase.explain) {
            return None;
        }
        let observations = &self.history.observations;
        let series = self
            .history
            .series(&self.benchmark, observations, MOST_READINGS);
        let first = series.readings.first()?.time;
        let last = series.readings.last()?.time;
        let channels = context
            .covariates
            .beside(first, last, search::MOST_CHANNELS);
        let asked = self.newest.unwrap_or(last);
        self.watch.is_searching = true;
        self.watch.searched = self.watch.taken;
        Some(SearchJob::new(series, channels, asked, critical))
    }

    /// Takes what a search came to: reports the effects, and forecasts by them where the site wants that.
    pub(in crate::monitor) fn found(
        &mut self,
        critical: f64,
        time: Timestamp,
        finding: &SearchFinding,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        self.watch.is_searching = false;
        let before = self.adopted.take();
        let known_load = supported(finding);
        if context.phase.explain == Explain::Adopt
            && !known_load.parts.is_empty()
            && is_separable(finding)
        {
            let channels = context.covariates.list();
            self.adopted = Some(Adopted::new(known_load, &self.history, &channels, critical));
        }
        let mut events = self.dropped(time, before.as_ref().map(Adopted::law));
        let known: Vec<KnownEffect> = finding
            .effects
            .iter()
            .map(|effect| self.known(effect))
            .collect();
        for (effect, known) in finding.effects.iter().zip(&known) {
            if !self.is_reported(known) {
                events.push(self.effect_event(time, effect, finding, known.is_adopted));
            }
        }
        self.watch.known = known;
        events
    }

    /// From here on levels go by the law without effects.
    pub(in crate::monitor) fn give_up_effects(&mut self, time: Timestamp) -> Vec<Event> {
        let before = self.adopted.take();
        for known in &mut self.watch.known {
            known.is_adopted = false;
        }
        self.dropped(time, before.as_ref().map(Adopted::law))
    }

    fn known(&self, effect: &Effect) -> KnownEffect {
        let law = self.adopted.as_ref().map(Adopted::law);
        let channel = effect.channel.as_deref();
        KnownEffect {
            kind: effect.effect,
            channel: effect.channel.clone(),
            at: effect.at,
            is_adopted: law.is_some_and(|law| law.has(effect.effect, channel)),
        }
    }

    fn is_reported(&self, new: &KnownEffect) -> bool {
        let record = self
            .newest
            .map_or(0.0, |newest| days_since(self.history.epoch, newest));
        self.watch.known.iter().any(|old| {
            let apart = match (old.at, new.at) {
                (Some(old), Some(new)) => days_since(old, new).abs(),
                (None, None) => 0.0,
                (Some(_), None) | (None, Some(_)) => f64::INFINITY,
            };
            let at = new.at;
            apart <= SAME_TIME * record && *new == KnownEffect { at, ..old.clone() }
        })
    }

    fn dropped(&self, time: Timestamp, before: Option<&KnownLoad>) -> Vec<Event> {
        let law = self.adopted.as_ref().map(Adopted::law);
        let parts = before.map_or(&[][..], |law| &law.parts);
        let gone = parts
            .iter()
            .filter(|part| law.is_none_or(|law| !law.has(part.kind(), part.channel())));
        gone.map(|part| {
            let kind = EventKind::EffectDropped {
                effect: part.kind(),
                channel: part.channel().map(str::to_owned),
            };
            self.event(time, kind)
        })
        .collect()
    }

    fn effect_event(
        &self,
        time: Timestamp,
        effect: &Effect,
        finding: &SearchFinding,
        adopted: bool,
    ) -> Event {
        let kind = EventKind::EffectFound {
            effect: effect.effect,
            channel: effect.channel.clone(),
            form: effect.form,
            at: effect.at,
            lag_days: effect.lag_days,
            bic_gain: effect.bic_gain,
            p_value: effect.p_value,
            explained: finding.explained,
            cannot_separate_from: finding.cannot_separate_from.clone(),
            adopted,
            undeclared_load: finding.undeclared_load.clone(),
        };
        self.event(time, kind)
    }
}

/// The effects that something besides the motion supports: a covariate, the calendar, the instrument. A
/// step of the load that only the motion shows may as well be the failure's own beginning.
fn supported(finding: &SearchFinding) -> KnownLoad {
    let parts = finding.known_load.parts.iter();
    KnownLoad {
        parts: parts
            .filter(|part| part.kind() != Kind::LoadStep)
            .cloned()
            .collect(),
    }
}

/// Whether the readings distinguish the effects from everything else: another covariate of the same kind that does as
/// well means the same load so far, another kind does not.
fn is_separable(finding: &SearchFinding) -> bool {
    let same_kind = |rival: &Rival| {
        let mut effects = finding.effects.iter();
        effects.any(|effect| effect.effect == rival.kind)
    };
    finding.cannot_separate_from.iter().all(same_kind)
}

//! The watch over the residual: tests it now and then, says when it has structure, and asks for a search.

use super::Forecaster;
use super::adopted::Adopted;
use crate::effects::{Effect, Kind, KnownLoad, Part, Rival, residual_structure};
use crate::forecast::measurably_moves;
use crate::monitor::event::{Event, EventKind, Unexplained};
use crate::monitor::search::{MOST_READINGS, SearchFinding, SearchJob};
use crate::monitor::track::StepContext;
use crate::monitor::track::forecast::Forecast;
use crate::monitor::track::record::BenchmarkRecord;
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
/// A response that takes more than this share of the record to pass was seen but once or twice, and follows any slow bend: it is
/// reported, and no forecast goes by it. On NTOE (Salmon Falls Creek) one of half the record put the chance of a collapse within 400
/// days at .73, without the effect .01; the slope stands.
const LONGEST_MEMORY: f64 = 1.0 / 3.0;
/// Two finds of one event lie no further apart than this share of the record.
const SAME_TIME: f64 = 0.05;

/// When the residual was last tested, what was reported of it, and the search asked for; all counted in readings.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(in crate::monitor::track) struct Watch {
    /// Readings so far.
    taken: u64,
    /// Of them at the last test,
    looked: u64,
    /// and at the last search.
    searched: u64,
    /// A search has been asked for and has not come back.
    is_searching: bool,
    /// As of the last test.
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
    /// Whether the residual is to be tested: an eighth more readings than the last time.
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

impl Forecaster {
    /// Tests the residual of the law in force, where that is due; what it shows calls for attention.
    pub(in crate::monitor::track) fn watch(
        &mut self,
        record: &BenchmarkRecord,
        time: Timestamp,
        forecast: &Forecast,
        context: &StepContext<'_>,
    ) -> Option<Event> {
        if record.is_shaken(time) || !self.watch.is_due() {
            return None;
        }
        let moves = measurably_moves(&forecast.plain.rates);
        let found = if moves {
            residual_structure(&self.in_force(record, context))
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
        let kind = Unexplained::Structure {
            bic_gain: found.bic_gain,
            load_sd: found.load_sd,
            since: self.by_calendar(record, found.since, context),
        };
        Some(record.event(time, EventKind::UnexplainedResidual(kind)))
    }

    /// The readings as the law in force sees them: by the load's clock, where one is adopted.
    fn in_force(&self, record: &BenchmarkRecord, context: &StepContext<'_>) -> Series {
        let history = record.history();
        let by_clock = self.adopted.as_ref().and_then(|adopted| {
            let channels = context.covariates.list();
            adopted.readings(history, &channels)
        });
        let observations = by_clock.as_ref().unwrap_or(&history.observations);
        history.series(record.benchmark(), observations, MOST_TESTED)
    }

    /// When that was, of a time by the clock of the law in force.
    fn by_calendar(
        &self,
        record: &BenchmarkRecord,
        time: Timestamp,
        context: &StepContext<'_>,
    ) -> Timestamp {
        let channels = context.covariates.list();
        let adopted = self.adopted.as_ref();
        adopted
            .and_then(|adopted| adopted.by_calendar(record.history(), &channels, time))
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
    pub(in crate::monitor::track) fn search(
        &mut self,
        record: &BenchmarkRecord,
        critical: f64,
        context: &StepContext<'_>,
    ) -> Option<SearchJob> {
        if !self.wants_search(context.phase.explain) {
            return None;
        }
        let history = record.history();
        let series = history.series(record.benchmark(), &history.observations, MOST_READINGS);
        let first = series.readings.first()?.time;
        let last = series.readings.last()?.time;
        let channels = context
            .covariates
            .beside(first, last, search::MOST_CHANNELS);
        let asked = record.newest().unwrap_or(last);
        self.watch.is_searching = true;
        self.watch.searched = self.watch.taken;
        Some(SearchJob::new(series, channels, asked, critical))
    }

    /// Takes what a search came to: reports the effects, and forecasts by them where the site wants that.
    pub(in crate::monitor::track) fn found(
        &mut self,
        record: &BenchmarkRecord,
        critical: f64,
        time: Timestamp,
        finding: &SearchFinding,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        self.watch.is_searching = false;
        let before = self.adopted.take();
        let length = record.newest();
        let length = length.map_or(0.0, |newest| record.history().days(newest));
        let known_load = adoptable(finding, before.as_ref().map(Adopted::law), length);
        if context.phase.explain == Explain::Adopt && !known_load.parts.is_empty() {
            let channels = context.covariates.list();
            let adopted = Adopted::new(known_load, record.history(), &channels, critical);
            self.adopted = Some(adopted);
        }
        let mut events = self.dropped(record, time, before.as_ref().map(Adopted::law));
        let known: Vec<KnownEffect> = finding
            .effects
            .iter()
            .map(|effect| self.known(effect))
            .collect();
        for (effect, known) in finding.effects.iter().zip(&known) {
            if !self.is_reported(record, known) {
                let kind = effect_found(effect, finding, known.is_adopted);
                events.push(record.event(time, kind));
            }
        }
        self.watch.known = known;
        events
    }

    /// From here on levels go by the law without effects.
    pub(in crate::monitor::track) fn give_up_effects(
        &mut self,
        record: &BenchmarkRecord,
        time: Timestamp,
    ) -> Vec<Event> {
        let before = self.adopted.take();
        for known in &mut self.watch.known {
            known.is_adopted = false;
        }
        self.dropped(record, time, before.as_ref().map(Adopted::law))
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

    fn is_reported(&self, record: &BenchmarkRecord, new: &KnownEffect) -> bool {
        let newest = record.newest();
        let length = newest.map_or(0.0, |newest| record.history().days(newest));
        self.watch.known.iter().any(|old| {
            let apart = match (old.at, new.at) {
                (Some(old), Some(new)) => days_since(old, new).abs(),
                (None, None) => 0.0,
                (Some(_), None) | (None, Some(_)) => f64::INFINITY,
            };
            let at = new.at;
            apart <= SAME_TIME * length && *new == KnownEffect { at, ..old.clone() }
        })
    }

    fn dropped(
        &self,
        record: &BenchmarkRecord,
        time: Timestamp,
        before: Option<&KnownLoad>,
    ) -> Vec<Event> {
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
            record.event(time, kind)
        })
        .collect()
    }
}

fn effect_found(effect: &Effect, finding: &SearchFinding, adopted: bool) -> EventKind {
    EventKind::EffectFound {
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
    }
}

/// The effects that something besides the motion supports: a covariate, the calendar, the instrument. A
/// step of the load that only the motion shows may as well be the failure's own beginning. Where the readings do not distinguish
/// the effects from others, an offset of the instrument by which forecasts go already, `before`, stays: whatever moves the slope
/// since says nothing of a jump that lies behind. A response as long as a third of the record is none of them. `length_days`: of the
/// record.
fn adoptable(finding: &SearchFinding, before: Option<&KnownLoad>, length_days: f64) -> KnownLoad {
    let is_separable = is_separable(finding);
    let stays = |part: &&Part| {
        !part.is_step()
            && part.memory_days() <= LONGEST_MEMORY * length_days
            && (is_separable || before.is_some_and(|law| has_offset(law, part, length_days)))
    };
    let parts = finding.known_load.parts.iter();
    KnownLoad {
        parts: parts.filter(stays).cloned().collect(),
    }
}

/// Whether `part` is an offset that `law` has at the same time.
fn has_offset(law: &KnownLoad, part: &Part, length_days: f64) -> bool {
    let Part::Offset { at: new, .. } = part else {
        return false;
    };
    let is_near = |at: &Timestamp| days_since(*at, *new).abs() <= SAME_TIME * length_days;
    let mut parts = law.parts.iter();
    parts.any(|old| matches!(old, Part::Offset { at, .. } if is_near(at)))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Explained, Filtered, Form};
    use crate::reading::{BenchmarkId, after_days};

    #[test]
    fn the_residual_is_tested_from_forty_readings_on_and_after_each_eighth_more() {
        let mut watch = Watch::default();
        let mut tested = Vec::new();
        for reading in 1..=60 {
            watch.count();
            if watch.is_due() {
                tested.push(reading);
            }
        }
        assert_eq!(tested, [40, 45, 51, 58]);
    }

    #[test]
    fn an_offset_that_is_adopted_stays_when_what_came_later_has_rivals() {
        let offset = |day: f64| Part::Offset {
            at: after_days(Timestamp::UNIX_EPOCH, day).unwrap(),
            size: 100.0,
        };
        let rival = Rival::from(Kind::RATE_LIMIT);
        let mut finding = SearchFinding {
            benchmark: BenchmarkId::new("a"),
            effects: vec![Effect::of(Kind::OFFSET), Effect::of(Kind::FRICTION_CHANGE)],
            explained: Explained::Partly,
            cannot_separate_from: vec![rival],
            known_load: KnownLoad {
                parts: vec![offset(50.2), offset(80.0)],
            },
            undeclared_load: None,
        };
        let before = KnownLoad {
            parts: vec![offset(50.0)],
        };
        let adopted = |finding: &SearchFinding, before| adoptable(finding, before, 100.0).parts;
        assert_eq!(adopted(&finding, Some(&before)), [offset(50.2)]);
        assert!(adopted(&finding, None).is_empty());
        finding.cannot_separate_from.clear();
        assert_eq!(adopted(&finding, None).len(), 2);
    }

    #[test]
    fn a_response_that_takes_half_the_record_is_not_adopted() {
        let by = |mean_days: f64| Part::Load {
            filtered: Filtered {
                channel: "lake_level_m".to_owned(),
                form: Form::Level,
                stages: 1,
                mean_days,
                before: 0.0,
                mean: 0.0,
                deviation: 1.0,
            },
            gain: 0.5,
        };
        let finding = |mean_days: f64| SearchFinding {
            benchmark: BenchmarkId::new("a"),
            effects: vec![Effect::of(Kind::HYDROLOGICAL)],
            explained: Explained::Full,
            cannot_separate_from: Vec::new(),
            known_load: KnownLoad {
                parts: vec![by(mean_days)],
            },
            undeclared_load: None,
        };
        let adopted = |mean_days| adoptable(&finding(mean_days), None, 360.0).parts.len();
        assert_eq!([20.0, 60.0].map(adopted), [1, 0]);
    }

    #[test]
    fn structure_is_news_when_it_is_new_or_has_doubled() {
        let mut watch = Watch::default();
        let gains = [None, Some(30.0), Some(50.0), Some(60.0), None, Some(30.0)];
        let news = gains.map(|gain| watch.is_news(gain));
        assert_eq!(news, [false, true, false, true, false, true]);
    }
}

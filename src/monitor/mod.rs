//! The state machine that owns every benchmark: readings in, events out, no clock and no files.

mod awaited;
mod batches;
mod benchmarks;
mod course;
mod covariates;
mod deadlines;
mod declared;
mod drift;
mod event;
mod event_shown;
mod fallen;
#[cfg(test)]
mod fixture;
mod found;
mod given;
mod history;
mod in_force;
mod kept;
mod measured;
mod motion;
mod notice;
mod order;
mod outages;
mod parallel;
mod past;
mod saved;
mod search;
mod sensor;
mod silence;
mod site;
mod spoilt;
mod suspect;
mod tally;
mod together;
mod track;
mod undeclared;
mod watched;

pub use course::{LevelStretch, by_time, levels_in};
pub use declared::{Declaration, Declared};
pub use event::{
    AlertState, CalledLevel, ChancesOfCollapse, Event, EventKind, FailureTime, InverseVelocity,
    LevelChance, Plain, REMOVED, RESET_FOUND, RegimeReport, SUSPECT, SUSPECT_ENDS, SharedFailure,
    Summary, Unexplained, since_by_key,
};
pub use event_shown::KindShown;
pub use given::{Given, OrderKind, OrderedBy};
pub use measured::Measured;
pub use notice::{CLOCK_FAULT, Notice};
pub use order::Order;
pub use parallel::{Task, Workers};
pub(crate) use saved::from_bytes;
pub use saved::{MemoryPart, SavedError};
pub use search::{SearchFinding, SearchJob};
pub use silence::MAY_SKIP;
pub(crate) use site::first_readings_within;
pub use site::{SiteLevel, site_text};
pub use undeclared::UndeclaredLoad;
pub use watched::Watched;
pub(crate) use watched::{WRITTEN, means_the_same};

use crate::alert::{Level, Policy};
use crate::reading::{BenchmarkId, CovariateKind, Reading, Sample, Suspicion, Timestamp, Unit};
use batches::Batches;
use benchmarks::Benchmarks;
use covariates::Covariates;
use declared::Declarations;
use jiff::SignedDuration;
use outages::Outages;
use past::Past;
use serde::{Deserialize, Serialize};
use site::SiteAlert;
use std::collections::{BTreeMap, BTreeSet};
use tally::Tally;
use together::FailureComparisons;
use track::{StepContext, Track};

/// What the monitor is given.
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    /// A reading of a benchmark.
    Reading {
        /// Whose.
        benchmark: BenchmarkId,
        /// Its unit, which also says the quantity.
        unit: Unit,
        /// For a velocity: the span before its time stamp over which it is the mean.
        averaging: Option<SignedDuration>,
        /// The reading itself.
        reading: Reading,
    },
    /// A reading that should be there and is not.
    Missing {
        /// Whose.
        benchmark: BenchmarkId,
        /// When it should have been measured.
        time: Timestamp,
        /// What the sensor gave instead.
        what: String,
    },
    /// What went wrong on the way from the sensors: which readings it concerns is not known.
    Trouble {
        /// The fault's kind, such as `possible-gap`.
        kind: String,
        /// One line for a person.
        text: String,
    },
    /// A value of a covariate.
    Sample {
        /// The channel's full name.
        channel: String,
        /// The unit at the name's end, where it is one that is known.
        unit: Option<String>,
        /// The value.
        sample: Sample,
    },
    /// The site's settings, when they are others than before.
    Settings(Box<Settings>),
    /// What people ask for.
    Order(Order),
    /// What a search came to; to be handed in before the first reading that is no earlier than it was due.
    Found(SearchFinding),
    /// How the watch goes on.
    Notice(Notice),
    /// Time has passed and nothing came.
    Tick,
}

/// What a monitor needs to know of its site.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The alert policy.
    pub policy: Policy,
    /// Policies of single benchmarks, where they differ from the site's.
    pub benchmarks: BTreeMap<BenchmarkId, Policy>,
    /// What is done about a residual that the law does not explain.
    pub explain: Explain,
    /// The benchmarks that are watched.
    #[serde(default)]
    pub watched: Watched,
    /// What people declare to have done.
    #[serde(default)]
    pub declared: Vec<Declared>,
    /// How the benchmarks' levels make one of the whole site; `None`: there is none.
    #[serde(default)]
    pub site: Option<SiteLevel>,
    /// For how long the site's level waits for benchmarks that have given no reading yet: fewer than `site` asks for do not make it meanwhile.
    #[serde(default = "site::first_readings_within")]
    pub first_readings_within: SignedDuration,
    /// Suspicions that people have looked into, and that do not hold.
    #[serde(default)]
    pub accepted: BTreeMap<BenchmarkId, BTreeSet<Suspicion>>,
    /// Whether a suspicion of another scale goes on until the readings clearly contradict it; not in a state of older versions, in
    /// which it ended with the first reading that alone would not have raised it.
    #[serde(default)]
    pub holds_scale: bool,
    /// What the covariates of these names measure, where their unit and name do not say it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub covariates: BTreeMap<String, CovariateKind>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            policy: Policy::default(),
            benchmarks: BTreeMap::new(),
            explain: Explain::default(),
            watched: Watched::default(),
            declared: Vec::new(),
            site: None,
            first_readings_within: site::first_readings_within(),
            accepted: BTreeMap::new(),
            holds_scale: true,
            covariates: BTreeMap::new(),
        }
    }
}

/// What is done about a residual that the law does not explain; it is watched and reported in any case.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Explain {
    /// The effect is searched for, reported, and taken into the law that forecasts and levels go by.
    #[default]
    Adopt,
    /// It is searched for and reported.
    #[serde(rename = "Tell")]
    Report,
    /// Nothing.
    Off,
}

impl Settings {
    /// The policy in force for a benchmark.
    pub fn policy(&self, benchmark: &BenchmarkId) -> &Policy {
        self.benchmarks.get(benchmark).unwrap_or(&self.policy)
    }

    /// The suspicions of a benchmark that do not hold.
    fn accepted(&self, benchmark: &BenchmarkId) -> BTreeSet<Suspicion> {
        self.accepted.get(benchmark).cloned().unwrap_or_default()
    }
}

/// The monitor: pure, deterministic, the same in a live run and in a replay.
#[derive(Debug)]
pub struct Monitor {
    settings: Settings,
    benchmarks: Benchmarks,
    covariates: Covariates,
    searches: Vec<SearchJob>,
    site: SiteAlert,
    together: FailureComparisons,
    outages: Outages,
    past: Past,
    /// How often what was known of a benchmark has been dropped.
    dropped: BTreeMap<BenchmarkId, u32>,
    /// Those whose readings mean something else than what is known of them, and why: with the next one, they begin anew.
    anew: BTreeMap<BenchmarkId, String>,
    batches: Batches,
    tally: Tally,
}

impl Monitor {
    /// A monitor that has seen nothing.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            benchmarks: Benchmarks::default(),
            covariates: Covariates::default(),
            searches: Vec::new(),
            site: SiteAlert::default(),
            together: FailureComparisons::default(),
            outages: Outages::default(),
            past: Past::default(),
            dropped: BTreeMap::new(),
            anew: BTreeMap::new(),
            batches: Batches::default(),
            tally: Tally::default(),
        }
    }

    /// Takes one input at `now` (data time, never going back) and says what follows from it.
    pub fn step(&mut self, now: Timestamp, input: &Input) -> Vec<Event> {
        self.tally.begin_step(now);
        let mut events = match input {
            Input::Reading {
                benchmark,
                unit,
                averaging,
                reading,
            } => {
                let source = history::MeasuredAs {
                    unit: *unit,
                    averaging: *averaging,
                };
                self.read(now, benchmark, source, reading)
            }
            Input::Missing {
                benchmark,
                time,
                what,
            } => self.missing(now, benchmark, *time, what),
            Input::Found(finding) => self.found(now, finding),
            Input::Notice(notice) => self.take_notice(now, notice),
            Input::Sample {
                channel,
                unit,
                sample,
            } => {
                let stated = self.settings.covariates.get(channel).copied();
                let column = (channel.as_str(), unit.as_deref());
                self.covariates.take(column, stated, *sample);
                Vec::new()
            }
            Input::Settings(settings) => self.change_settings(now, settings),
            Input::Order(order) => self.take_order(now, order),
            Input::Trouble { kind, text } => vec![trouble(now, kind, text)],
            Input::Tick => self.pass(now, now, false),
        };
        self.benchmarks.note_levels(input, &events);
        let of_site = self.site_levels(now, input, &events);
        events.extend(of_site);
        events.extend(self.compare(now, &events));
        self.tally.count(&events);
        events
    }

    fn read(
        &mut self,
        now: Timestamp,
        benchmark: &BenchmarkId,
        source: history::MeasuredAs,
        reading: &Reading,
    ) -> Vec<Event> {
        self.tally.count_reading();
        self.outages.note_reading(benchmark, reading.time);
        let mut events = Vec::new();
        let former = self.begin_anew(benchmark);
        let context = StepContext {
            phase: self.phase(benchmark, now),
            covariates: &self.covariates,
        };
        let policy = self.settings.policy(benchmark);
        let track = self.benchmarks.get_or_begin(benchmark, || {
            let declared = Declarations::of(&self.settings.declared, benchmark);
            let dropped = self.dropped.get(benchmark).copied().unwrap_or(0);
            let mut track = Track::new(benchmark.clone(), source, reading.time, declared, dropped);
            track.accept(now, self.settings.accepted(benchmark));
            track
        });
        if let Some((former, why)) = former {
            events.extend(track.follow_on(former, now, &why));
        }
        events.extend(if reading.time > now {
            track.put_aside(now, source, reading)
        } else {
            track.take(policy, source, reading, &context)
        });
        self.batches.note(benchmark, track);
        self.past.note(benchmark, reading.time);
        let critical = policy.critical_velocity_mm_per_day;
        self.searches.extend(track.search(critical, &context));
        self.benchmarks.note_changed(benchmark);
        events.extend(self.outages.end_awaiting(now, benchmark, "reads"));
        events
    }

    /// Judges the benchmarks that were due by `until`, at `now`: whether they are silent, and, unless `silences_alone`, whether a collapse that was
    /// forecast calls red.
    fn pass(&mut self, now: Timestamp, until: Timestamp, silences_alone: bool) -> Vec<Event> {
        let mut events = Vec::new();
        for id in self.benchmarks.due(until) {
            if let Some(track) = self.benchmarks.get_mut(&id) {
                let policy = self.settings.policy(&id);
                if !silences_alone {
                    events.extend(track.judge_overdue(policy, (now, until)));
                }
                events.extend(track.pass((now, until), self.outages.sensor_fault(&id)));
            }
            self.benchmarks.note_changed(&id);
        }
        events
    }

    /// Goes by other settings from here on. What was in force at a benchmark that is no longer watched ends.
    fn change_settings(&mut self, now: Timestamp, settings: &Settings) -> Vec<Event> {
        let former = std::mem::replace(&mut self.settings, settings.clone());
        self.covariates.state(&self.settings.covariates);
        let mut events = self.unwatch(now, &former.watched);
        events.extend(self.reread(now, &former.watched));
        let each: Vec<BenchmarkId> = self.benchmarks.all().keys().cloned().collect();
        for id in &each {
            let phase = self.phase(id, now);
            let context = StepContext {
                phase,
                covariates: &self.covariates,
            };
            let Some(track) = self.benchmarks.get_mut(id) else {
                continue;
            };
            let declared = Declarations::of(&self.settings.declared, id);
            events.extend(track.accept(now, self.settings.accepted(id)));
            let policy = self.settings.policy(id);
            events.extend(track.change_policy(former.policy(id), policy, &context));
            if self.settings.explain != Explain::Adopt {
                events.extend(track.give_up_effects(now));
            }
            events.extend(track.redeclare(self.settings.policy(id), declared, &context));
            self.benchmarks.note_changed(id);
        }
        events
    }

    fn missing(
        &mut self,
        now: Timestamp,
        benchmark: &BenchmarkId,
        time: Timestamp,
        what: &str,
    ) -> Vec<Event> {
        let declared = Declarations::of(&self.settings.declared, benchmark);
        if declared.is_maintained(time) || !self.outages.note_missing(benchmark, time, what) {
            return Vec::new();
        }
        if let Some(track) = self.benchmarks.get_mut(benchmark) {
            track.note_missing(time);
            self.benchmarks.note_changed(benchmark);
        }
        let kind = EventKind::Fault {
            kind: "sensor-fault".to_owned(),
            text: format!("benchmark {benchmark}: no reading at {time}; the sensor gives {what}"),
        };
        vec![Event {
            time: now,
            kind,
            benchmark: Some(benchmark.clone()),
        }]
    }

    /// What it goes by.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Whether a benchmark falls silent by `until`, if no reading comes.
    pub(crate) fn falls_silent_by(&self, until: Timestamp) -> bool {
        let due = self.benchmarks.due(until);
        due.iter()
            .any(|id| (self.benchmarks.get(id)).is_some_and(|track| track.is_silent_by(until)))
    }

    /// When the monitor wants a [`Input::Tick`] if nothing else comes before.
    pub fn next_deadline(&self) -> Option<Timestamp> {
        let of_benchmarks = self.benchmarks.next_deadline();
        of_benchmarks.into_iter().chain(self.site.deadline()).min()
    }

    /// The level in force for a benchmark that has given readings.
    pub fn level(&self, benchmark: &BenchmarkId) -> Option<Level> {
        self.benchmarks.get(benchmark).map(Track::level)
    }

    /// The last line of a replay: what was taken in and said so far.
    pub fn summary(&self) -> Option<Event> {
        self.tally.event()
    }
}

fn trouble(time: Timestamp, kind: &str, text: &str) -> Event {
    let (kind, text) = (kind.to_owned(), text.to_owned());
    Event {
        time,
        benchmark: None,
        kind: EventKind::Fault { kind, text },
    }
}

//! What people declare to have done to the site or its instruments, and which readings it concerns.

use super::event::{Event, EventKind};
use crate::reading::{BenchmarkId, Timestamp, figure};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// So long after a blast its tremor, and not the slope, is taken to move the readings.
const BLAST_LASTS: SignedDuration = SignedDuration::from_hours(1);

/// Something people did to the site or its instruments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Declared {
    /// When it was, or began.
    pub time: Timestamp,
    /// Where; `None`: at the whole site.
    pub benchmark: Option<BenchmarkId>,
    /// What.
    pub kind: Declaration,
}

/// The kinds of what is declared.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Declaration {
    /// The instrument has another zero from then on: what the readings jump by is no motion. A velocity that is
    /// a mean over the reset is left out.
    Reset {
        /// What they jump by, mm; `None`: what they show, less the motion expected meanwhile.
        size_mm: Option<f64>,
    },
    /// Readings meanwhile are kept and not judged, and silence is no fault.
    Maintenance {
        /// Its end.
        until: Timestamp,
    },
    /// An unexpected reading within an hour of it raises no yellow.
    Blast,
}

impl Declared {
    /// From when until when there is maintenance, where it is one.
    fn maintenance(&self) -> Option<(Timestamp, Timestamp)> {
        match self.kind {
            Declaration::Maintenance { until } => Some((self.time, until)),
            Declaration::Reset { .. } | Declaration::Blast => None,
        }
    }

    /// Whether it is maintenance that goes on at `time`.
    pub fn is_maintenance_at(&self, time: Timestamp) -> bool {
        let window = self.maintenance();
        window.is_some_and(|(from, until)| from <= time && time < until)
    }
}

impl Declaration {
    fn name(self) -> &'static str {
        match self {
            Self::Reset { .. } => "reset",
            Self::Maintenance { .. } => "maintenance",
            Self::Blast => "blast",
        }
    }
}

/// A reset that is declared so near to one that was found is the same.
const NEAR_SPAN: SignedDuration = SignedDuration::from_hours(48);

/// What is declared for one benchmark.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Declarations {
    /// By time.
    all: Vec<Declared>,
    /// Those that have taken effect, and were reported.
    #[serde(rename = "told")]
    reported: Vec<Declared>,
    /// Resets that the readings show and nobody has declared: when, and by what the readings jump, mm.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    found: Vec<(Timestamp, f64)>,
    /// Spans whose readings are in another unit than those before and after: since when, and from when on they are not.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    left_out: Vec<(Timestamp, Timestamp)>,
}

impl Declarations {
    /// What of `declared` concerns `benchmark`; `reported` may hold more than that.
    pub(super) fn of(declared: &[Declared], benchmark: &BenchmarkId) -> Self {
        let here = |one: &&Declared| {
            let place = one.benchmark.as_ref();
            place.is_none_or(|place| place == benchmark)
        };
        let mut all: Vec<Declared> = declared.iter().filter(here).cloned().collect();
        all.sort_by_key(|one| one.time);
        Self {
            all,
            reported: Vec::new(),
            found: Vec::new(),
            left_out: Vec::new(),
        }
    }

    /// The newest reset that the readings have shown: when, and by what they jumped, mm.
    pub(super) fn newest_found(&self) -> Option<(Timestamp, f64)> {
        self.found.last().copied()
    }

    /// Takes a reset that the readings show: as of one that is declared, what they jump by is no motion.
    pub(super) fn find_reset(&mut self, time: Timestamp, jump: f64) {
        self.found.push((time, jump));
    }

    /// Readings of this span show nothing.
    pub(super) fn leave_out(&mut self, since: Timestamp, until: Timestamp) {
        self.left_out.push((since, until));
    }

    /// Whether a reading of that time is known to be in another unit.
    pub(super) fn is_in_other_unit(&self, time: Timestamp) -> bool {
        let mut spans = self.left_out.iter();
        spans.any(|(since, until)| (*since..*until).contains(&time))
    }

    /// Takes these instead; `None` where they are the same.
    pub(super) fn replace(&mut self, by: Self) -> Option<()> {
        if self.all == by.all {
            return None;
        }
        self.all = by.all;
        let is_declared = |time: Timestamp| {
            let mut resets = self.all.iter();
            resets.any(|one| {
                let before = time.duration_since(one.time);
                matches!(one.kind, Declaration::Reset { .. })
                    && (-NEAR_SPAN..=NEAR_SPAN).contains(&before)
            })
        };
        // What was found, and is declared now, is taken off once.
        self.found.retain(|(time, _)| !is_declared(*time));
        self.reported.retain(|one| self.all.contains(one));
        Some(())
    }

    /// The resets, by time, with what the readings jump by where that is declared.
    pub(super) fn resets(&self) -> impl Iterator<Item = (Timestamp, Option<f64>)> {
        let declared = self.all.iter().filter_map(|one| match one.kind {
            Declaration::Reset { size_mm } => Some((one.time, size_mm)),
            Declaration::Maintenance { .. } | Declaration::Blast => None,
        });
        let found = self.found.iter();
        declared.chain(found.map(|(time, jump)| (*time, Some(*jump))))
    }

    fn windows(&self) -> impl Iterator<Item = (Timestamp, Timestamp)> {
        self.all.iter().filter_map(Declared::maintenance)
    }

    /// Whether there is maintenance at `time`.
    pub(super) fn is_maintained(&self, time: Timestamp) -> bool {
        self.all.iter().any(|one| one.is_maintenance_at(time))
    }

    /// Whether there is maintenance at any time between two readings.
    pub(super) fn is_maintained_between(&self, before: Timestamp, after: Timestamp) -> bool {
        self.windows()
            .any(|(from, until)| from <= after && before < until)
    }

    /// Whether a reset lies within the time over which a velocity is the mean.
    pub(super) fn is_reset_within(&self, from: Timestamp, to: Timestamp) -> bool {
        self.resets().any(|(time, _)| from < time && time < to)
    }

    /// Whether a blast shook the instruments shortly before `time`.
    pub(super) fn is_shaken(&self, time: Timestamp) -> bool {
        self.all.iter().any(|one| {
            let age = time.duration_since(one.time);
            one.kind == Declaration::Blast && (SignedDuration::ZERO..=BLAST_LASTS).contains(&age)
        })
    }

    /// When a silence that began at `newest` and would be one at `due` becomes one: after maintenance everything is
    /// given as long again.
    pub(super) fn put_off(&self, newest: Timestamp, due: Timestamp) -> Timestamp {
        let allowed = due.duration_since(newest);
        self.windows().fold(due, |due, (from, until)| {
            if from <= due && newest < until {
                until
                    .checked_add(allowed)
                    .map_or(due, |later| later.max(due))
            } else {
                due
            }
        })
    }

    /// What takes effect with the reading of `time`, the one before it being that of `before`, and was not reported
    /// yet. A reset is not among it: see [`Declarations::take_resets`].
    pub(super) fn take(&mut self, before: Option<Timestamp>, time: Timestamp) -> Vec<Declared> {
        let begins = |one: &&Declared| match one.kind {
            Declaration::Reset { .. } => false,
            Declaration::Maintenance { until } => {
                one.time <= time && before.unwrap_or(time) < until
            }
            Declaration::Blast => {
                let age = time.duration_since(one.time);
                (SignedDuration::ZERO..=BLAST_LASTS).contains(&age)
            }
        };
        let fresh = |one: &&Declared| begins(one) && !self.reported.contains(one);
        let fresh: Vec<Declared> = self.all.iter().filter(fresh).cloned().collect();
        self.reported.extend(fresh.iter().cloned());
        fresh
    }

    /// The resets between two times, which were not reported yet.
    pub(super) fn take_resets(&mut self, from: Timestamp, to: Timestamp) -> Vec<Declared> {
        let is_it = |one: &&Declared| {
            let is_reset = matches!(one.kind, Declaration::Reset { .. });
            is_reset && (from..=to).contains(&one.time) && !self.reported.contains(one)
        };
        let fresh: Vec<Declared> = self.all.iter().filter(is_it).cloned().collect();
        self.reported.extend(fresh.iter().cloned());
        fresh
    }
}

impl Declared {
    /// That it took effect at `benchmark`; `jump` is what a reset made its readings jump by, mm.
    pub(super) fn event(
        &self,
        time: Timestamp,
        benchmark: &BenchmarkId,
        jump: Option<f64>,
    ) -> Event {
        let at = self.time;
        let (until, text) = match self.kind {
            Declaration::Reset { .. } => (
                None,
                jump.map_or_else(
                    || format!("reset at {at}: the velocity over it is left out"),
                    |jump| {
                        format!(
                            "reset at {at}: a jump of {} mm is no motion",
                            figure(jump, 3)
                        )
                    },
                ),
            ),
            Declaration::Maintenance { until } => (
                Some(until),
                format!("maintenance from {at} to {until}: its readings are kept and not judged"),
            ),
            Declaration::Blast => (
                None,
                format!("blast at {at}: an unexpected reading within an hour raises no yellow"),
            ),
        };
        Event {
            time,
            benchmark: Some(benchmark.clone()),
            kind: EventKind::Declared {
                kind: self.kind.name().to_owned(),
                at,
                until,
                size_mm: jump,
                text: format!("benchmark {benchmark}: {text}"),
            },
        }
    }
}

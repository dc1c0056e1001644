//! Values and events onto their topics, each declared when its first message comes.

use super::level_now::LevelsNow;
use super::schemas::Schema;
use super::{messages, schemas};
use crate::monitor::{Event, Measured};
use crate::reading::{BenchmarkId, Timestamp, Unit};
use crate::runtime::ingest::{McapStream, TopicHead, escape, reading_json};
use jiff::SignedDuration;
use mcap::McapError;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{Seek, Write};

/// One file on its way out.
pub(super) struct TopicWriter<W: Write + Seek> {
    stream: McapStream<W>,
    topics: BTreeMap<String, u16>,
    /// The unit and averaging with which a topic began: it has one of each.
    kinds: BTreeMap<String, (Unit, Option<SignedDuration>)>,
    /// The places whose level this file has.
    stated: BTreeSet<Option<BenchmarkId>>,
}

impl<W: Write + Seek> TopicWriter<W> {
    /// A file that begins with a message of `first`.
    pub(super) fn create(
        out: W,
        first: Timestamp,
        provenance: &BTreeMap<String, String>,
    ) -> Result<Self, McapError> {
        Ok(Self {
            stream: McapStream::create(out, first, provenance)?,
            topics: BTreeMap::new(),
            kinds: BTreeMap::new(),
            stated: BTreeSet::new(),
        })
    }

    /// Says that the file is to be read before its end is written.
    pub(super) fn grows(&mut self) -> Result<(), McapError> {
        self.stream.grows()
    }

    /// Whether the file has a place for it: for its time, and for a mean over such a span.
    pub(super) fn takes(&self, time: Timestamp, measured: Option<&Measured<'_>>) -> bool {
        let is_alike = |measured: &Measured<'_>| {
            let Measured::Reading { averaging, .. } = measured else {
                return true;
            };
            let kind = self.kinds.get(&TopicHead::of(measured).name);
            kind.is_none_or(|(_, known)| known == averaging)
        };
        self.stream.has_place_for(time) && measured.is_none_or(is_alike)
    }

    /// Writes a value, in the unit with which its topic began.
    pub(super) fn measured(
        &mut self,
        measured: &Measured<'_>,
        levels: &LevelsNow,
    ) -> Result<(), McapError> {
        let (time, head) = (measured.time(), TopicHead::of(measured));
        let (mut value, mut sigma) = (measured.value(), measured.sigma());
        let unit = match measured {
            Measured::Reading {
                benchmark,
                unit,
                averaging,
                ..
            } => {
                self.state(Some(benchmark), time, levels)?;
                let kind = (*unit, *averaging);
                let (own, _) = *self.kinds.entry(head.name.clone()).or_insert(kind);
                if own != *unit {
                    let factor = unit.factor() / own.factor();
                    value *= factor;
                    sigma = sigma.map(|sigma| sigma * factor);
                }
                Some(own.to_string())
            }
            Measured::Sample { unit, .. } => unit.map(str::to_owned),
        };
        let topic = self.topic(&head.name.clone(), || head)?;
        let json = reading_json(time, value, unit.as_deref(), sigma)?;
        self.stream.write(topic, time, &json)
    }

    /// Writes what an event says, with `words` for a person.
    pub(super) fn event(
        &mut self,
        event: &Event,
        words: &str,
        levels: &mut LevelsNow,
    ) -> Result<(), McapError> {
        let time = event.time;
        if let Some(benchmark) = &event.benchmark
            && let Some((fit, forecast)) = messages::refit(event)
        {
            self.said(&of(benchmark, "fit"), schemas::fit, time, &fit)?;
            let topic = of(benchmark, "forecast");
            self.said(&topic, schemas::forecast, time, &forecast)?;
        }
        if let Some(alert) = messages::alert(event) {
            self.state(event.benchmark.as_ref(), time, levels)?;
            if let Some(level) = levels.take(event) {
                self.level(event.benchmark.as_ref(), time, level)?;
            }
            self.said("/alerts", schemas::alert, time, &alert)?;
        }
        match messages::log(event, words) {
            Some(line) => self.said("/log", schemas::log, time, &line),
            None => Ok(()),
        }
    }

    /// Writes what is in memory.
    pub(super) fn flush(&mut self) -> Result<(), McapError> {
        self.stream.flush()
    }

    /// Writes the rest, and the summary.
    pub(super) fn finish(self) -> Result<(), McapError> {
        self.stream.finish()
    }

    /// The level of a place before it is spoken of for the first time; before all others those that something was said of.
    fn state(
        &mut self,
        place: Option<&BenchmarkId>,
        time: Timestamp,
        levels: &LevelsNow,
    ) -> Result<(), McapError> {
        let place = place.cloned();
        if self.stated.contains(&place) {
            return Ok(());
        }
        let mut due = vec![place];
        if self.stated.is_empty() {
            due.extend(levels.places().cloned());
        }
        for one in due {
            if self.stated.insert(one.clone()) {
                self.level(one.as_ref(), time, levels.of(&one))?;
            }
        }
        Ok(())
    }

    fn level(
        &mut self,
        place: Option<&BenchmarkId>,
        time: Timestamp,
        (level, is_unknown): super::level_now::LevelAndUnknown,
    ) -> Result<(), McapError> {
        let topic = place.map_or_else(|| "/site/level".to_owned(), |id| of(id, "level"));
        let message = messages::level(time, level, is_unknown);
        self.said(&topic, schemas::level, time, &message)
    }

    fn said(
        &mut self,
        name: &str,
        schema: fn() -> Schema,
        time: Timestamp,
        message: &Value,
    ) -> Result<(), McapError> {
        let head = || TopicHead {
            name: name.to_owned(),
            schema: schema(),
            metadata: BTreeMap::new(),
        };
        let topic = self.topic(name, head)?;
        let json = serde_json::to_vec(message).map_err(std::io::Error::from)?;
        self.stream.write(topic, time, &json)
    }

    fn topic(&mut self, name: &str, head: impl FnOnce() -> TopicHead) -> Result<u16, McapError> {
        if let Some(known) = self.topics.get(name) {
            return Ok(*known);
        }
        let id = self.stream.declare(head())?;
        self.topics.insert(name.to_owned(), id);
        Ok(id)
    }
}

fn of(benchmark: &BenchmarkId, what: &str) -> String {
    format!("/benchmarks/{}/{what}", escape(benchmark.as_str()))
}

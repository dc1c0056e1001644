//! A source's values wait for earlier ones, for a bounded time, and go out in the order of their measurement.

use super::decode::Arrival;
use crate::monitor::Input;
use crate::reading::{BenchmarkId, Quantity, Timestamp};
use crate::runtime::clock;
use crate::store::Position;
use jiff::SignedDuration;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Values that one source may hold; beyond, the oldest goes out.
const MOST_HELD: usize = 100_000;
/// Positions that wait; beyond, of each file only the newest is left.
const MOST_POSITIONS: usize = 1024;

/// By time, where that is the same covariates first, and then in the order in which they came.
type OrderKey = (Timestamp, bool, u64);

/// The values of one source that wait.
#[derive(Debug)]
pub(super) struct Reorder {
    window: SignedDuration,
    /// How many have come.
    came: u64,
    held: BTreeMap<OrderKey, Arrival>,
    /// The numbers of the held.
    numbers: BTreeSet<u64>,
    /// When the held ones came, and some that have gone out, in that order.
    arrivals: VecDeque<(Timestamp, OrderKey)>,
    /// Readings that have come since [`Reorder::new_readings`] was last asked.
    new: Vec<WaitingReading>,
    /// The newest time measured, as far as it is not ahead of the wall clock.
    newest: Option<Timestamp>,
    /// Everything up to here is to go out.
    due: Option<OrderKey>,
    /// Each may be acknowledged once everything below its number has gone out.
    positions: VecDeque<(u64, Position)>,
    /// What a restart goes on from, a file: what was acknowledged last.
    acknowledged: BTreeMap<String, Vec<u8>>,
}

/// A reading that has been read and waits for earlier ones.
#[derive(Debug, Clone, PartialEq)]
pub struct WaitingReading {
    /// Whose.
    pub benchmark: BenchmarkId,
    /// Of which quantity.
    pub quantity: Quantity,
    /// When it was measured.
    pub time: Timestamp,
}

/// How it stood with a file that is under its name no more.
#[derive(Debug, Default)]
pub(super) struct Forgotten {
    /// What was acknowledged of it last.
    pub(super) acknowledged: Option<Vec<u8>>,
    /// Whether something of it had not gone out.
    pub(super) waits: bool,
}

impl Reorder {
    /// Values wait for `window`.
    pub(super) fn new(window: SignedDuration) -> Self {
        Self {
            window,
            came: 0,
            held: BTreeMap::new(),
            numbers: BTreeSet::new(),
            arrivals: VecDeque::new(),
            new: Vec::new(),
            newest: None,
            due: None,
            positions: VecDeque::new(),
            acknowledged: BTreeMap::new(),
        }
    }

    /// What an earlier process acknowledged of the files of the source `id`.
    pub(super) fn restore(&mut self, saved: &[(String, Vec<u8>)], id: &str) {
        let own = saved.iter().filter(|(name, _)| {
            let source = name.split_once(':');
            source.is_some_and(|(source, _)| source == id)
        });
        self.acknowledged.extend(own.cloned());
    }

    /// Holds a value that has been read at `host_time`, of a file that was `changed` last at that time: it came no later, also where it is read
    /// again after a restart.
    pub(super) fn take(
        &mut self,
        arrival: Arrival,
        host_time: Timestamp,
        changed: Option<Timestamp>,
    ) {
        let (_, is_reading, ..) = arrival.rank();
        let key = (arrival.time, is_reading, self.came);
        self.came += 1;
        // A clock that is wrong by years must not send everything out that waits.
        if arrival.time.duration_since(host_time) <= clock::TOLERANCE {
            self.newest = self.newest.max(Some(arrival.time));
        }
        if let Input::Reading {
            benchmark, unit, ..
        } = &arrival.input
        {
            self.new.push(WaitingReading {
                benchmark: benchmark.clone(),
                quantity: unit.quantity(),
                time: arrival.time,
            });
        }
        self.numbers.insert(key.2);
        let came = changed.map_or(host_time, |changed| changed.min(host_time));
        self.arrivals.push_back((came, key));
        self.held.insert(key, arrival);
        if self.held.len() > MOST_HELD {
            self.due = self.due.max(self.held.keys().next().copied());
        }
    }

    /// The readings that have come since this was last asked; each of them waits, or has gone out by now.
    pub(super) fn new_readings(&mut self) -> Vec<WaitingReading> {
        std::mem::take(&mut self.new)
    }

    /// A file has been read so far; what that means may be acknowledged when all that has come by now has gone out.
    pub(super) fn note(&mut self, position: Position) {
        self.positions.push_back((self.came, position));
        if self.positions.len() > MOST_POSITIONS {
            let mut seen = BTreeSet::new();
            let mut kept: Vec<(u64, Position)> = Vec::new();
            for one in self.positions.drain(..).rev() {
                if seen.insert(one.1.name.clone()) {
                    kept.push(one);
                }
            }
            self.positions.extend(kept.into_iter().rev());
        }
    }

    /// Drops what is known of a file's name.
    pub(super) fn forget(&mut self, name: &str) -> Forgotten {
        let before = self.positions.len();
        self.positions.retain(|(_, position)| position.name != name);
        Forgotten {
            acknowledged: self.acknowledged.remove(name),
            waits: self.positions.len() < before,
        }
    }

    /// The file goes by this name from now on; no more of it is acknowledged than before.
    pub(super) fn keep(&mut self, name: &str, body: &[u8]) {
        self.acknowledged.insert(name.to_owned(), body.to_owned());
    }

    /// Lets everything go out that waits: a restart could not read it again.
    pub(super) fn flush(&mut self) {
        self.due = self.due.max(self.held.keys().next_back().copied());
    }

    /// The values that need not wait any longer at `host_time`, in the order of their measurement, `most` of them.
    pub(super) fn release(&mut self, host_time: Timestamp, most: usize) -> Vec<Arrival> {
        if let Some(until) = self
            .newest
            .and_then(|newest| newest.checked_sub(self.window).ok())
        {
            self.due = self.due.max(Some((until, true, u64::MAX)));
        }
        while let Some((came, key)) = self.arrivals.front().copied() {
            // Whether the wall clock was set back in between nobody knows: then it counts from now on.
            let waited = host_time.duration_since(came);
            if waited < SignedDuration::ZERO {
                for (came, _) in &mut self.arrivals {
                    *came = host_time.min(*came);
                }
            }
            if waited < self.window && self.held.contains_key(&key) {
                break;
            }
            if waited >= self.window {
                self.due = self.due.max(Some(key));
            }
            self.arrivals.pop_front();
        }
        let mut out = Vec::new();
        while out.len() < most && self.is_due() {
            let Some((key, arrival)) = self.held.pop_first() else {
                break;
            };
            self.numbers.remove(&key.2);
            out.push(arrival);
        }
        if !self.is_due() {
            self.due = None;
        }
        out
    }

    /// Whether there is more that need not wait.
    pub(super) fn is_due(&self) -> bool {
        let first = self.held.keys().next();
        first.is_some_and(|first| Some(*first) <= self.due)
    }

    /// How far files may be acknowledged.
    pub(super) fn positions(&mut self) -> Vec<Position> {
        let reached = self.numbers.first().copied().unwrap_or(self.came);
        let many = self
            .positions
            .partition_point(|(number, _)| *number <= reached);
        let reached: Vec<Position> = (self.positions.drain(..many))
            .map(|(_, position)| position)
            .collect();
        for Position { name, body } in &reached {
            match body {
                Some(body) => self.acknowledged.insert(name.clone(), body.clone()),
                None => self.acknowledged.remove(name),
            };
        }
        reached
    }
}

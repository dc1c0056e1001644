//! Whether a value has been taken before.

use super::{Batch, Store, StoreError, nanoseconds};
use crate::monitor::{Input, Measured};
use rusqlite::{Connection, params};
use std::collections::{HashMap, HashSet};

/// Of so many series and times what is written is remembered, and of so many values in all: then it is looked up again.
const MOST_PLACES: usize = 64;
const MOST_VALUES: usize = 1 << 18;

/// Whether a value is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Presence {
    /// It has not been taken.
    No,
    /// It has, and another one of its time was taken after it: either a file is read again, or it was corrected back.
    Corrected,
    /// It has, and is the last of its time.
    Yes,
}

/// What is written of some series at some times, as far as it has been looked up: where very many values of one time come, each
/// would be compared with all before it.
#[derive(Debug, Default)]
pub(super) struct WrittenValues {
    places: HashMap<(i64, i64), AtOneTime>,
    count: usize,
}

/// What is written of one series at one time.
#[derive(Debug)]
struct AtOneTime {
    /// The steps after which, and up to which, it has been looked up.
    after: i64,
    until: i64,
    /// The bits of the values in the common unit.
    values: HashSet<u64>,
    /// The step of the newest, and its bits.
    newest: Option<(i64, u64)>,
}

impl WrittenValues {
    /// The values of series `number`, times `factor`, at `time`, in nanoseconds: those after step number `after`, up to the last one,
    /// `until`.
    fn at(
        &mut self,
        connection: &Connection,
        (number, factor): (i64, f64),
        time: i64,
        (after, until): (i64, i64),
    ) -> Result<&AtOneTime, StoreError> {
        let is_full = self.places.len() >= MOST_PLACES || self.count >= MOST_VALUES;
        if is_full && !self.places.contains_key(&(number, time)) {
            *self = Self::default();
        }
        let place = self.places.entry((number, time));
        let place = place.or_insert_with(|| AtOneTime::new(after));
        if place.after != after {
            *place = AtOneTime::new(after);
        }
        let mut query = connection.prepare_cached(
            "SELECT seq, value FROM step WHERE series = ?1 AND time = ?2 AND seq > ?3",
        )?;
        let mut rows = query.query(params![number, time, place.until])?;
        while let Some(row) = rows.next()? {
            let (step, value): (i64, f64) = (row.get(0)?, row.get(1)?);
            let bits = (value * factor).to_bits();
            self.count += usize::from(place.values.insert(bits));
            place.newest = place.newest.max(Some((step, bits)));
        }
        place.until = until.max(after);
        Ok(place)
    }
}

impl AtOneTime {
    fn new(after: i64) -> Self {
        Self {
            after,
            until: after,
            values: HashSet::new(),
            newest: None,
        }
    }
}

impl Store {
    /// Whether the value has been taken before: in `batch`, or in what is written after step number `after`.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn has(&self, batch: &Batch, input: &Input, after: i64) -> Result<Presence, StoreError> {
        let Some(measured) = input.measured() else {
            return Ok(Presence::No);
        };
        let (time, value) = (measured.time(), measured.value());
        let in_batch = batch.known(&measured);
        if (in_batch.first()).is_some_and(|known| known.to_bits() == value.to_bits()) {
            return Ok(Presence::Yes);
        }
        let factor = match &measured {
            Measured::Reading { unit, .. } => unit.factor(),
            Measured::Sample { .. } => 1.0,
        };
        let wanted = (value * factor).to_bits();
        let mut inner = self.inner();
        let inner = &mut *inner;
        let (mut newest, mut is_written) = (None, false);
        for series in inner.catalogue.alike(&measured) {
            let steps = (after, inner.steps);
            let there = (inner.written).at(&inner.connection, series, nanoseconds(time)?, steps)?;
            newest = newest.max(there.newest);
            is_written |= there.values.contains(&wanted);
        }
        let is_it = |known: &f64| (known * factor).to_bits() == wanted;
        let is_newest = match in_batch.first() {
            Some(known) => is_it(known),
            None => newest.is_some_and(|(_, bits)| bits == wanted),
        };
        Ok(if is_newest {
            Presence::Yes
        } else if is_written || in_batch.iter().any(is_it) {
            Presence::Corrected
        } else {
            Presence::No
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reading::{BenchmarkId, Reading, Timestamp, Unit};

    fn reading(second: i64, value: f64, unit: &str) -> Input {
        Input::Reading {
            benchmark: BenchmarkId::new("5"),
            unit: Unit::parse(unit).unwrap(),
            averaging: None,
            reading: Reading {
                time: Timestamp::from_second(second).unwrap(),
                value,
                sigma: None,
            },
        }
    }

    #[test]
    fn what_is_written_after_a_time_was_looked_up_is_known_too() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let now = Timestamp::from_second(1000).unwrap();
        let mut batch = Batch::default();
        let known = |batch: &Batch, value, after| {
            let input = reading(100, value, "mm");
            store.has(batch, &input, after).unwrap()
        };
        for round in 0..3 {
            let newest = 2.0 * f64::from(round);
            for value in [newest, newest + 1.0] {
                assert_eq!(known(&batch, value, 0), Presence::No, "{value}");
                batch.step(now, &reading(100, value, "mm"), &[]);
                assert_eq!(known(&batch, value, 0), Presence::Yes, "{value}");
            }
            assert_eq!(known(&batch, newest, 0), Presence::Corrected);
            assert_eq!(known(&batch, 0.0, 0), Presence::Corrected);
            store.commit(&batch).unwrap();
            batch.clear();
            assert_eq!(known(&batch, newest + 1.0, 0), Presence::Yes);
            assert_eq!(known(&batch, 0.0, 0), Presence::Corrected);
        }
        // In another unit, and where what was read up to some step does not count any more.
        let in_metres = reading(100, 0.005, "m");
        assert_eq!(store.has(&batch, &in_metres, 0).unwrap(), Presence::Yes);
        assert_eq!(known(&batch, 3.0, 4), Presence::No);
        assert_eq!(known(&batch, 4.0, 4), Presence::Corrected);
        assert_eq!(known(&batch, 3.0, 0), Presence::Corrected);
        for other in 200..400 {
            let input = reading(other, 1.0, "mm");
            assert_eq!(store.has(&batch, &input, 0).unwrap(), Presence::No);
        }
        assert_eq!(known(&batch, 5.0, 0), Presence::Yes);
    }
}

//! The readings of one quantity of a benchmark, counted as the daemon takes them.

use super::resets::DeclaredResets;
use super::view::BenchmarkPreview;
use crate::reading::other_unit::{self, OtherUnit};
use crate::reading::{
    LocalClock, Quantity, Sample, SummerTime, Suspicion, Timestamp, Unit, suspicion,
    upper_median_by,
};
use jiff::tz::TimeZone;
use std::collections::BTreeSet;

/// Readings that are replaced by another of the same time, at least, and one in so many, where they may be of two sensors.
const FEWEST_REPLACED: u64 = 20;
const REPLACED_OF: u64 = 4;
/// Readings of a benchmark that say how often it is measured, the latest.
const LATEST: usize = 200;
/// Readings from which on a sign is doubted, where of all that they go by this share is backwards.
const FEWEST_STEPS: usize = 10;
const HALF: f64 = 0.5;
/// A newest reading that is so many days old is asked about: a logger that is at work gives newer ones.
const OLD_DAYS: i64 = 30;
/// And readings that go over so many: dates that are read as others do.
const LONG_DAYS: i64 = 20 * 365;

/// Where a value stands: the number of its file among those of the source, and its line; 0 in a recording.
pub(super) type FilePlace = (usize, u64);

/// One reading as it stands in a file.
#[derive(Debug, Clone, Copy)]
struct ReadValue {
    time: Timestamp,
    /// In the track's unit.
    value: f64,
    place: FilePlace,
}

#[derive(Debug)]
pub(super) struct PreviewTrack {
    pub(super) view: BenchmarkPreview,
    unit: Unit,
    /// Suspicions that people have looked into.
    accepted: BTreeSet<Suspicion>,
    resets: DeclaredResets,
    readings: Vec<ReadValue>,
    /// Those that lie further ahead of the clock than a daemon takes.
    ahead: Vec<ReadValue>,
    /// The first reading in another unit.
    other_unit: Option<(Unit, FilePlace)>,
}

/// What became of the readings of one time.
#[derive(Debug, Default)]
struct MergedReadings {
    corrected: u64,
    repeated: u64,
    /// The first correction: the reading and what stood there before.
    first: Option<(ReadValue, f64)>,
}

impl MergedReadings {
    /// The one of `all`, which are of one time, that the daemon takes last. A value that comes again after its correction is
    /// a repetition where another one follows, as in a file that is read again, and has been corrected back where none does.
    fn newest(&mut self, all: &[ReadValue]) -> Option<ReadValue> {
        let (first, others) = all.split_first()?;
        let mut newest = *first;
        if others.is_empty() {
            return Some(newest);
        }
        let mut seen = BTreeSet::from([first.value.to_bits()]);
        for one in others {
            if seen.insert(one.value.to_bits()) {
                self.correct(newest, *one);
                newest = *one;
            } else {
                self.repeated += 1;
            }
        }
        let last = *all.last()?;
        if last.value.to_bits() != newest.value.to_bits() {
            self.repeated -= 1;
            self.correct(newest, last);
            newest = last;
        }
        Some(newest)
    }

    fn correct(&mut self, before: ReadValue, by: ReadValue) {
        self.corrected += 1;
        self.first.get_or_insert((by, before.value));
    }
}

impl PreviewTrack {
    pub(super) fn new(
        view: BenchmarkPreview,
        unit: Unit,
        accepted: BTreeSet<Suspicion>,
        resets: DeclaredResets,
    ) -> Self {
        Self {
            view,
            unit,
            accepted,
            resets,
            readings: Vec::new(),
            ahead: Vec::new(),
            other_unit: None,
        }
    }

    /// A reading in `unit`, which the daemon takes, or holds where it lies too far ahead.
    pub(super) fn take(
        &mut self,
        Sample { time, value }: Sample,
        unit: Unit,
        place: FilePlace,
        is_ahead: bool,
    ) {
        let value = if unit == self.unit {
            value
        } else {
            self.other_unit.get_or_insert((unit, place));
            value * unit.factor() / self.unit.factor()
        };
        let one = ReadValue { time, value, place };
        let list = if is_ahead {
            &mut self.ahead
        } else {
            &mut self.readings
        };
        list.push(one);
    }

    /// When its readings were measured that lie ahead of the clock, and when the newest other one was.
    pub(super) fn times_ahead(&self) -> (Vec<Timestamp>, Option<Timestamp>) {
        let mut ahead: Vec<Timestamp> = self.ahead.iter().map(|one| one.time).collect();
        ahead.sort_unstable();
        (ahead, self.readings.iter().map(|one| one.time).max())
    }

    /// What there is to say of it; those ahead of the clock count where they prove it to be wrong. `name` shows a place.
    pub(super) fn finish(
        mut self,
        now: Timestamp,
        ahead_count: bool,
        clock: Option<&LocalClock>,
        name: &dyn Fn(FilePlace) -> String,
    ) -> BenchmarkPreview {
        if ahead_count {
            self.readings.append(&mut self.ahead);
        }
        let newest = self
            .readings
            .iter()
            .chain(&self.ahead)
            .map(|one| one.time)
            .max();
        let merged = self.merge();
        self.view.readings = self.readings.len() as u64;
        (self.view.corrected, self.view.repeated) = (merged.corrected, merged.repeated);
        self.view.ahead = self.ahead.len() as u64;
        if self.readings.is_empty() {
            self.readings.append(&mut self.ahead);
        }
        if let (Some(first), Some(last)) = (self.readings.first(), self.readings.last()) {
            self.view.first = (first.time, first.value);
            self.view.last = (last.time, last.value);
        }
        let latest: Vec<Timestamp> = self
            .readings
            .iter()
            .rev()
            .take(LATEST)
            .map(|one| one.time)
            .collect();
        let pairs = latest.iter().zip(latest.iter().skip(1));
        let mut gaps: Vec<i64> = pairs.map(|(b, a)| b.duration_since(*a).as_secs()).collect();
        self.view.every_s = upper_median_by(&mut gaps, Ord::cmp);
        let (values, of_resets) = self.without_resets();
        self.view.moved_mm = self.moved_mm(&values);
        self.view.suspicions = self.suspicions(newest, now, &values, of_resets);
        self.view.remarks = self.remarks(&merged, clock, name);
        self.view.remarks.extend(self.age(now));
        self.view
    }

    /// Puts them in order, one of each time: the last one that was read.
    fn merge(&mut self) -> MergedReadings {
        self.readings.sort_by_key(|one| one.time);
        let mut merged = MergedReadings::default();
        let of_each_time = self.readings.chunk_by(|one, next| one.time == next.time);
        let kept = of_each_time.filter_map(|all| merged.newest(all)).collect();
        self.readings = kept;
        merged
    }

    fn remarks(
        &self,
        merged: &MergedReadings,
        clock: Option<&LocalClock>,
        name: &dyn Fn(FilePlace) -> String,
    ) -> Vec<String> {
        let mut remarks = Vec::new();
        let unit = self.unit;
        if let Some((one, before)) = merged.first {
            let zone = clock.and_then(|clock| clock.zone.as_ref());
            let is_twice = zone.is_some_and(|zone| is_shown_twice(one.time, zone));
            let why = clock.filter(|_| is_twice).map_or(String::new(), |clock| {
                let what = put_back(clock.summer_time);
                format!("; the clocks are put back then and show this hour twice: {what}")
            });
            remarks.push(format!(
                "{}: another reading of {}: found {} {unit}, and {before} {unit} before; the last one counts{why}",
                name(one.place),
                one.time,
                one.value,
            ));
        }
        if let Some((other, place)) = self.other_unit {
            remarks.push(format!(
                "{}: found {other}, and {unit} before: each is taken in its own unit, and shown in {unit}; is the header right?",
                name(place)
            ));
        }
        remarks
    }

    /// The readings, displacements without what they jump by at declared resets, and what contradicts those.
    fn without_resets(&self) -> (Vec<(Timestamp, f64)>, Vec<String>) {
        let readings = self.readings.iter();
        let values: Vec<_> = readings.map(|one| (one.time, one.value)).collect();
        match self.view.quantity {
            Quantity::Displacement => self.resets.taken_off(&values, self.unit),
            Quantity::Velocity => (values, Vec::new()),
        }
    }

    fn moved_mm(&self, values: &[(Timestamp, f64)]) -> Option<f64> {
        let is_displacement = self.view.quantity == Quantity::Displacement;
        let moved = values.last()?.1 - values.first()?.1;
        is_displacement.then(|| moved * self.unit.factor())
    }

    /// What to ask where the newest reading is old, or all of them go over more years than instruments do.
    fn age(&self, now: Timestamp) -> Option<String> {
        let (first, last) = (self.readings.first()?.time, self.readings.last()?.time);
        let days = |from: Timestamp, until: Timestamp| until.duration_since(from).as_hours() / 24;
        let (old, span) = (days(last, now), days(first, last));
        if old <= OLD_DAYS && span <= LONG_DAYS {
            return None;
        }
        let what = if old > OLD_DAYS {
            format!("the newest reading is {old} days old: if newer ones are in the files")
        } else {
            format!("the readings go over {} years: if they do not", span / 365)
        };
        Some(format!(
            "{what}, their dates are read in another way than they are meant: see what stands as the last time above, and time_format (--time-format)"
        ))
    }

    fn suspicions(
        &self,
        newest: Option<Timestamp>,
        now: Timestamp,
        values: &[(Timestamp, f64)],
        of_resets: Vec<String>,
    ) -> Vec<String> {
        let ahead = newest
            .and_then(|newest| suspicion::ahead(newest, now))
            .into_iter();
        let (quantity, unit) = (self.view.quantity, &self.view.unit);
        let backwards = self.moves_backwards(values);
        let is_accepted = self.accepted.contains(&Suspicion::Scale);
        let other = other_unit::standing(values, quantity).filter(|_| !is_accepted);
        let of_values = suspicion::of_values(values, quantity, unit);
        // One step is no fall of the slope and another unit.
        let step = other.as_ref().map(OtherUnit::at);
        let of_values = of_values.into_iter();
        let of_values = of_values.filter(|one| one.kind != Suspicion::Fall || Some(one.at) != step);
        let newest = values.last().map_or(Timestamp::UNIX_EPOCH, |last| last.0);
        let other = other.map(|other| other.suspicion(newest, unit));
        let all = ahead.chain(other).chain(of_values);
        let not_accepted = all.filter(|one| !self.accepted.contains(&one.kind));
        let texts = not_accepted.map(|one| one.text);
        let texts = texts.chain(of_resets).chain(backwards);
        texts.chain(self.of_two_sensors()).collect()
    }

    /// Where so many readings are replaced by another of the same time that they may be of another sensor.
    fn of_two_sensors(&self) -> Option<String> {
        let (corrected, readings) = (self.view.corrected, self.view.readings);
        (corrected >= FEWEST_REPLACED && REPLACED_OF * corrected >= readings).then(|| {
            format!(
                "{corrected} readings are replaced by another one of the same time: do files, or rows, of two sensors go into this benchmark?"
            )
        })
    }

    /// What to do where the displacement falls all along, or the velocity is negative.
    fn moves_backwards(&self, values: &[(Timestamp, f64)]) -> Option<String> {
        let (what, motion): (&str, Vec<f64>) = match self.view.quantity {
            Quantity::Displacement => {
                let pairs = values.windows(2);
                let steps = pairs.map(|pair| pair[1].1 - pair[0].1);
                ("displacement falls", steps.collect())
            }
            Quantity::Velocity => {
                let values = values.iter().map(|(_, value)| *value);
                ("velocity is negative", values.collect())
            }
        };
        let sum: f64 = motion.iter().sum();
        let sizes: f64 = motion.iter().map(|one| one.abs()).sum();
        let is_known = self.accepted.contains(&Suspicion::Fall);
        let is_backwards = !is_known && values.len() >= FEWEST_STEPS && sum < -HALF * sizes;
        is_backwards.then(|| {
            format!(
                "its {what}: motion counts as positive, and a slope that moves backwards calls no red; if its sign is \
                 the other way, write components = [\"COLUMN\"] and direction = [-1.0] for this benchmark"
            )
        })
    }
}

/// What two readings of an hour that the clocks show twice say of a logger that is taken to do so.
fn put_back(summer_time: SummerTime) -> &'static str {
    match summer_time {
        SummerTime::Standard => {
            "if this logger's clock is put back with them, dst = \"standard\" is \
             wrong, and its times of the summer are taken an hour late; let it write UTC, or times with an offset"
        }
        SummerTime::Earlier | SummerTime::Later => {
            "of its two readings one is lost, unless the logger writes UTC, or times with \
             an offset; one that is never put back needs dst = \"standard\""
        }
        SummerTime::Reject => {
            "a logger that is never put back needs dst = \"standard\", \
             and another one times with an offset"
        }
    }
}

/// Whether the clocks of the zone show the time of this instant twice.
fn is_shown_twice(time: Timestamp, zone: &TimeZone) -> bool {
    let local = zone.to_datetime(time);
    zone.to_ambiguous_timestamp(local).is_ambiguous()
}

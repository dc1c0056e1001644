//! The readings of one benchmark, what people declare of them, and when the newest came.

mod ahead;
mod declared;
mod set_back;

use crate::alert::Level;
use crate::fit::{Observations, Rate};
use crate::monitor::declared::Declarations;
use crate::monitor::event::{Event, EventKind, alert_key};
use crate::monitor::history::{History, MeasuredAs, Taken};
use crate::monitor::silence::Silence;
use crate::reading::{BenchmarkId, Quantity, Reading, Timestamp, Unit, days_of};
use jiff::SignedDuration;
use serde::Serialize;

pub(super) use ahead::{HeldReading, LateRun};

/// A reading leaps ahead in time when it lies further than this after the one before,
const LEAST_LEAP: SignedDuration = SignedDuration::from_hours(48);
/// and than so many times the usual spacing.
const LEAP_SPACINGS: i32 = 20;

/// What has been read of one benchmark.
#[derive(Debug, Serialize)]
pub(super) struct BenchmarkRecord {
    benchmark: BenchmarkId,
    history: History,
    silence: Silence,
    newest: Option<Timestamp>,
    /// What people declare for it.
    declared: Declarations,
    /// A reading that lies far ahead of all others.
    ahead: Option<HeldReading>,
    late_run: LateRun,
    /// How often what was known of the benchmark has been dropped before.
    #[serde(skip_serializing_if = "was_never_dropped")]
    dropped: u32,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
fn was_never_dropped(times: &u32) -> bool {
    *times == 0
}

impl BenchmarkRecord {
    pub(super) fn new(
        benchmark: BenchmarkId,
        source: MeasuredAs,
        epoch: Timestamp,
        declared: Declarations,
        dropped: u32,
    ) -> Self {
        Self {
            benchmark,
            history: History::new(source, epoch),
            silence: Silence::default(),
            newest: None,
            declared,
            ahead: None,
            late_run: LateRun::default(),
            dropped,
        }
    }

    pub(super) fn from_saved(
        benchmark: BenchmarkId,
        history: History,
        silence: Silence,
        newest: Option<Timestamp>,
        declared: Declarations,
        ahead: Option<HeldReading>,
        dropped: u32,
    ) -> Self {
        Self {
            benchmark,
            history,
            silence,
            newest,
            declared,
            ahead,
            late_run: LateRun::default(),
            dropped,
        }
    }

    /// The same with what has come since its newest reading.
    pub(super) fn with_late_run(self, late_run: LateRun) -> Self {
        Self { late_run, ..self }
    }

    pub(super) fn benchmark(&self) -> &BenchmarkId {
        &self.benchmark
    }

    pub(super) fn history(&self) -> &History {
        &self.history
    }

    pub(super) fn observations(&self) -> &Observations {
        &self.history.observations
    }

    /// When the newest reading came, those included by which a stuck sensor repeats its last value.
    pub(super) fn newest(&self) -> Option<Timestamp> {
        self.newest
    }

    /// How often what was known of the benchmark has been dropped before.
    pub(super) fn dropped(&self) -> u32 {
        self.dropped
    }

    /// The key of an alert in force since `since`.
    pub(super) fn alert_key(&self, level: Level, since: Timestamp) -> String {
        alert_key(&self.benchmark, level, self.dropped, since)
    }

    /// The time of what follows from a reading of `time`: data time does not go back.
    pub(super) fn data_time(&self, time: Timestamp) -> Timestamp {
        self.newest.map_or(time, |newest| newest.max(time))
    }

    /// Whether a reading of `time` comes after a later one.
    pub(super) fn is_late(&self, time: Timestamp) -> bool {
        self.newest.is_some_and(|newest| time <= newest)
    }

    pub(super) fn take(&mut self, source: MeasuredAs, reading: &Reading) -> Taken {
        self.history.take(source, reading)
    }

    /// The reading of `time` is the newest, but for one that waits.
    pub(super) fn note_newest(&mut self, time: Timestamp) {
        self.late_run = LateRun::after(self.newest);
        self.newest = Some(self.data_time(time));
    }

    /// Of so many newest readings, that say nothing, only the first is left.
    pub(super) fn forget_repeats(&mut self, count: usize) {
        self.history.forget_repeats(count);
    }

    /// Between which values the readings of a sensor at the end of its range lie; `None`: it is not there.
    pub(super) fn note_range_end(&mut self, range_end: Option<(f64, f64)>) {
        self.history.range_end = range_end;
    }

    /// At `time` the sensor gave something else instead of a reading.
    pub(super) fn note_missing(&mut self, time: Timestamp) {
        self.silence.note_missing(time);
    }

    /// Whether the benchmark gives no readings.
    pub(super) fn is_silent(&self) -> bool {
        self.silence.is_silent()
    }

    /// When it becomes silent, if no reading comes.
    pub(super) fn silent_at(&self) -> Option<Timestamp> {
        let (newest, due) = (self.silence.counted_from()?, self.silence.deadline()?);
        Some(self.put_off(newest, due))
    }

    /// It is silent from now on; the time of the last reading.
    pub(super) fn begin_silence(&mut self) -> Option<Timestamp> {
        self.silence.begins()
    }

    /// Ends the silence that there is; the reading before which it began.
    pub(super) fn end_silence(&mut self) -> Option<Timestamp> {
        self.silence.end()
    }

    /// Takes the reading of `time` for what the silence is counted from; where it ends one, the reading before which that began.
    pub(super) fn break_silence(&mut self, time: Timestamp) -> Option<Timestamp> {
        let maintained = (self.silence.newest())
            .is_some_and(|newest| self.declared.is_maintained_between(newest, time));
        if maintained {
            self.silence.broken_after_maintenance_by(time)
        } else {
            self.silence.broken_by(time)
        }
    }

    /// One of `time` has been read, and waits for earlier ones; where it ends a silence at `now`, the reading before which that began.
    pub(super) fn note_waiting(&mut self, time: Timestamp, now: Timestamp) -> Option<Timestamp> {
        self.silence.note_waiting(time, now)
    }

    /// When the last one was that has been read, of those that wait for earlier ones too.
    pub(super) fn counted_from(&self) -> Option<Timestamp> {
        self.silence.counted_from()
    }

    /// Whether its readings come many together, long after they were measured.
    pub(super) fn comes_in_batches(&self) -> bool {
        self.silence.comes_in_batches()
    }

    /// What comes now was measured long before `time`, which it is by the clock.
    pub(super) fn fall_behind(&mut self, time: Timestamp) {
        self.silence.fall_behind(time);
    }

    /// What time it was when one came that was measured long before.
    pub(super) fn behind(&self) -> Option<Timestamp> {
        self.silence.behind()
    }

    /// Whether a reading of `time` lies so far after the newest one that the logger's clock may have jumped. Where hardly
    /// anything has been read, the spacings that there are count.
    pub(super) fn leaps(&self, time: Timestamp) -> bool {
        let Some(newest) = self.newest else {
            return false;
        };
        let usual = self.silence.median().unwrap_or(SignedDuration::ZERO);
        let least = usual
            .checked_mul(LEAP_SPACINGS)
            .unwrap_or(SignedDuration::MAX)
            .max(LEAST_LEAP);
        let continues = self
            .ahead
            .as_ref()
            .is_some_and(|ahead| ahead.precedes(time, least));
        !continues && time.duration_since(newest) > least
    }

    /// Readings at the beginning of the record that a logger gave before its clock was set are left out.
    pub(super) fn leave_out_clockless(&mut self, now: Timestamp) -> Option<Event> {
        let (from, to, count) = self.history.forget_clockless()?;
        self.silence.forget_gap();
        let text = format!(
            "benchmark {}: {count} readings of {from} to {to}, as by a logger whose clock is not set, lie {:.0} days \
             before all others: left out",
            self.benchmark,
            days_of(self.history.first()?.duration_since(to)),
        );
        Some(self.fault(now, "clock-not-set", text))
    }

    /// Rates of the whole record, and `now` on its clock, days.
    pub(super) fn rates_at(&self, now: Timestamp) -> (Vec<Rate>, f64) {
        (self.history.rates(), self.history.days(now))
    }

    /// Where the readings come from as they are kept.
    pub(super) fn source(&self) -> MeasuredAs {
        let unit = match self.history.observations.quantity {
            Quantity::Displacement => Unit::MM,
            Quantity::Velocity => Unit::MM_PER_DAY,
        };
        MeasuredAs {
            unit,
            averaging: self.history.averaging(),
        }
    }

    pub(super) fn fault(&self, time: Timestamp, kind: &str, text: String) -> Event {
        self.event(
            time,
            EventKind::Fault {
                kind: kind.to_owned(),
                text,
            },
        )
    }

    pub(super) fn event(&self, time: Timestamp, kind: EventKind) -> Event {
        Event {
            time,
            kind,
            benchmark: Some(self.benchmark.clone()),
        }
    }

    /// The unit in which the readings are kept.
    pub(super) fn unit(&self) -> &'static str {
        match self.history.observations.quantity {
            Quantity::Displacement => "mm",
            Quantity::Velocity => "mm/day",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::track::fixture::{DISPLACEMENT, at, reading, record, record_each};

    #[test]
    fn a_benchmark_called_site_shares_no_key_with_an_alert_of_the_whole_site() {
        let key = |id: &str, dropped: u32| {
            let (id, declared) = (BenchmarkId::new(id), Declarations::default());
            let record = BenchmarkRecord::new(id, DISPLACEMENT, at(0), declared, dropped);
            record.alert_key(Level::Red, at(3))
        };
        assert_eq!(key("p1", 0), "p1/red/2020-01-01T03:00:00Z");
        assert_eq!(key("site", 0), "site/red/1/2020-01-01T03:00:00Z");
        assert_eq!(key("site", 1), "site/red/2/2020-01-01T03:00:00Z");
    }

    #[test]
    fn a_reading_leaps_only_far_beyond_the_usual_spacing_and_not_where_one_waits_before_it() {
        let mut record = record((0..12).map(f64::from));
        assert!(!record.leaps(at(11 + 48)));
        assert!(record.leaps(at(11 + 49)));
        record.put_aside(at(12), DISPLACEMENT, &reading(100, 3.0));
        assert!(!record.leaps(at(101)));
        assert!(record.leaps(at(99)));
    }

    #[test]
    fn a_benchmark_that_has_hardly_been_read_waits_with_a_reading_far_ahead_too() {
        for count in 1..4 {
            let record = record((0..count).map(f64::from));
            assert!(record.leaps(at(720)), "{count}");
        }
        let weekly = record_each(168, [0.0, 1.0]);
        assert!(!weekly.leaps(at(3 * 168)));
    }

    #[test]
    fn what_follows_from_a_late_reading_has_the_time_of_the_newest() {
        let record = record([0.0, 1.0, 2.0]);
        assert!(record.is_late(at(1)) && !record.is_late(at(3)));
        assert_eq!(record.data_time(at(1)), at(2));
        assert_eq!(record.data_time(at(3)), at(3));
    }
}

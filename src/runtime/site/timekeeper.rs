//! What time it is at a site, from the host's clock and from what the loggers say.
//!
//! The host's clock may be years off: a battery is flat, a time server is wrong. The readings know better: it cannot be
//! earlier than the newest of them that is known, and while readings come in live, it is about as late as they say.

use crate::reading::Timestamp;
use crate::runtime::clock::{Stopwatch, TOLERANCE};
use jiff::SignedDuration;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Live readings that lie further than this behind the host's clock say what time it is, and not the clock.
const BEHIND: SignedDuration = SignedDuration::from_hours(24);
/// Held readings of one benchmark that come as far apart as they were measured: so many say that their time is right.
const STEADY: usize = 4;
/// As far apart: by this share of the time between them, and by so much in any case.
const APART: f64 = 0.25;
const LEAST_APART: Duration = Duration::from_secs(60);
/// What comes together comes within this time; and what comes in blocks, mostly, within the longer one, or so many times the interval of the readings.
const SHORT_PAUSE: Duration = Duration::from_secs(20);
const LONG_PAUSE: Duration = Duration::from_secs(3 * 3600);
const INTERVALS: u32 = 3;

/// A time without readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PauseLength {
    /// More of a block would have come.
    Short,
    /// Another block would have come, mostly.
    Long,
}

/// What is known of the time.
#[derive(Debug, Default)]
pub(super) struct Timekeeper {
    /// The newest time of a reading that is known, and how long ago it came.
    known: Option<(Timestamp, Stopwatch)>,
    /// Whether that reading came in live.
    is_live: bool,
    /// How long ago the newest live one came.
    came: Option<Stopwatch>,
    /// Whether live readings have shown that they come when they are measured, and none of them is one of a backlog.
    is_proven: bool,
    /// Of each benchmark the latest live readings that lie far behind the clock, and how long ago they came.
    behind: LatestReadings,
    /// Of each benchmark the latest readings that are held, and how long ago they came.
    held: LatestReadings,
}

/// The latest readings of each benchmark, and how long ago each came.
#[derive(Debug, Default)]
struct LatestReadings(BTreeMap<String, VecDeque<(Timestamp, Stopwatch)>>);

impl LatestReadings {
    /// Notes one more; whether the latest come as far apart as they were measured.
    fn are_steady_with(&mut self, benchmark: &str, time: Timestamp) -> bool {
        let latest = self.0.entry(benchmark.to_owned()).or_default();
        let since = latest.back().map(|(last, _)| time.duration_since(*last));
        // Of those that are read more often some are enough.
        if since.is_some_and(|since| since <= SignedDuration::from_mins(2)) {
            return false;
        }
        latest.push_back((time, Stopwatch::start()));
        if latest.len() > STEADY {
            latest.pop_front();
        }
        let pairs = latest.iter().zip(latest.iter().skip(1));
        let mut each = pairs.map(|(before, after)| are_as_far_apart(*before, *after));
        latest.len() == STEADY && each.all(|is_as_far| is_as_far)
    }

    /// The longest time between the newest two readings of a benchmark, as they were measured.
    fn longest_interval(&self) -> Duration {
        let newest_two = |latest: &VecDeque<(Timestamp, Stopwatch)>| {
            let mut newest = latest.iter().rev().map(|(time, _)| *time);
            let since = newest.next()?.duration_since(newest.next()?);
            Duration::try_from(since).ok()
        };
        let each = self.0.values().filter_map(newest_two);
        each.max().unwrap_or_default()
    }
}

impl Timekeeper {
    /// A reading of `time` is known.
    pub(super) fn knows(&mut self, time: Timestamp, is_live: bool) {
        let now = Stopwatch::start();
        let is_later = self.estimate().is_none_or(|estimate| time > estimate);
        if is_later || (is_live && !self.is_live) {
            let known = self.known.map_or(time, |(known, _)| known.max(time));
            self.known = Some((known, now));
        }
        self.is_live |= is_live;
        self.came = if is_live { Some(now) } else { self.came };
    }

    /// The newest known time and what has passed since.
    fn estimate(&self) -> Option<Timestamp> {
        let (known, since) = self.known?;
        let passed = SignedDuration::try_from(since.elapsed()).ok()?;
        known.checked_add(passed).ok()
    }

    /// Whether the host's clock, which says `host_time`, is earlier than what is known.
    pub(super) fn is_behind(&self, host_time: Timestamp) -> bool {
        // Not the known time alone: it may be that of a reading of days ago, where all since came in time.
        self.estimate()
            .is_some_and(|estimate| estimate.duration_since(host_time) > TOLERANCE)
    }

    /// The time at the site, while the host's clock says `host_time`.
    pub(super) fn now(&self, host_time: Timestamp) -> Timestamp {
        let Some(estimate) = self.estimate() else {
            return host_time;
        };
        let is_ahead = self.is_live && host_time.duration_since(estimate) > BEHIND;
        if self.is_behind(host_time) || is_ahead {
            estimate
        } else {
            host_time
        }
    }

    /// Whether the host's clock, which says `host_time`, has gone on by far more than the time that ran since readings agreed with
    /// it: the host was suspended, or its clock was set ahead.
    pub(super) fn has_leapt(&self, host_time: Timestamp) -> bool {
        let is_far = |estimate| host_time.duration_since(estimate) > BEHIND;
        self.is_live && self.is_proven && self.estimate().is_some_and(is_far)
    }

    /// A live reading of `benchmark` and `time` has come while the host's clock says `host_time`.
    pub(super) fn comes(&mut self, benchmark: &str, time: Timestamp, host_time: Timestamp) {
        if self.is_proven {
            return;
        }
        let is_far_behind = host_time.duration_since(time) > BEHIND;
        self.is_proven = !is_far_behind || self.behind.are_steady_with(benchmark, time);
        if self.is_proven {
            self.behind = LatestReadings::default();
        }
    }

    /// How late it may be at the site, while the host's clock says `host_time`: as late as that where live readings lie far behind it
    /// and may be a backlog as well as right.
    pub(super) fn latest(&self, host_time: Timestamp) -> Timestamp {
        let now = self.now(host_time);
        if self.is_proven {
            now
        } else {
            now.max(host_time)
        }
    }

    /// For how long no reading has come, where the host's clock, which says `host_time`, is far ahead of live ones that may be a backlog as well as right:
    /// what is due without a reading is judged by the clock then. `None` where it is not, or some have just come.
    pub(super) fn in_doubt(&self, host_time: Timestamp) -> Option<PauseLength> {
        let since = self.came?.elapsed();
        let pause = if since < SHORT_PAUSE {
            return None;
        } else if since < LONG_PAUSE.max(INTERVALS * self.behind.longest_interval()) {
            PauseLength::Short
        } else {
            PauseLength::Long
        };
        (self.latest(host_time) > self.now(host_time)).then_some(pause)
    }

    /// A reading of `benchmark` and `time` lies beyond what the clock allows, and is held. Whether those of this
    /// benchmark come as far apart as they were measured: their time is right then.
    pub(super) fn holds(&mut self, benchmark: &str, time: Timestamp) -> bool {
        let is_steady = self.held.are_steady_with(benchmark, time);
        if is_steady {
            self.held = LatestReadings::default();
            self.known = Some((time, Stopwatch::start()));
        }
        is_steady
    }

    /// Nothing is held any more.
    pub(super) fn releases(&mut self) {
        self.held = LatestReadings::default();
    }
}

fn are_as_far_apart(before: (Timestamp, Stopwatch), after: (Timestamp, Stopwatch)) -> bool {
    let came = before.1.elapsed().saturating_sub(after.1.elapsed());
    let Ok(measured) = Duration::try_from(after.0.duration_since(before.0)) else {
        return false;
    };
    let allowed = measured.mul_f64(APART).max(LEAST_APART);
    measured > allowed && came.abs_diff(measured) <= allowed
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::ToSpan;

    fn noon() -> Timestamp {
        "2026-03-01T12:00:00Z".parse().unwrap()
    }

    #[test]
    fn a_clock_that_is_earlier_than_a_known_reading_is_not_believed() {
        let mut keeper = Timekeeper::default();
        assert_eq!(keeper.now(noon()), noon());
        keeper.knows(noon(), false);
        assert!(!keeper.is_behind(noon() - 30.minutes()));
        assert!(keeper.is_behind(noon() - 48.hours()));
        assert!(keeper.now(noon() - 48.hours()) >= noon());
        let later = noon() + 9000.hours();
        assert_eq!(keeper.now(later), later, "the daemon was off");
    }

    #[test]
    fn a_clock_that_is_far_ahead_of_live_readings_is_not_believed() {
        let mut keeper = Timekeeper::default();
        keeper.knows(noon(), true);
        let ahead = noon() + 1000.hours();
        assert!(keeper.now(ahead) < noon() + 1.hour());
        assert_eq!(keeper.now(noon() + 3.hours()), noon() + 3.hours());
    }

    #[tokio::test(start_paused = true)]
    async fn a_clock_that_is_set_back_after_days_of_readings_in_time_is_not_believed() {
        let mut keeper = Timekeeper::default();
        for hour in 0..100 {
            keeper.knows(noon() + hour.hours(), true);
            assert!(!keeper.is_behind(noon() + hour.hours()), "{hour}");
            tokio::time::advance(Duration::from_secs(3600)).await;
        }
        let now = noon() + 100.hours();
        assert!(keeper.is_behind(now - 2.hours()));
        assert_eq!(keeper.now(now - 2.hours()), now);
        assert!(!keeper.is_behind(now));
    }

    #[tokio::test(start_paused = true)]
    async fn what_came_far_behind_the_clock_is_in_doubt_once_no_more_comes_until_it_is_proven() {
        let (mut keeper, host_time) = (Timekeeper::default(), noon() + 1000.hours());
        for hour in 0..6 {
            keeper.knows(noon() + hour.hours(), true);
            keeper.comes("5", noon() + hour.hours(), host_time + hour.hours());
            assert_eq!(keeper.in_doubt(host_time + hour.hours()), None, "{hour}");
            tokio::time::advance(Duration::from_secs(60)).await;
            let later = host_time + hour.hours() + 1.minute();
            let short = (hour < 3).then_some(PauseLength::Short);
            assert_eq!(keeper.in_doubt(later), short, "{hour}");
            tokio::time::advance(Duration::from_secs(3540)).await;
            let later = host_time + (hour + 1).hours();
            // The next of readings that come each hour is not late yet.
            assert_eq!(keeper.in_doubt(later), short, "{hour}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_pause_is_long_after_three_hours_or_three_intervals_of_the_readings() {
        for (apart, long) in [(10 * 60, 3 * 3600), (2 * 3600, 6 * 3600)] {
            let (mut keeper, host_time) = (Timekeeper::default(), noon() + 1000.hours());
            for reading in 0..2 {
                let time = noon() + (reading * apart).seconds();
                keeper.knows(time, true);
                keeper.comes("5", time, host_time);
            }
            for (after, pause) in [(long - 60, PauseLength::Short), (120, PauseLength::Long)] {
                tokio::time::advance(Duration::from_secs(after)).await;
                assert_eq!(keeper.in_doubt(host_time), Some(pause), "{apart}");
            }
        }
    }

    #[tokio::test(start_paused = true)]
    async fn far_behind_the_clock_readings_may_be_a_backlog_until_four_come_as_far_apart_as_measured()
     {
        let (mut keeper, host_time) = (Timekeeper::default(), noon() + 1000.hours());
        let comes = |keeper: &mut Timekeeper, minute: i64| {
            keeper.knows(noon() + minute.minutes(), true);
            keeper.comes("5", noon() + minute.minutes(), host_time);
        };
        for minute in 0..30 {
            comes(&mut keeper, minute);
            assert_eq!(keeper.latest(host_time), host_time);
        }
        for minute in 40..44 {
            assert_eq!(keeper.latest(host_time), host_time, "{minute}");
            tokio::time::advance(Duration::from_secs(600)).await;
            comes(&mut keeper, 10 * minute - 370);
        }
        assert!(keeper.latest(host_time) < noon() + 2.hours());
    }

    #[test]
    fn a_clock_that_leaps_ahead_of_readings_in_time_is_doubted_until_one_agrees_with_it() {
        let mut keeper = Timekeeper::default();
        keeper.knows(noon(), false);
        let leapt = noon() + 72.hours();
        assert!(!keeper.has_leapt(leapt), "the daemon was off");
        keeper.knows(noon() + 1.minute(), true);
        keeper.comes("5", noon() + 1.minute(), noon() + 2.minutes());
        assert!(!keeper.has_leapt(noon() + 20.hours()));
        assert!(keeper.has_leapt(leapt));
        keeper.knows(leapt, true);
        assert!(!keeper.has_leapt(leapt));
    }

    #[test]
    fn a_reading_in_time_shows_that_live_ones_are_no_backlog() {
        let mut keeper = Timekeeper::default();
        keeper.knows(noon(), true);
        keeper.comes("5", noon(), noon() + 2.minutes());
        let jumped = noon() + 1000.hours();
        assert!(keeper.latest(jumped) < noon() + 1.hour());
    }

    #[test]
    fn readings_that_come_all_at_once_do_not_say_what_time_it_is() {
        let mut keeper = Timekeeper::default();
        keeper.knows(noon(), false);
        for hour in 1..100 {
            assert!(!keeper.holds("5", noon() + hour.hours()));
        }
    }
}

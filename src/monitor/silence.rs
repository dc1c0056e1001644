//! How long a benchmark may be silent: silence is not safety.

use crate::reading::{SECONDS_PER_DAY, Timestamp, upper_median_by};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Spacings remembered.
const REMEMBERED: usize = 9;
/// A benchmark may skip this many of its usual readings.
pub const MAY_SKIP: i32 = 4;
/// Where readings are lost one by one it may skip as many more as chance makes so many times a day, at most so many.
const BY_CHANCE_A_DAY: f64 = 0.02;
const MOST_SKIPPED: i32 = 12;
/// Readings over which the share that is lost is learnt, and fewest.
const LEARNT_OVER: f64 = 64.0;
const FEWEST_LEARNT: f64 = 24.0;
/// So many gaps between bursts of readings make a rhythm.
const CYCLES: u8 = 4;
/// So many batches of readings, each so long after the one before, show that they come in batches; and so many readings that come in time, that
/// they no longer do.
const BATCHES: usize = 3;
const IN_TIME: u8 = 6;
/// A benchmark with a single reading is called silent after this time: it may be one that is read once a week.
const FIRST: SignedDuration = SignedDuration::from_hours(8 * 24);
/// One that shares its table with others may be read once a day, with nothing between.
const A_DAY: SignedDuration = SignedDuration::from_hours(25);
/// No benchmark is called silent within this time.
const LEAST: SignedDuration = SignedDuration::from_mins(30);

/// Watches the spacing of one benchmark's readings.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Silence {
    newest: Option<Timestamp>,
    /// The newest that has been read and waits for earlier ones.
    #[serde(default)]
    waiting: Option<Timestamp>,
    spacings: VecDeque<SignedDuration>,
    /// How long after the only reading the sensor first gave something else instead of one.
    #[serde(default)]
    missing: Option<SignedDuration>,
    /// When the newest gaps began that are far longer than the usual spacing, and how long they were.
    #[serde(default)]
    gaps: VecDeque<(Timestamp, SignedDuration)>,
    silent: bool,
    /// Readings lost one by one of late, and readings that there were to be.
    #[serde(default)]
    lost: (f64, f64),
    /// What time it was when a reading came that was measured long before.
    #[serde(default)]
    behind: Option<Timestamp>,
    /// How long after the reading before it the next one came of late, where it had been measured in time.
    #[serde(default)]
    delays: VecDeque<SignedDuration>,
    /// The newest of these, of which it is not known yet when what came was measured.
    #[serde(default)]
    delay: Option<SignedDuration>,
    /// So many came in time since.
    #[serde(default)]
    in_time: u8,
    /// Whether the newest batch came so late that one is missing.
    #[serde(default)]
    has_missed: bool,
}

impl Silence {
    /// Notes a reading; when it ends a silence, the reading before which that one began. One of a backlog, by which the
    /// benchmark would still be silent, ends none.
    pub(super) fn broken_by(&mut self, time: Timestamp) -> Option<Timestamp> {
        if let Some(newest) = self.newest
            && time > newest
        {
            // A silence says little of the usual spacing: after one of months the next would be reported months late. Where
            // the benchmark is read more seldom from now on, a few readings are enough to learn it.
            let spacing = time.duration_since(newest);
            self.note_delay(spacing);
            self.note_gap(newest, spacing);
            self.note_lost(spacing);
            let most = self
                .allowed_in_time()
                .and_then(|allowed| allowed.checked_mul(MAY_SKIP));
            let most = most.filter(|_| self.silent).unwrap_or(spacing);
            self.spacings.push_back(spacing.min(most));
            if self.spacings.len() > REMEMBERED {
                self.spacings.pop_front();
            }
        }
        self.broken_after_maintenance_by(time)
    }

    /// As [`Silence::broken_by`]; how long that took says nothing of the usual spacing.
    pub(super) fn broken_after_maintenance_by(&mut self, time: Timestamp) -> Option<Timestamp> {
        self.delay = None;
        if self.newest.is_some_and(|newest| time <= newest) {
            return None;
        }
        let before = self.counted_from().or(Some(time));
        self.newest = Some(time);
        // It was known, as it waited, when the silence began.
        if Some(time) <= self.waiting {
            return None;
        }
        self.ends_by(self.behind).then_some(before).flatten()
    }

    /// Notes a reading that has been read and waits for earlier ones, at `now`; when it ends a silence, the reading before which
    /// that one began.
    pub(super) fn note_waiting(&mut self, time: Timestamp, now: Timestamp) -> Option<Timestamp> {
        let before = self.counted_from()?;
        if time <= before {
            return None;
        }
        self.waiting = Some(time);
        self.ends_by(Some(now)).then_some(before)
    }

    /// Ends the silence that there is, where by `now` the benchmark is not silent; whether it did.
    fn ends_by(&mut self, now: Option<Timestamp>) -> bool {
        if !self.silent || self.due().is_some_and(|due| Some(due) <= now) {
            return false;
        }
        (self.silent, self.behind) = (false, None);
        true
    }

    /// The only reading does not count for now. A silence goes on, and ends with a reading as others do.
    pub(super) fn begin_again(&mut self) {
        self.spacings.clear();
        (self.newest, self.waiting) = (None, None);
    }

    /// What time it was when a reading came that was measured long before; `None` where none has.
    pub(super) fn behind(&self) -> Option<Timestamp> {
        self.behind
    }

    /// What comes now was measured before `time`, which it is by the clock.
    pub(super) fn fall_behind(&mut self, time: Timestamp) {
        self.behind = Some(time);
        self.delay = self.counted_from().map(|from| time.duration_since(from));
    }

    /// Whether its readings come many together, long after they were measured.
    pub(super) fn comes_in_batches(&self) -> bool {
        self.between_batches().is_some()
    }

    /// Notes whether what had been measured so long after the reading before it came long after that.
    fn note_delay(&mut self, spacing: SignedDuration) {
        let usual = self.allowed_in_time();
        let Some((delay, usual)) = self.delay.take().zip(usual) else {
            return;
        };
        if delay <= usual {
            self.in_time = self.in_time.saturating_add(1);
            if self.in_time >= IN_TIME {
                self.delays.clear();
            }
        } else if spacing <= usual {
            self.in_time = 0;
            // An upload that was missed once makes no other rhythm.
            let is_missed = self.between_batches().is_some_and(|most| delay > most);
            if is_missed && !std::mem::replace(&mut self.has_missed, true) {
                return;
            }
            self.has_missed = false;
            self.delays.push_back(delay);
            let old = self.delays.len().saturating_sub(BATCHES);
            self.delays.drain(..old);
        }
    }

    /// For how long it may be silent where its readings come together at even times, as from a logger that is asked once a day.
    fn between_batches(&self) -> Option<SignedDuration> {
        let delays = self.delays.iter().map(SignedDuration::as_secs);
        let longest = delays
            .clone()
            .max()
            .filter(|_| self.delays.len() == BATCHES)?;
        is_even(delays).then(|| SignedDuration::from_secs(outlasted(longest)).min(FIRST))
    }

    /// Whether it is silent.
    pub(super) fn is_silent(&self) -> bool {
        self.silent
    }

    /// The usual spacing as far as it is known: from two readings on.
    pub(super) fn median(&self) -> Option<SignedDuration> {
        let mut spacings: Vec<SignedDuration> = self.spacings.iter().copied().collect();
        upper_median_by(&mut spacings, Ord::cmp)
    }

    /// The longest of the spacings was none.
    pub(super) fn forget_gap(&mut self) {
        if let Some(longest) = self.spacings.iter().max().copied() {
            self.spacings.retain(|one| *one < longest);
        }
    }

    /// Notes a reading during maintenance: it ends no silence.
    pub(super) fn continues(&mut self, time: Timestamp) {
        if !self.silent {
            self.newest = self.newest.max(Some(time));
        }
    }

    /// When the last reading was.
    pub(super) fn newest(&self) -> Option<Timestamp> {
        self.newest
    }

    /// When the last reading was that has been read, of those that wait for earlier ones too.
    pub(super) fn counted_from(&self) -> Option<Timestamp> {
        Some(self.newest?.max(self.waiting.unwrap_or(Timestamp::MIN)))
    }

    /// At `time` the sensor gave something else instead of a reading.
    pub(super) fn note_missing(&mut self, time: Timestamp) {
        let after = self.newest.map(|newest| time.duration_since(newest));
        let is_later = after.is_some_and(|after| after.is_positive());
        if is_later && self.spacings.is_empty() && self.missing.is_none() {
            self.missing = after;
        }
    }

    /// When silence becomes a fault; `None` when it already is one.
    pub(super) fn deadline(&self) -> Option<Timestamp> {
        if self.silent { None } else { self.due() }
    }

    fn due(&self) -> Option<Timestamp> {
        self.counted_from()?.checked_add(self.allowed()?).ok()
    }

    /// Keeps a spacing that is no usual one. Where bursts have a rhythm, those that stayed away part it in gaps of the usual kind, so that
    /// the rhythm is known when they come again.
    fn note_gap(&mut self, from: Timestamp, spacing: SignedDuration) {
        let usual = self.median().and_then(|usual| usual.checked_mul(MAY_SKIP));
        if usual.is_none_or(|usual| spacing <= usual.max(LEAST)) {
            return;
        }
        let seconds = spacing.as_secs();
        let (missed, period_s) = self.rhythm().map_or((0, 0), |rhythm| {
            let more = seconds - rhythm.gap_s + rhythm.period_s / 2;
            (more.div_euclid(rhythm.period_s).max(0), rhythm.period_s)
        });
        let gap = SignedDuration::from_secs(seconds - missed * period_s);
        // Of more than make a rhythm only the newest are kept.
        for index in (missed - i64::from(CYCLES)).max(0)..=missed {
            let later = from.checked_add(SignedDuration::from_secs(index * period_s));
            self.gaps.extend(later.ok().map(|from| (from, gap)));
        }
        let old = self.gaps.len().saturating_sub(usize::from(CYCLES));
        self.gaps.drain(..old);
    }

    /// The rhythm of a benchmark that is read in bursts, each so long after the one before; `None` where there is none.
    fn rhythm(&self) -> Option<Rhythm> {
        let (first, last) = (self.gaps.front()?.0, self.gaps.back()?.0);
        let begins = self.gaps.iter().map(|(from, _)| from.as_second());
        let periods = begins
            .clone()
            .zip(begins.skip(1))
            .map(|(one, next)| next - one);
        let gaps = self.gaps.iter().map(|(_, gap)| gap.as_secs());
        let is_rhythm =
            self.gaps.len() == usize::from(CYCLES) && is_even(periods) && is_even(gaps.clone());
        let period_s = (last.as_second() - first.as_second()) / i64::from(CYCLES - 1);
        let gap_s = gaps.max()?;
        let since = self.counted_from()?.as_second() - last.as_second();
        (is_rhythm && since < outlasted(period_s)).then_some(Rhythm { period_s, gap_s })
    }

    /// Counts the readings that are missing in a short gap.
    fn note_lost(&mut self, spacing: SignedDuration) {
        let Some(usual) = self.median().map(|usual| usual.as_secs_f64()) else {
            return;
        };
        let due = (spacing.as_secs_f64() / usual).round().max(1.0);
        if due <= f64::from(MOST_SKIPPED) {
            let keeps = 1.0 - 1.0 / LEARNT_OVER;
            let (lost, of) = self.lost;
            self.lost = (keeps * lost + due - 1.0, keeps * of + due);
        }
    }

    /// How many of its usual readings it may skip: more than [`MAY_SKIP`] where so many are lost one by one that chance makes such a gap.
    fn may_skip(&self, usual: SignedDuration) -> i32 {
        let (lost, of) = self.lost;
        // What so few readings leave open of it counts.
        let share = lost / of;
        let share = share + (share * (1.0 - share).max(0.0) / of).sqrt();
        if of < FEWEST_LEARNT || share <= 0.0 || share >= 1.0 {
            return MAY_SKIP;
        }
        let a_day = SECONDS_PER_DAY / usual.as_secs_f64().max(1.0);
        let skipped = (BY_CHANCE_A_DAY / a_day).ln() / share.ln();
        (MAY_SKIP..MOST_SKIPPED)
            .find(|skip| f64::from(*skip) >= skipped)
            .unwrap_or(MOST_SKIPPED)
    }

    /// For how long it may be silent.
    fn allowed(&self) -> Option<SignedDuration> {
        let in_time = self.allowed_in_time()?;
        Some(self.between_batches().unwrap_or(in_time).max(in_time))
    }

    /// The same where what is measured comes at once.
    fn allowed_in_time(&self) -> Option<SignedDuration> {
        let longest = self.spacings.iter().max().copied();
        let allowed = match longest {
            // Where the next one was due the sensor has shown.
            None => (self.missing.and_then(|after| after.checked_mul(MAY_SKIP)))
                .map_or(FIRST, |allowed| allowed.clamp(A_DAY, FIRST)),
            // Two or three readings say little of how often there are some.
            Some(longest) if self.spacings.len() < 3 => longest.checked_mul(MAY_SKIP)?,
            // The longest gap seen lately is no silence either.
            Some(longest) => {
                let usual = self.median()?;
                usual.checked_mul(self.may_skip(usual))?.max(longest)
            }
        };
        let rhythm = self.rhythm();
        let between = rhythm.map_or(LEAST, |rhythm| {
            SignedDuration::from_secs(outlasted(rhythm.gap_s))
        });
        let apart = self.apart_now().unwrap_or(LEAST);
        Some(allowed.max(LEAST).max(between).max(apart))
    }

    /// For how long it may be silent where it is read more seldom from now on: the two newest readings came after gaps of one length. No longer than
    /// who has given a single reading: two outages may be as long as each other too.
    fn apart_now(&self) -> Option<SignedDuration> {
        let mut newest = self.gaps.iter().rev();
        let ((later, gap), (earlier, before)) = newest.next().zip(newest.next())?;
        let ends = |from: &Timestamp, gap: &SignedDuration| from.as_second() + gap.as_secs();
        // Gaps are kept in whole seconds.
        let is_at = |end: i64, time: Timestamp| (end - time.as_second()).abs() <= 1;
        let is_one_after_the_other =
            is_at(ends(earlier, before), *later) && is_at(ends(later, gap), self.counted_from()?);
        let lengths = [before.as_secs(), gap.as_secs()];
        (is_one_after_the_other && is_even(lengths.into_iter()))
            .then(|| SignedDuration::from_secs(outlasted(gap.as_secs())).min(FIRST))
    }

    /// Ends the silence that there is; the reading before which it began.
    pub(super) fn end(&mut self) -> Option<Timestamp> {
        self.counted_from()
            .filter(|_| std::mem::take(&mut self.silent))
    }

    /// It is silent from now on; the time of the last reading.
    pub(super) fn begins(&mut self) -> Option<Timestamp> {
        self.silent = true;
        self.counted_from()
    }
}

/// Seconds from one burst of readings to the next in the mean, and the most of them without readings.
#[derive(Debug, Clone, Copy)]
struct Rhythm {
    period_s: i64,
    gap_s: i64,
}

/// Half as long again: a burst that has not come by then stays away.
fn outlasted(seconds: i64) -> i64 {
    seconds + seconds / 2
}

/// Whether the longest is at most a quarter longer than the shortest.
fn is_even(spans: impl Iterator<Item = i64> + Clone) -> bool {
    let ends = spans.clone().min().zip(spans.max());
    ends.is_some_and(|(shortest, longest)| 4 * longest <= 5 * shortest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(hours: f64) -> Timestamp {
        let after = SignedDuration::from_secs_f64(3600.0 * hours);
        Timestamp::UNIX_EPOCH + after
    }

    /// After bursts of twenty readings, five minutes apart, that begin at these hours.
    fn after_bursts(begins: &[f64]) -> Silence {
        let mut silence = Silence::default();
        for begin in begins {
            for index in 0..20 {
                silence.broken_by(at(begin + f64::from(index) / 12.0));
            }
        }
        silence
    }

    #[test]
    fn a_sensor_that_gives_one_reading_and_then_none_is_silent_after_a_few_of_its_intervals_or_a_day()
     {
        let mut silence = Silence::default();
        silence.note_missing(at(0.0));
        silence.broken_by(at(0.0));
        assert_eq!(silence.deadline(), Some(at(8.0 * 24.0)));
        silence.note_missing(at(12.0));
        silence.note_missing(at(13.0));
        assert_eq!(silence.deadline(), Some(at(48.0)));
        let mut hourly = Silence::default();
        hourly.broken_by(at(0.0));
        hourly.note_missing(at(1.0));
        assert_eq!(hourly.deadline(), Some(at(25.0)));
    }

    #[test]
    fn between_bursts_at_the_same_time_of_each_day_nothing_is_silent_and_a_burst_that_is_missed_is()
    {
        let few = after_bursts(&[0.0, 24.0, 48.0]);
        assert_eq!(few.deadline(), Some(at(48.0 + 19.0 / 12.0 + 0.5)));
        let days = after_bursts(&[0.0, 24.0, 48.5, 72.0, 96.0]);
        let due = days.deadline().unwrap();
        assert!(at(96.0 + 24.0) < due && due < at(96.0 + 40.0), "{due}");
        // One and more that stay away leave the rhythm known.
        for next in [144.0, 14.0 * 24.0] {
            let days = after_bursts(&[0.0, 24.0, 48.5, 72.0, 96.0, next]);
            let due = days.deadline().unwrap();
            assert!(at(next + 24.0) < due && due < at(next + 40.0), "{due}");
        }
    }

    /// Hourly readings that are uploaded each day at noon, and from the tenth day on at once.
    #[test]
    fn readings_that_come_together_once_a_day_are_no_silence_once_that_is_known() {
        let mut silence = Silence::default();
        let mut silences = Vec::new();
        let mut upload = |silence: &mut Silence, hours: std::ops::Range<u32>, now: f64| {
            if silence.deadline().is_some_and(|due| due <= at(now)) {
                silence.begins();
                silences.push(now / 24.0);
            }
            if silence.is_silent() || silence.comes_in_batches() {
                silence.fall_behind(at(now));
            }
            for hour in hours {
                silence.broken_by(at(f64::from(hour)));
            }
        };
        for day in 1..10 {
            let until = 24 * day;
            upload(&mut silence, until - 24..until, f64::from(until));
        }
        assert!(silence.comes_in_batches());
        let due = silence.deadline().unwrap();
        assert!(at(215.0 + 24.0) < due && due < at(215.0 + 40.0), "{due}");
        for hour in 216..240 {
            upload(&mut silence, hour..hour + 1, f64::from(hour));
        }
        assert!(!silence.comes_in_batches());
        assert!(silence.deadline().unwrap() < at(239.0 + 6.0));
        assert_eq!(silences, [2.0, 3.0, 4.0]);
    }

    #[test]
    fn where_single_readings_are_lost_all_the_time_a_gap_that_chance_makes_is_no_silence() {
        let mut silence = Silence::default();
        let mut state = 1_u32;
        let (mut silences, mut due) = (0, None);
        for index in 0..1440 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            // Three of ten are lost, each ten minutes.
            if state >> 16 < 19_660 {
                continue;
            }
            let time = at(f64::from(index) / 6.0);
            silences += usize::from(due.is_some_and(|due| due <= time) && index > 144);
            silence.broken_by(time);
            due = silence.deadline();
        }
        assert!(silences <= 1, "{silences}");
        let newest = silence.newest().unwrap();
        let hours = due.unwrap().duration_since(newest).as_secs_f64() / 3600.0;
        assert!((1.0..2.1).contains(&hours), "{hours}");
        // Without losses four are missed.
        let whole = after_bursts(&[0.0, 20.0 / 12.0, 40.0 / 12.0, 60.0 / 12.0]);
        let hours = whole
            .deadline()
            .unwrap()
            .duration_since(whole.newest().unwrap());
        assert_eq!(hours, SignedDuration::from_mins(30));
    }

    #[test]
    fn what_waits_for_earlier_readings_is_no_silence_and_does_not_end_one_again_when_its_turn_comes()
     {
        let mut silence = Silence::default();
        for hour in 0..8 {
            silence.broken_by(at(f64::from(hour)));
        }
        assert_eq!(silence.note_waiting(at(13.0), at(13.0)), None);
        assert_eq!(silence.deadline(), Some(at(17.0)));
        assert_eq!(silence.begins(), Some(at(13.0)));
        for hour in 8..14 {
            assert_eq!(silence.broken_by(at(f64::from(hour))), None);
        }
        // One of a backlog ends none.
        assert_eq!(silence.note_waiting(at(20.0), at(40.0)), None);
        assert_eq!(silence.note_waiting(at(39.0), at(40.0)), Some(at(20.0)));
        assert_eq!(silence.deadline(), Some(at(43.0)));
        silence.begins();
        assert_eq!(silence.broken_by(at(44.0)), Some(at(39.0)));
    }

    #[test]
    fn where_it_is_read_more_seldom_from_now_on_two_gaps_of_one_length_are_enough_to_know() {
        let silences = |spacings: &[f64]| {
            let mut silence = after_bursts(&[0.0, 1.7]);
            let (mut newest, mut silences) = (1.7 + 19.0 / 12.0, 0);
            for spacing in spacings {
                newest += spacing;
                if silence.deadline().is_some_and(|due| due <= at(newest)) {
                    silence.begins();
                    silences += 1;
                }
                silence.broken_by(at(newest));
            }
            let due = silence.deadline().unwrap();
            (
                silences,
                due.duration_since(at(newest)).as_secs_f64() / 3600.0,
            )
        };
        let (found, allowed) = silences(&[24.0; 12]);
        assert!(found == 2 && allowed < 100.0, "{found} {allowed}");
        // Times with fractions of a second are no other.
        assert_eq!(silences(&[24.000_1; 12]).0, 2);
        // Two outages of a month, and then silence: a rhythm of months is not waited for.
        assert!(silences(&[720.0, 720.0]).1 <= 8.0 * 24.0);
        // A gap between others of the old kind says nothing, nor do two that are not alike.
        assert!(silences(&[24.0, 0.1, 0.1]).1 < 3.0);
        assert!(silences(&[24.0, 10.0]).1 < 10.0);
    }

    #[test]
    fn gaps_without_a_rhythm_stay_silences_and_so_does_a_gap_long_after_a_rhythm_has_ended() {
        let within_an_hour = |silence: &Silence, newest: f64| {
            let due = silence.deadline().unwrap();
            due < at(newest + 1.0)
        };
        let uneven = after_bursts(&[0.0, 24.0, 30.0, 72.0, 80.0, 130.0]);
        assert!(within_an_hour(&uneven, 130.0 + 19.0 / 12.0));
        let mut ended = after_bursts(&[0.0, 24.0, 48.0, 72.0, 96.0]);
        for index in 0..600 {
            ended.broken_by(at(96.0 + 2.0 + f64::from(index) / 12.0));
        }
        assert!(within_an_hour(&ended, 96.0 + 2.0 + 599.0 / 12.0));
    }
}

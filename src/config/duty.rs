//! `hours` of a hook: when the people whom it notifies are on duty.

use jiff::civil::{DateTime, Time, Weekday};
use jiff::tz::TimeZone;
use jiff::{Timestamp, ToSpan};
use std::time::Duration;

const DAYS: [(&str, Weekday); 7] = [
    ("mon", Weekday::Monday),
    ("tue", Weekday::Tuesday),
    ("wed", Weekday::Wednesday),
    ("thu", Weekday::Thursday),
    ("fri", Weekday::Friday),
    ("sat", Weekday::Saturday),
    ("sun", Weekday::Sunday),
];
/// A shift of one day a week begins within so many days from the one before, which may still last.
const SEARCHED_DAYS: std::ops::RangeInclusive<i64> = -1..=8;
/// Steps in which a week is looked through for hours without anybody on duty.
const STEP_MINUTES: i64 = 15;
const WEEK_MINUTES: i64 = 7 * 24 * 60;

/// Shifts by local time. Outside of them alerts wait.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DutyHours {
    shifts: Vec<Shift>,
    zone: TimeZone,
}

/// One shift on some days of the week. One that ends at or before its beginning ends on the next day.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Shift {
    days: Vec<Weekday>,
    from: Time,
    until: Time,
}

impl DutyHours {
    /// These shifts by UTC.
    pub(super) fn new(shifts: Vec<Shift>) -> Self {
        let zone = TimeZone::UTC;
        Self { shifts, zone }
    }

    /// The same by the local time of `zone`.
    pub(super) fn in_zone(self, zone: TimeZone) -> Self {
        Self { zone, ..self }
    }

    /// How long from `now` until somebody is on duty; zero while somebody is.
    pub fn wait(&self, now: Timestamp) -> Duration {
        let today = now.to_zoned(self.zone.clone()).date();
        let mut next: Option<Timestamp> = None;
        for ahead in SEARCHED_DAYS {
            let Ok(date) = today.checked_add(ahead.days()) else {
                continue;
            };
            for shift in &self.shifts {
                let Some((from, until)) = shift.on(date.at(0, 0, 0, 0)) else {
                    continue;
                };
                let (Some(from), Some(until)) = (self.instant(from), self.instant(until)) else {
                    continue;
                };
                if from <= now && now < until {
                    return Duration::ZERO;
                }
                if from > now {
                    next = Some(next.map_or(from, |before| before.min(from)));
                }
            }
        }
        let wait = next.map(|next| next.duration_since(now));
        wait.and_then(|wait| Duration::try_from(wait).ok())
            .unwrap_or(Duration::ZERO)
    }

    fn instant(&self, local: DateTime) -> Option<Timestamp> {
        let zoned = self.zone.to_ambiguous_zoned(local).compatible().ok()?;
        Some(zoned.timestamp())
    }
}

/// When in a week nobody is on duty by any of these hours, as in `sat 12:00`: the first such quarter of an hour.
pub(super) fn gap(hours: &[&DutyHours]) -> Option<String> {
    // A Monday, and no change of the clock.
    let monday = DateTime::constant(2024, 1, 1, 0, 0, 0, 0);
    let is_on_duty = |at: DateTime| {
        let mut shifts = hours.iter().flat_map(|hours| &hours.shifts);
        shifts.any(|shift| {
            [0, 1].into_iter().any(|ago| {
                let date = at.date().checked_sub(ago.days()).ok();
                let shift = date.and_then(|date| shift.on(date.at(0, 0, 0, 0)));
                shift.is_some_and(|(from, until)| from <= at && at < until)
            })
        })
    };
    let steps = (0..WEEK_MINUTES / STEP_MINUTES).map(|step| step * STEP_MINUTES);
    let times = steps.filter_map(|minutes| monday.checked_add(minutes.minutes()).ok());
    let first = times.into_iter().find(|at| !is_on_duty(*at))?;
    let day = DAYS.iter().find(|(_, day)| *day == first.weekday());
    let name = day.map_or("", |(name, _)| name);
    Some(format!("{name} {:02}:{:02}", first.hour(), first.minute()))
}

impl Shift {
    /// As in `mon-fri 07:00-19:00`, `sat,sun 08:00-12:00` or `22:00-06:00`; `Err` says what to write instead.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let fix = || {
            "write days and local times, as in \"mon-fri 07:00-19:00\", \"sat,sun 08:00-12:00\" or, each day, \
             \"22:00-06:00\""
                .to_owned()
        };
        let text = text.trim();
        let (days, times) = text.rsplit_once(' ').unwrap_or(("", text));
        let (from, until) = times.split_once('-').ok_or_else(fix)?;
        let time = |text: &str| match text {
            "24:00" => Some(Time::midnight()),
            text => text.parse::<Time>().ok(),
        };
        Ok(Self {
            days: weekdays(days.trim()).ok_or_else(fix)?,
            from: time(from).ok_or_else(fix)?,
            until: time(until).ok_or_else(fix)?,
        })
    }

    /// From when until when it lasts that begins on the day of `midnight`; `None` on other days.
    fn on(&self, midnight: DateTime) -> Option<(DateTime, DateTime)> {
        let date = midnight.date();
        if !self.days.contains(&date.weekday()) {
            return None;
        }
        let last = if self.until > self.from {
            date
        } else {
            date.checked_add(1.day()).ok()?
        };
        Some((date.to_datetime(self.from), last.to_datetime(self.until)))
    }
}

/// `mon-fri`, `sat,sun`, `fri-mon`; no text is each day.
fn weekdays(text: &str) -> Option<Vec<Weekday>> {
    if text.is_empty() {
        return Some(DAYS.map(|(_, day)| day).to_vec());
    }
    let place = |name: &str| DAYS.iter().position(|(known, _)| *known == name.trim());
    let mut days = Vec::new();
    for part in text.split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last) = (place(first)?, place(last)?);
        let count = (last + DAYS.len() - first) % DAYS.len();
        days.extend((0..=count).map(|step| DAYS[(first + step) % DAYS.len()].1));
    }
    Some(days)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hours(texts: &[&str], zone: &str) -> DutyHours {
        let shifts = texts.iter().map(|text| Shift::parse(text).unwrap());
        DutyHours::new(shifts.collect()).in_zone(TimeZone::get(zone).unwrap())
    }

    fn minutes(hours: &DutyHours, now: &str) -> u64 {
        hours.wait(now.parse().unwrap()).as_secs() / 60
    }

    #[test]
    fn alerts_wait_for_the_next_shift_by_local_time() {
        let office = hours(&["mon-fri 07:00-19:00", "sat 08:00-12:00"], "Europe/Rome");
        // 2024-07-05 is a Friday, two hours ahead of UTC.
        assert_eq!(minutes(&office, "2024-07-05T05:00:00Z"), 0);
        assert_eq!(minutes(&office, "2024-07-05T16:59:00Z"), 0);
        assert_eq!(minutes(&office, "2024-07-05T17:00:00Z"), 13 * 60);
        assert_eq!(minutes(&office, "2024-07-06T10:00:00Z"), 43 * 60);
        // The night in which the clock is put forward is an hour shorter.
        assert_eq!(minutes(&office, "2024-03-30T11:00:00Z"), 42 * 60);
    }

    #[test]
    fn a_shift_may_last_over_midnight_and_a_whole_day() {
        let night = hours(&["sun 22:00-06:00"], "UTC");
        // 2024-07-08 is a Monday.
        assert_eq!(minutes(&night, "2024-07-08T05:59:00Z"), 0);
        assert_eq!(minutes(&night, "2024-07-08T06:00:00Z"), (6 * 24 + 16) * 60);
        let ever = hours(&["00:00-24:00"], "UTC");
        assert_eq!(minutes(&ever, "2024-07-08T23:59:59Z"), 0);
    }

    #[test]
    fn the_first_hour_of_the_week_without_anybody_is_named() {
        let days = hours(&["07:00-19:00"], "UTC");
        let nights = hours(&["19:00-07:00"], "UTC");
        assert_eq!(gap(&[&days]).as_deref(), Some("mon 00:00"));
        assert_eq!(gap(&[&days, &nights]), None);
        let weekdays = hours(&["mon-thu 19:00-07:00", "sun 19:00-07:00"], "UTC");
        assert_eq!(gap(&[&days, &weekdays]).as_deref(), Some("fri 19:00"));
    }

    #[test]
    fn what_is_no_shift_says_what_to_write() {
        for text in [
            "",
            "7-19",
            "mon 07:00",
            "monday 07:00-19:00",
            "07:00-25:00",
            "mon-fri",
        ] {
            let said = Shift::parse(text).unwrap_err();
            assert!(said.contains("mon-fri 07:00-19:00"), "{text:?}: {said}");
        }
    }
}

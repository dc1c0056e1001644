//! Ticks at round dates.

use super::width_of;
use jiff::civil::{Date, date};

/// From one tick to the next.
#[derive(Debug, Clone, Copy)]
enum CalendarStep {
    Minutes(i16),
    Days(i16),
    Months(i16),
}

/// From fine to coarse; the last one serves whatever is longer.
const STEPS: [CalendarStep; 22] = [
    CalendarStep::Minutes(1),
    CalendarStep::Minutes(5),
    CalendarStep::Minutes(15),
    CalendarStep::Minutes(30),
    CalendarStep::Minutes(60),
    CalendarStep::Minutes(180),
    CalendarStep::Minutes(360),
    CalendarStep::Minutes(720),
    CalendarStep::Days(1),
    CalendarStep::Days(2),
    CalendarStep::Days(5),
    CalendarStep::Days(10),
    CalendarStep::Months(1),
    CalendarStep::Months(2),
    CalendarStep::Months(3),
    CalendarStep::Months(6),
    CalendarStep::Months(12),
    CalendarStep::Months(24),
    CalendarStep::Months(60),
    CalendarStep::Months(120),
    CalendarStep::Months(240),
    CalendarStep::Months(1200),
];
const MINUTES_PER_DAY: f64 = 1440.0;
/// The mean.
const DAYS_PER_MONTH: f64 = 30.44;
/// Room between two labels, in the sheet's units.
const GAP: f64 = 18.0;
/// No sheet holds more labels.
const MOST_LABELS: i32 = 60;

/// Ticks between two days since 1970-01-01, on an axis of `length` units of the sheet.
pub(super) fn ticks(from: f64, to: f64, length: f64) -> Vec<(f64, String)> {
    if !(from.is_finite() && to.is_finite() && to > from) {
        return Vec::new();
    }
    let fits = |step: &&CalendarStep| {
        let count = (to - from) / step.days();
        count * (width_of(step.sample()) + GAP) <= length
    };
    let step = *STEPS.iter().find(fits).unwrap_or(&STEPS[STEPS.len() - 1]);
    step.ticks(from, to)
}

impl CalendarStep {
    fn days(self) -> f64 {
        match self {
            Self::Minutes(count) => f64::from(count) / MINUTES_PER_DAY,
            Self::Days(count) => f64::from(count),
            Self::Months(count) => f64::from(count) * DAYS_PER_MONTH,
        }
    }

    /// A label as wide as any.
    fn sample(self) -> &'static str {
        match self {
            Self::Minutes(_) => "00-00 00:00",
            Self::Days(_) => "0000-00-00",
            Self::Months(count) if count % 12 == 0 => "0000",
            Self::Months(_) => "0000-00",
        }
    }

    fn ticks(self, from: f64, to: f64) -> Vec<(f64, String)> {
        let numbered = (0..MOST_LABELS).map(f64::from);
        match self {
            Self::Minutes(_) | Self::Days(_) => {
                let step = self.days();
                let first = (from / step - 1e-9).ceil();
                let days = numbered.map(|index| (first + index) * step);
                days.take_while(|day| *day <= to)
                    .filter_map(|day| Some((day, self.label(day)?)))
                    .collect()
            }
            Self::Months(count) => {
                let month = f64::from(count);
                // Days to months and back, a month early: what lies before `from` goes again.
                let first = (from / DAYS_PER_MONTH / month).floor() - 1.0;
                let months = numbered.map(|index| (first + index) * month);
                let ticks = months.filter_map(|months| {
                    let (date, day) = month_after_1970(months)?;
                    Some((day, date.strftime(self.format()).to_string()))
                });
                ticks.filter(|tick| (from..=to).contains(&tick.0)).collect()
            }
        }
    }

    fn format(self) -> &'static str {
        match self {
            Self::Minutes(_) => "%m-%d %H:%M",
            Self::Days(_) => "%Y-%m-%d",
            Self::Months(count) if count % 12 == 0 => "%Y",
            Self::Months(_) => "%Y-%m",
        }
    }

    fn label(self, day: f64) -> Option<String> {
        let minutes = whole((day * MINUTES_PER_DAY).round())?;
        let time = EPOCH.at(0, 0, 0, 0);
        let time = time.checked_add(jiff::SignedDuration::from_mins(minutes));
        Some(time.ok()?.strftime(self.format()).to_string())
    }
}

/// From which months and minutes are counted.
const EPOCH: Date = date(1970, 1, 1);

/// The first day of the month that is so many months after January 1970, and its day since then.
fn month_after_1970(months: f64) -> Option<(Date, f64)> {
    let months = whole(months)?;
    let year = i16::try_from(1970 + months.div_euclid(12)).ok()?;
    let month = i8::try_from(1 + months.rem_euclid(12)).ok()?;
    let first = Date::new(year, month, 1).ok()?;
    Some((first, f64::from(first.since(EPOCH).ok()?.get_days())))
}

fn whole(value: f64) -> Option<i64> {
    #[expect(clippy::cast_possible_truncation, reason = "bounded just above")]
    (value.abs() < 1e12).then_some(value as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(from: f64, to: f64, length: f64) -> Vec<String> {
        ticks(from, to, length)
            .into_iter()
            .map(|tick| tick.1)
            .collect()
    }

    #[test]
    fn ticks_stand_at_round_dates() {
        // 2017-05-20 is day 17306.
        let (start, of_400_days) = (17306.0, 17706.0);
        let months = labels(start, of_400_days, 500.0);
        assert_eq!(months[..2], ["2017-07", "2017-09"]);
        let years = labels(start, start + 8000.0, 500.0);
        assert_eq!((years[0].as_str(), years[1].as_str()), ("2018", "2020"));
        let days = labels(start, start + 12.0, 500.0);
        assert_eq!(days[0], "2017-05-24");
        let hours = labels(start + 0.26, start + 1.4, 500.0);
        assert_eq!(hours[0], "05-20 12:00");
        assert!(labels(start, start, 500.0).is_empty());
    }

    #[test]
    fn the_first_of_a_month_stands_at_its_day() {
        let ticks = ticks(17306.0, 17400.0, 400.0);
        assert_eq!(ticks[0], (17318.0, "2017-06".to_owned()));
    }

    #[test]
    fn labels_do_not_meet_however_long_the_axis() {
        for power in -2..6 {
            let span = 10_f64.powi(power);
            for length in [150.0, 400.0, 900.0] {
                let ticks = ticks(-3000.0, -3000.0 + span, length);
                for pair in ticks.windows(2) {
                    let apart = (pair[1].0 - pair[0].0) / span * length;
                    assert!(apart > width_of(&pair[0].1), "{span} {length} {pair:?}");
                }
            }
        }
    }
}

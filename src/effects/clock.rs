//! The clock of a known load: by it the law under that load is the law under a constant one.

use crate::fit::{Observation, Observations};
use crate::reading::Quantity;

/// Between readings the clock is set this often over the record at least.
const TICKS: f64 = 1500.0;

/// A clock that runs at the pace of the load.
#[derive(Debug)]
pub(super) struct Clock {
    /// Days by the calendar, increasing.
    days: Vec<f64>,
    /// The log-load then.
    log_load: Vec<f64>,
    /// Days by this clock, 0 at the first.
    own: Vec<f64>,
}

impl Clock {
    /// The pace leaves e^-7 to e^7 by a covariate's fault, not by any load. The storm on Century's prism 40-1938 is fitted as e^7 over the mean.
    const FARTHEST_LOAD: f64 = 7.0;

    /// `usual` is the log-load under which it keeps pace with the calendar.
    pub(super) fn new(days: Vec<f64>, log_load: Vec<f64>, usual: f64) -> Self {
        let pace = |f: f64| {
            (f - usual)
                .clamp(-Self::FARTHEST_LOAD, Self::FARTHEST_LOAD)
                .exp()
        };
        let mut own = Vec::with_capacity(days.len());
        let mut sum = 0.0;
        for (k, day) in days.iter().enumerate() {
            if k > 0 {
                let mean = f64::midpoint(pace(log_load[k - 1]), pace(log_load[k]));
                sum += (day - days[k - 1]) * mean;
            }
            own.push(sum);
        }
        Self {
            days,
            log_load,
            own,
        }
    }

    /// Its time at a day within its range.
    pub(super) fn at(&self, day: f64) -> f64 {
        let k = self.days.partition_point(|known| *known < day);
        let k = k.clamp(1, self.days.len().max(2) - 1);
        let (Some(d), Some(t)) = (self.days.get(k - 1..=k), self.own.get(k - 1..=k)) else {
            return day;
        };
        t[0] + (t[1] - t[0]) * (day - d[0]) / (d[1] - d[0]).max(1e-12)
    }

    /// The day by the calendar when it stands at `own`.
    pub(super) fn day(&self, own: f64) -> f64 {
        let k = self.own.partition_point(|known| *known < own);
        let last = self.days.len().saturating_sub(1);
        self.days.get(k.min(last)).copied().unwrap_or(own)
    }

    /// Its mean pace from one day to another, or at the instant.
    fn pace(&self, from: f64, until: f64) -> f64 {
        let from = from.min(until - 1e-6);
        ((self.at(until) - self.at(from)) / (until - from)).max(1e-6)
    }

    /// ln of its mean pace.
    pub(super) fn usual(&self) -> f64 {
        let (Some(first), Some(last)) = (self.days.first(), self.days.last()) else {
            return 0.0;
        };
        let mean = self.own.last().copied().unwrap_or(0.0) / (last - first);
        if mean.is_finite() && mean > 0.0 {
            mean.ln()
        } else {
            0.0
        }
    }

    /// The log-load at its ticks.
    pub(super) fn log_load(&self) -> &[f64] {
        &self.log_load
    }

    /// Readings by this clock, without what is no motion of the ground: `in_reading`, one for each.
    pub(super) fn readings(&self, observations: &Observations, in_reading: &[f64]) -> Observations {
        let span = observations.averaging_days;
        let value = |(one, apart): (&Observation, f64)| {
            let pace = match observations.quantity {
                Quantity::Displacement => 1.0,
                Quantity::Velocity => self.pace(one.t_days - span, one.t_days),
            };
            Observation {
                t_days: self.at(one.t_days),
                value: (one.value - apart) / pace,
                sigma: one.sigma.map(|sigma| sigma / pace),
            }
        };
        let in_reading = in_reading.iter().copied().chain(std::iter::repeat(0.0));
        let values = observations.values.iter().zip(in_reading);
        Observations {
            values: values.map(value).collect(),
            ..*observations
        }
    }

    /// Every reading's time, and times between them where they are far apart.
    pub(super) fn ticks(observations: &Observations) -> Vec<f64> {
        let values = &observations.values;
        let (Some(first), Some(last)) = (values.first(), values.last()) else {
            return Vec::new();
        };
        let step = (last.t_days - first.t_days) / TICKS;
        let mut days = vec![first.t_days - observations.averaging_days.max(step)];
        for value in values {
            let before = days.last().copied().unwrap_or(value.t_days);
            let parts = ((value.t_days - before) / step.max(1e-9)).ceil().max(1.0);
            let mut part = 1.0;
            while part < parts {
                days.push(before + (value.t_days - before) * part / parts);
                part += 1.0;
            }
            days.push(value.t_days);
        }
        days
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_under_a_steady_load_keeps_the_calendars_pace_once_that_load_is_the_usual_one() {
        let days: Vec<f64> = (0..10).map(f64::from).collect();
        let clock = Clock::new(days.clone(), vec![0.7; 10], 0.0);
        assert!((clock.usual() - 0.7).abs() < 1e-12);
        let clock = Clock::new(days, vec![0.7; 10], clock.usual());
        assert!((clock.at(6.5) - 6.5).abs() < 1e-12);
        assert!((clock.pace(2.0, 7.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_step_of_the_load_by_ln_two_doubles_the_pace_after_it() {
        let days: Vec<f64> = (0..=200).map(|k| 0.1 * f64::from(k)).collect();
        let step = |day: &f64| if *day < 10.0 { 0.0 } else { 2.0_f64.ln() };
        let log_load = days.iter().map(step).collect();
        let clock = Clock::new(days, log_load, 0.0);
        let ratio = clock.pace(12.0, 18.0) / clock.pace(2.0, 8.0);
        assert!((ratio - 2.0).abs() < 1e-9, "{ratio}");
    }
}

//! One forecast under a known load, for the monitor and for an explanation: the readings by the load's clock.
//!
//! Under a known log-load f the law reads v = v_i e^f / y, dy/dt = a y^p - b e^f. In the time of a clock that runs
//! at the pace e^f it is the law under a constant load, exactly so where a = 0 (the inverse-velocity line; else
//! the contacts age by the calendar, which the undeclared load of the forecast is left to make up for). So the
//! readings are given that clock's times, forecast as ever, and the forecast is brought back to the calendar.

use super::clock::Clock;
use super::known_load::KnownLoad;
use crate::fit::Observations;
use crate::forecast::Outlook;
use crate::reading::{Channel, Quantity, Timestamp, instant_after_days};

/// A load that is higher than this over the usual one does not stay, e-folds: it is a storm.
const HIGHEST_TO_STAY: f64 = 4.0;
/// While the clock all but stands, one displacement is enough for each such share of the mean spacing: of many at one of its
/// times a forecast makes velocities that are all noise. Of 0 and .5 (docs/adoption.md).
const LEAST_APART: f64 = 0.5;

/// Readings by the clock of a known load.
#[derive(Debug)]
pub struct ByClock {
    clock: Clock,
    readings: Observations,
    usual: f64,
    newest_days: f64,
}

impl ByClock {
    /// `observations` count their days from `epoch`. `usual` is the log-load that counts as none; `None`: that of
    /// their own mean pace. No readings have no clock.
    pub fn new(
        observations: &Observations,
        epoch: Timestamp,
        channels: &[&Channel],
        load: &KnownLoad,
        usual: Option<f64>,
    ) -> Option<Self> {
        let newest_days = observations.values.last()?.t_days;
        let days = Clock::ticks(observations);
        let times: Vec<Timestamp> = days
            .iter()
            .filter_map(|t| instant_after_days(epoch, *t))
            .collect();
        let log_load = load.log_load(channels, &times);
        let usual =
            usual.unwrap_or_else(|| Clock::new(days.clone(), log_load.clone(), 0.0).usual());
        let clock = Clock::new(days, log_load, usual);
        let read = observations.values.iter();
        let read: Vec<Timestamp> = read
            .filter_map(|value| instant_after_days(epoch, value.t_days))
            .collect();
        let readings = clock.readings(observations, &load.in_reading(channels, &read));
        let readings = thinned(readings);
        Some(Self {
            clock,
            readings,
            usual,
            newest_days,
        })
    }

    /// The readings by this clock, without what in them is no motion.
    pub fn readings(&self) -> &Observations {
        &self.readings
    }

    /// The log-load that counts as none.
    pub fn usual(&self) -> f64 {
        self.usual
    }

    /// The log-load over the usual one, as often as the clock was set.
    pub fn above_usual(&self) -> impl Iterator<Item = f64> {
        self.clock.log_load().iter().map(|f| f - self.usual)
    }

    /// The same at the newest reading.
    pub fn now(&self) -> Option<f64> {
        self.clock.log_load().last().map(|f| f - self.usual)
    }

    /// The day by the calendar when the clock stands at `day`.
    pub fn calendar_day(&self, day: f64) -> f64 {
        self.clock.day(day)
    }

    /// What `forecast` gives of these readings and of a critical velocity, brought back to the calendar. A load that is
    /// high now may stay, and one that is low may be gone tomorrow: the slope is run on at the higher of the present
    /// pace and the usual one.
    pub fn outlook(
        &self,
        critical: f64,
        forecast: impl FnOnce(&Observations, f64) -> Option<Outlook>,
    ) -> Option<Outlook> {
        let pace = self.now()?.clamp(0.0, HIGHEST_TO_STAY).exp();
        let outlook = forecast(&self.readings, critical / pace)?;
        Some(Outlook {
            now_days: self.newest_days,
            ..outlook.sooner(pace)
        })
    }
}

/// Displacements that stand apart by this clock, the newest among them.
fn thinned(mut readings: Observations) -> Observations {
    let values = &mut readings.values;
    let (Some(first), Some(last)) = (values.first(), values.last()) else {
        return readings;
    };
    if readings.quantity == Quantity::Velocity {
        return readings;
    }
    let (newest, mut kept) = (last.t_days, f64::NEG_INFINITY);
    let least = LEAST_APART * (newest - first.t_days) / values.len() as f64;
    let newest_place = values.len() - 1;
    let mut place = 0;
    values.retain(|value| {
        let is_kept = value.t_days - kept >= least || place == newest_place;
        place += 1;
        if is_kept {
            kept = value.t_days;
        }
        is_kept
    });
    readings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Observation;

    #[test]
    fn displacements_at_one_time_of_the_clock_are_thinned_and_the_newest_stays() {
        let at = |t_days: f64| Observation {
            t_days,
            value: t_days,
            sigma: None,
        };
        let days = [0.0, 1.0, 1.001, 1.002, 2.0, 3.0, 4.0, 4.0001];
        let readings = |quantity| Observations {
            quantity,
            averaging_days: 0.0,
            values: days.map(at).to_vec(),
        };
        let kept = thinned(readings(Quantity::Displacement)).values;
        let kept: Vec<f64> = kept.iter().map(|value| value.t_days).collect();
        assert_eq!(kept, [0.0, 1.0, 2.0, 3.0, 4.0, 4.0001]);
        assert_eq!(
            thinned(readings(Quantity::Velocity)).values.len(),
            days.len()
        );
    }
}

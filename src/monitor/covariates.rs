//! The covariates of a site as the searches and the laws under known loads see them, bounded by count.

use crate::effects::{MOST_SAMPLES, is_code};
use crate::reading::{Channel, CovariateKind, RunningTotal, Sample, Timestamp};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Parts of the time are made half as long so often, while samples lie in few enough of them.
const HALVINGS: u8 = 40;
/// Channels kept; a site that names more has a column for each of something else.
const MOST_CHANNELS: usize = 64;

/// What lies beside the readings.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Covariates {
    channels: BTreeMap<String, Channel>,
}

impl Covariates {
    /// Takes one value of what the config states to be `stated`, wherever in time it belongs; of two for one time the later to
    /// arrive stands.
    pub(super) fn take(
        &mut self,
        (name, unit): (&str, Option<&str>),
        stated: Option<CovariateKind>,
        sample: Sample,
    ) {
        if !self.channels.contains_key(name) && self.channels.len() >= MOST_CHANNELS {
            return;
        }
        let channel = self
            .channels
            .entry(name.to_owned())
            .or_insert_with(|| Channel {
                name: name.to_owned(),
                unit: unit.map(str::to_owned),
                stated,
                samples: Vec::new(),
            });
        let samples = &mut channel.samples;
        let at = samples.partition_point(|old| old.time < sample.time);
        match samples.get_mut(at) {
            Some(old) if old.time == sample.time => *old = sample,
            Some(_) | None => samples.insert(at, sample),
        }
        if samples.len() > MOST_SAMPLES {
            thin(channel);
        }
    }

    /// The config states from here on what these measure, and of the others nothing.
    pub(super) fn state(&mut self, kinds: &BTreeMap<String, CovariateKind>) {
        for (name, channel) in &mut self.channels {
            channel.stated = kinds.get(name).copied();
        }
    }

    /// All of them, by name.
    pub(super) fn list(&self) -> Vec<&Channel> {
        self.channels.values().collect()
    }

    /// The `most` that cover the time from `first` to `last` best, by name.
    pub(super) fn beside(&self, first: Timestamp, last: Timestamp, most: usize) -> Vec<Channel> {
        let covered = |channel: &Channel| {
            let [from, .., until] = channel.samples.as_slice() else {
                return 0.0;
            };
            let (from, until) = (from.time.max(first), until.time.min(last));
            until.duration_since(from).as_secs_f64().max(0.0)
        };
        let mut best: Vec<&Channel> = self.channels.values().collect();
        best.sort_by(|a, b| covered(b).total_cmp(&covered(a)));
        best.truncate(most);
        best.sort_by(|a, b| a.name.cmp(&b.name));
        best.into_iter().cloned().collect()
    }
}

/// Makes one of all samples within each part of the time, of which half as many as may be kept hold any: of amounts, as of
/// rain, their sum, which came until the last of them; of a running total its last value; of all else the mean, a logger's code left out where
/// there is more. Evenly over the whole record, or the older ones would seem to be far apart; and a power of two of seconds long, or they would
/// be once more parts have been made of parts. What stands alone, as under a wrong date, takes one part.
fn thin(channel: &mut Channel) {
    let samples = &channel.samples;
    let Some((first, last)) = samples.first().zip(samples.last()) else {
        return;
    };
    let span = last.time.duration_since(first.time).as_secs_f64();
    let longest = (span / (MOST_SAMPLES / 2) as f64).log2().ceil();
    let parts = (0..HALVINGS).map(|halved| Parts((longest - f64::from(halved)).exp2()));
    let few = parts.take_while(|parts| parts.of(samples).count() <= MOST_SAMPLES / 2);
    let Some(parts) = few.last() else {
        return;
    };
    let is_rain = channel.kind() == CovariateKind::Rain;
    let is_running = is_rain && is_running_total(samples);
    let merged = parts.of(samples).filter_map(|part| {
        let (first, last) = (part.first()?, part.last()?);
        let mut measured = part.iter().filter(|one| !is_code(one.value));
        if is_running {
            return measured.next_back().or(Some(last)).copied();
        }
        let values = measured.map(|one| one.value);
        let (count, sum) = values.fold((0.0, 0.0), |(n, sum), one| (n + 1.0, sum + one));
        if count == 0.0 {
            return Some(*last);
        }
        if is_rain {
            return Some(Sample {
                value: sum,
                ..*last
            });
        }
        let half = last.time.duration_since(first.time) / 2;
        Some(Sample {
            time: first.time.checked_add(half).unwrap_or(last.time),
            value: sum / count,
        })
    });
    channel.samples = merged.collect();
}

/// Parts of the time, so many seconds long.
struct Parts(f64);

impl Parts {
    fn of<'a>(&self, samples: &'a [Sample]) -> impl Iterator<Item = &'a [Sample]> {
        let seconds = self.0;
        let place = move |sample: &Sample| {
            let since = sample.time.duration_since(Timestamp::UNIX_EPOCH);
            (since.as_secs_f64() / seconds).floor()
        };
        samples.chunk_by(move |one, next| place(one).total_cmp(&place(next)).is_eq())
    }
}

/// Whether rain is given as a running total, codes left out.
fn is_running_total(samples: &[Sample]) -> bool {
    let values = samples.iter().map(|one| one.value);
    let measured = values.filter(|value| *value >= 0.0 && !is_code(*value));
    RunningTotal::is_one_or_stands(&measured.collect::<Vec<f64>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(second: i64, value: f64) -> Sample {
        Sample {
            time: Timestamp::from_second(second).unwrap(),
            value,
        }
    }

    /// Ten years of hourly values of a channel of that name.
    fn ten_years(name: &str, value: impl Fn(i64) -> f64) -> Channel {
        let mut covariates = Covariates::default();
        for hour in 0..87_660 {
            covariates.take((name, Some("mm")), None, sample(3600 * hour, value(hour)));
        }
        covariates.list()[0].clone()
    }

    #[test]
    fn ten_years_of_hourly_rain_stay_bounded_and_lose_none_of_it() {
        let showers = |hour: i64| f64::from(u8::from(hour % 31 < 3));
        let rain = ten_years("rain_mm", showers);
        let samples = &rain.samples;
        assert!(samples.len() <= MOST_SAMPLES, "{}", samples.len());
        let fell: f64 = (0..87_660).map(showers).sum();
        let kept: f64 = samples.iter().map(|one| one.value).sum();
        assert!((kept - fell).abs() < 1e-6, "{kept} of {fell}");
        let earlier = samples
            .iter()
            .filter(|one| one.time < sample(3600 * 43_830, 0.0).time);
        let earlier: f64 = earlier.map(|one| one.value).sum();
        assert!((earlier / fell - 0.5).abs() < 0.01, "{earlier} of {fell}");
        // A search, which keeps so many of a whole record, calls eight times as far apart a gap.
        let even = 87_660.0 * 3600.0 / MOST_SAMPLES as f64;
        let apart = |pair: &[Sample]| pair[1].time.duration_since(pair[0].time).as_secs_f64();
        let longest = samples.windows(2).map(apart).fold(0.0, f64::max);
        assert!(longest < 5.0 * even, "{longest} of {even}");
    }

    #[test]
    fn ten_years_of_a_level_keep_their_mean_and_no_code_is_averaged_into_them() {
        let lake = ten_years("lake_level_m", |hour| {
            if hour % 1000 == 7 {
                -9999.0
            } else {
                400.0 + f64::from(u8::from(hour % 2 == 0))
            }
        });
        let far = |one: &&Sample| !(399.9..=401.1).contains(&one.value);
        // A code that stands alone among the newest stays what it is.
        assert!(
            lake.samples
                .iter()
                .filter(far)
                .all(|one| is_code(one.value))
        );
        assert_eq!(
            lake.samples.last().unwrap().time,
            sample(3600 * 87_659, 0.0).time
        );
    }

    #[test]
    fn a_running_total_with_a_code_or_in_a_dry_spell_stays_one() {
        let with_a_code = |hour: i64| {
            if hour == 500 {
                -9999.0
            } else {
                (hour / 100) as f64
            }
        };
        let in_a_drought = |hour: i64| 812.4 + f64::from(u8::from(hour > 60_000));
        for (total, last) in [
            (ten_years("rain_mm", with_a_code), 876.0),
            (ten_years("rain_mm", in_a_drought), 813.4),
        ] {
            let samples = total.samples.iter().filter(|one| !is_code(one.value));
            let highest = samples.map(|one| one.value).fold(0.0, f64::max);
            assert!((highest - last).abs() < 1e-9, "{highest} of {last}");
        }
    }

    #[test]
    fn a_sample_of_a_wrong_date_takes_one_part_and_no_more() {
        let mut covariates = Covariates::default();
        covariates.take(("lake_m", None), None, sample(0, 1.0));
        for hour in 400_000..420_000 {
            covariates.take(("lake_m", None), None, sample(3600 * hour, 1.0));
        }
        assert!(covariates.list()[0].samples.len() > MOST_SAMPLES / 8);
    }

    #[test]
    fn ten_years_of_a_running_total_stay_one() {
        let total = ten_years("rain_mm", |hour| (hour % 8766) as f64);
        let values: Vec<f64> = total.samples.iter().map(|one| one.value).collect();
        let running = RunningTotal::of(&values).expect("a running total");
        assert_eq!(running.set_back.len(), 9);
    }

    #[test]
    fn what_comes_late_finds_its_place_and_a_correction_stands() {
        let mut covariates = Covariates::default();
        for (second, value) in [(1, 1.0), (3, 3.0), (2, 2.0), (3, 9.0)] {
            covariates.take(("a", None), None, sample(second, value));
        }
        let expected = [sample(1, 1.0), sample(2, 2.0), sample(3, 9.0)];
        assert_eq!(covariates.list()[0].samples, expected);
    }

    #[test]
    fn the_channels_that_cover_the_readings_go_first() {
        let mut covariates = Covariates::default();
        for second in 0..10 {
            covariates.take(("short", None), None, sample(second, 0.0));
            covariates.take(("long", None), None, sample(10 * second, 0.0));
        }
        let (first, last) = (sample(0, 0.0).time, sample(90, 0.0).time);
        let beside = covariates.beside(first, last, 1);
        assert_eq!(beside[0].name, "long");
    }

    #[test]
    fn a_search_is_given_what_the_config_states_when_it_begins() {
        let mut covariates = Covariates::default();
        let rain = Some(CovariateKind::Rain);
        for second in 0..10 {
            covariates.take(("Nied.", None), rain, sample(second, 0.0));
        }
        let kind = |covariates: &Covariates| {
            let (first, last) = (sample(0, 0.0).time, sample(9, 0.0).time);
            covariates.beside(first, last, 1)[0].kind()
        };
        assert_eq!(kind(&covariates), CovariateKind::Rain);
        covariates.state(&BTreeMap::new());
        assert_eq!(kind(&covariates), CovariateKind::Other);
        covariates.state(&BTreeMap::from([(
            "Nied.".to_owned(),
            CovariateKind::Level,
        )]));
        assert_eq!(kind(&covariates), CovariateKind::Level);
    }
}

//! The covariates of a site as the searches and the laws under known loads see them, bounded by count.

use crate::reading::{Channel, CovariateKind, Sample, Timestamp};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Samples kept of one channel.
const MOST_SAMPLES: usize = 4096;
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
            thin(samples);
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

/// Makes one of every two samples of the older half: their mean, so that no rain is lost.
fn thin(samples: &mut Vec<Sample>) {
    let older = samples.len() / 4 * 2;
    let mean = |pair: &[Sample]| {
        let [earlier, later] = pair else {
            return pair[0];
        };
        let half = later.time.duration_since(earlier.time) / 2;
        Sample {
            time: earlier.time.checked_add(half).unwrap_or(later.time),
            value: f64::midpoint(earlier.value, later.value),
        }
    };
    let merged: Vec<Sample> = samples[..older].chunks(2).map(mean).collect();
    samples.splice(..older, merged);
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

    #[test]
    fn ever_so_many_samples_stay_bounded_and_keep_their_mean_and_their_newest() {
        let mut covariates = Covariates::default();
        for second in 0..20_000 {
            let value = f64::from(u8::from(second % 2 == 0));
            covariates.take(("rain_mm", Some("mm")), None, sample(second, value));
        }
        let channel = covariates.list()[0];
        assert!(channel.samples.len() <= MOST_SAMPLES);
        assert_eq!(channel.samples.last(), Some(&sample(19_999, 0.0)));
        let first = channel.samples[0];
        assert!((first.value - 0.5).abs() < 0.01, "{first:?}");
        assert!(channel.samples.windows(2).all(|w| w[0].time < w[1].time));
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

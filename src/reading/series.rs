//! A benchmark's readings and the covariates beside them, in time order.

use super::{BenchmarkId, CovariateKind, Quantity, TimeSpan, Timestamp, Unit};
use jiff::SignedDuration;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// One reading of one benchmark, in the unit of its series.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// When it was measured.
    pub time: Timestamp,
    /// The value, finite, in the unit of its series.
    pub value: f64,
    /// Its standard error, positive, in the same unit, where the source gives one.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub sigma: Option<f64>,
}

impl Reading {
    /// Whether its numbers are such as may enter or leave: finite, the standard error positive.
    pub fn is_sound(&self) -> bool {
        let positive = |sigma: f64| sigma.is_finite() && sigma > 0.0;
        self.value.is_finite() && self.sigma.is_none_or(positive)
    }
}

/// All readings of one quantity of one benchmark.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Whose readings.
    pub benchmark: BenchmarkId,
    /// Their unit, which also says the quantity.
    pub unit: Unit,
    /// For velocities: the span before the time stamp over which each is the mean.
    pub averaging: Option<SignedDuration>,
    /// The readings, in strictly increasing time.
    pub readings: Vec<Reading>,
}

impl Series {
    /// From the first reading to the last; `None` without any.
    pub fn span(&self) -> Option<TimeSpan> {
        let (first, last) = (self.readings.first()?, self.readings.last()?);
        Some(TimeSpan::new(first.time, last.time))
    }

    /// Displacement or velocity.
    pub fn quantity(&self) -> Quantity {
        self.unit.quantity()
    }

    /// Puts rows that stand in order of arrival into strictly increasing time: an exact repeat is
    /// dropped, and of two values for one time the later to arrive stands.
    pub fn put_in_order(&mut self) -> Disorder {
        settle_rows(&mut self.readings, |reading| reading.time)
    }
}

/// One value of a covariate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// When it was measured.
    pub time: Timestamp,
    /// The value, finite, in the unit of its channel.
    pub value: f64,
}

/// A covariate: rain, a reservoir level, a river's flow, a temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// The full column name, unit included: `lake_level_m`.
    pub name: String,
    /// The unit at the name's end, where it is one that is known.
    pub unit: Option<String>,
    /// What it measures, where the config or a flag states it; see [`Channel::kind`].
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub stated: Option<CovariateKind>,
    /// The values, in strictly increasing time.
    pub samples: Vec<Sample>,
}

impl Channel {
    /// What it measures: as it is stated, or else as its unit and its name say.
    pub fn kind(&self) -> CovariateKind {
        CovariateKind::stated_or_of(self.stated, &self.name, self.unit.as_deref())
    }

    /// Puts rows in order as [`Series::put_in_order`] does.
    pub fn put_in_order(&mut self) -> Disorder {
        settle_rows(&mut self.samples, |sample| sample.time)
    }
}

/// What putting rows in order met.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, JsonSchema, Serialize)]
pub struct Disorder {
    /// Rows that repeated an earlier row exactly.
    pub repeated: usize,
    /// Rows that gave another value for a time already read; the later row stands.
    pub corrected: usize,
    /// Rows that stood before an earlier time.
    pub out_of_order: usize,
    /// Readings that were a mark for no value, such as NAN; they are left out.
    pub missing: usize,
    /// Files that have no end: read as far as they go.
    pub unended: usize,
}

impl AddAssign for Disorder {
    fn add_assign(&mut self, other: Self) {
        self.repeated += other.repeated;
        self.corrected += other.corrected;
        self.out_of_order += other.out_of_order;
        self.missing += other.missing;
        self.unended += other.unended;
    }
}

fn settle_rows<T: Copy + PartialEq>(rows: &mut Vec<T>, time: impl Fn(&T) -> Timestamp) -> Disorder {
    let mut disorder = Disorder::default();
    let mut latest = Timestamp::MIN;
    for row in rows.iter() {
        disorder.out_of_order += usize::from(time(row) < latest);
        latest = latest.max(time(row));
    }
    // Stable, so that rows of one time keep their order of arrival.
    rows.sort_by_key(|row| time(row));
    rows.dedup_by(|later, kept| {
        if time(later) != time(kept) {
            return false;
        }
        if later == kept {
            disorder.repeated += 1;
        } else {
            disorder.corrected += 1;
            *kept = *later;
        }
        true
    });
    disorder
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(rows: &[(i64, f64)]) -> Series {
        let readings = rows
            .iter()
            .map(|&(second, value)| Reading {
                time: Timestamp::from_second(second).unwrap(),
                value,
                sigma: None,
            })
            .collect();
        Series {
            benchmark: BenchmarkId::new("a"),
            unit: Unit::MM,
            averaging: None,
            readings,
        }
    }

    #[test]
    fn rows_in_order_are_left_as_they_are() {
        let mut ordered = series(&[(1, 1.0), (2, 1.0), (3, 5.0)]);
        assert_eq!(ordered.put_in_order(), Disorder::default());
        assert_eq!(ordered, series(&[(1, 1.0), (2, 1.0), (3, 5.0)]));
    }

    #[test]
    fn a_repeat_is_dropped_a_correction_stands_and_a_late_row_finds_its_place() {
        let mut ordered = series(&[(1, 1.0), (3, 3.0), (2, 2.0), (3, 3.0), (1, 9.0)]);
        let disorder = ordered.put_in_order();
        assert_eq!(ordered, series(&[(1, 9.0), (2, 2.0), (3, 3.0)]));
        assert_eq!((disorder.repeated, disorder.corrected), (1, 1));
        assert_eq!(disorder.out_of_order, 2);
    }

    #[test]
    fn a_value_corrected_and_corrected_back_counts_twice() {
        let mut ordered = series(&[(1, 1.0), (1, 2.0), (1, 1.0)]);
        assert_eq!(ordered.put_in_order().corrected, 2);
        assert_eq!(ordered, series(&[(1, 1.0)]));
    }

    #[test]
    fn what_is_stated_stands_over_the_name_and_a_channel_of_an_older_state_has_the_kind_of_its_name()
     {
        let old = r#"{"name":"rain_mm","unit":"mm","samples":[]}"#;
        let mut channel: Channel = serde_json::from_str(old).unwrap();
        assert_eq!(channel.kind(), CovariateKind::Rain);
        assert_eq!(serde_json::to_string(&channel).unwrap(), old);
        channel.stated = Some(CovariateKind::Level);
        assert_eq!(channel.kind(), CovariateKind::Level);
        let again: Channel =
            serde_json::from_str(&serde_json::to_string(&channel).unwrap()).unwrap();
        assert_eq!(again, channel);
    }
}

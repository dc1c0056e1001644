//! Everything that one or more files hold, how files join, and which series is meant.

use super::{BenchmarkId, Channel, Disorder, Quantity, Reading, Series};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// Everything one or more files hold.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Recording {
    /// The benchmarks' readings, by benchmark, then quantity.
    pub series: Vec<Series>,
    /// The covariates, by name.
    pub channels: Vec<Channel>,
    /// Where the data come from, as the file's own metadata say.
    pub provenance: BTreeMap<String, String>,
}

/// Two files that cannot be joined.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MergeError {
    /// Velocities that are means over different spans.
    #[error(
        "benchmark {benchmark}: velocities are averaged over {first} in one file and over {second} in another: expected one span"
    )]
    Averaging {
        /// Whose readings.
        benchmark: BenchmarkId,
        /// The span met first.
        first: String,
        /// The other.
        second: String,
    },
    /// One covariate in two units.
    #[error(
        "channel {channel} stands in {first} in one file and in {second} in another: expected one unit"
    )]
    ChannelUnits {
        /// The channel's name.
        channel: String,
        /// The unit met first.
        first: String,
        /// The other.
        second: String,
    },
}

/// A choice of series that fits none, or several.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SelectError {
    /// There is no series at all.
    #[error(
        "there are no benchmark readings, only channels: {}; expected a column named as displacement_mm or \
         5_velocity_mm_per_day are, or --column NAME=ID:displacement:mm",
        listed(channels)
    )]
    Nothing {
        /// The names of the channels that there are.
        channels: Vec<String>,
    },
    /// None fits.
    #[error("there is no {asked}: expected one of {}", listed(available))]
    NoSuch {
        /// What was asked for.
        asked: String,
        /// What there is.
        available: Vec<String>,
    },
    /// More than one fits.
    #[error(
        "several series match; choose one with --benchmark or --quantity: {}",
        listed(fitting)
    )]
    Several {
        /// What fits.
        fitting: Vec<String>,
    },
}

fn listed(names: &[String]) -> String {
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}

impl Recording {
    /// What the recording is where it was never measured, by its own metadata: "a reconstruction of ...".
    pub fn reconstruction(&self) -> Option<&str> {
        let kind = self.provenance.get("kind").map(String::as_str);
        kind.filter(|kind| kind.contains("reconstruction"))
    }

    /// Joins files in the order given: the rows of one quantity of one benchmark become one
    /// series, in the unit of the first, and where two files disagree about a time the later file stands. Overlaps are
    /// counted; the order of the files is not disorder.
    ///
    /// # Errors
    /// [`MergeError`] when files disagree about the unit of a channel or about the averaging of velocities.
    pub fn merge(parts: Vec<Self>) -> Result<(Self, Disorder), MergeError> {
        let mut series = BTreeMap::new();
        let mut channels = BTreeMap::new();
        let mut provenance = BTreeMap::new();
        for part in parts {
            for one in part.series {
                join_series(&mut series, one)?;
            }
            for one in part.channels {
                join_channel(&mut channels, one)?;
            }
            join_provenance(&mut provenance, part.provenance);
        }
        let mut recording = Self {
            series: series.into_values().collect(),
            channels: channels.into_values().collect(),
            provenance,
        };
        let mut disorder = recording.put_in_order();
        disorder.out_of_order = 0;
        Ok((recording, disorder))
    }

    /// Puts every series and channel in time order, and these by name.
    pub fn put_in_order(&mut self) -> Disorder {
        let mut disorder = Disorder::default();
        for series in &mut self.series {
            disorder += series.put_in_order();
        }
        for channel in &mut self.channels {
            disorder += channel.put_in_order();
        }
        self.series
            .sort_by(|a, b| (&a.benchmark, a.quantity()).cmp(&(&b.benchmark, b.quantity())));
        self.channels.sort_by(|a, b| a.name.cmp(&b.name));
        disorder
    }

    /// The one series that is meant; what is not given may be anything.
    ///
    /// # Errors
    /// [`SelectError`] lists what there is when none fits, or more than one does.
    pub fn series(
        &self,
        benchmark: Option<&BenchmarkId>,
        quantity: Option<Quantity>,
    ) -> Result<&Series, SelectError> {
        let fitting: Vec<&Series> = self
            .series
            .iter()
            .filter(|series| benchmark.is_none_or(|id| series.benchmark == *id))
            .filter(|series| quantity.is_none_or(|one| series.quantity() == one))
            .collect();
        match fitting.as_slice() {
            [one] => Ok(one),
            [] if self.series.is_empty() => Err(SelectError::Nothing {
                channels: self.channels.iter().map(|c| c.name.clone()).collect(),
            }),
            [] => Err(SelectError::NoSuch {
                asked: asked(benchmark, quantity),
                available: self.series.iter().map(title).collect(),
            }),
            several => Err(SelectError::Several {
                fitting: several.iter().copied().map(title).collect(),
            }),
        }
    }
}

fn title(series: &Series) -> String {
    format!(
        "{} {} ({})",
        series.benchmark,
        series.quantity(),
        series.unit
    )
}

fn asked(benchmark: Option<&BenchmarkId>, quantity: Option<Quantity>) -> String {
    let quantity = quantity.map_or("series", Quantity::name);
    match benchmark {
        Some(id) => format!("{quantity} of benchmark {id}"),
        None => format!("{quantity} of any benchmark"),
    }
}

fn join_series(
    joined: &mut BTreeMap<(BenchmarkId, Quantity), Series>,
    next: Series,
) -> Result<(), MergeError> {
    match joined.entry((next.benchmark.clone(), next.quantity())) {
        Entry::Vacant(place) => {
            place.insert(next);
        }
        Entry::Occupied(mut place) => {
            let first = place.get_mut();
            if first.averaging != next.averaging {
                let span = |series: &Series| {
                    series
                        .averaging
                        .map_or("an unstated span".to_owned(), |span| span.to_string())
                };
                return Err(MergeError::Averaging {
                    first: span(first),
                    second: span(&next),
                    benchmark: next.benchmark,
                });
            }
            // A logger that was set up anew may write in another unit: the daemon converts it too.
            let factor = next.unit.factor() / first.unit.factor();
            let converted = next.readings.into_iter().map(|reading| Reading {
                value: reading.value * factor,
                sigma: reading.sigma.map(|sigma| sigma * factor),
                ..reading
            });
            first.readings.extend(converted);
        }
    }
    Ok(())
}

fn join_channel(joined: &mut BTreeMap<String, Channel>, next: Channel) -> Result<(), MergeError> {
    match joined.entry(next.name.clone()) {
        Entry::Vacant(place) => {
            place.insert(next);
        }
        Entry::Occupied(mut place) => {
            let first = place.get_mut();
            if first.unit != next.unit {
                let unit = |unit: &Option<String>| unit.clone().unwrap_or("no unit".to_owned());
                return Err(MergeError::ChannelUnits {
                    channel: next.name,
                    first: unit(&first.unit),
                    second: unit(&next.unit),
                });
            }
            first.samples.extend(next.samples);
        }
    }
    Ok(())
}

fn join_provenance(joined: &mut BTreeMap<String, String>, next: BTreeMap<String, String>) {
    for (key, value) in next {
        match joined.entry(key) {
            Entry::Vacant(place) => {
                place.insert(value);
            }
            Entry::Occupied(mut place) => {
                let said = place.get_mut();
                if !said.split("; ").any(|one| one == value) {
                    said.push_str("; ");
                    said.push_str(&value);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reading::{Timestamp, Unit};

    fn one(benchmark: &str, unit: Unit, rows: &[(i64, f64)]) -> Recording {
        let readings = rows
            .iter()
            .map(|&(second, value)| Reading {
                time: Timestamp::from_second(second).unwrap(),
                value,
                sigma: None,
            })
            .collect();
        Recording {
            series: vec![Series {
                benchmark: BenchmarkId::new(benchmark),
                unit,
                averaging: None,
                readings,
            }],
            ..Recording::default()
        }
    }

    #[test]
    fn files_of_one_benchmark_become_one_series_and_the_later_file_stands() {
        let later = one("a", Unit::MM, &[(3, 3.0), (4, 4.0)]);
        let earlier = one("a", Unit::MM, &[(1, 1.0), (3, 30.0), (4, 4.0)]);
        let (merged, disorder) = Recording::merge(vec![later, earlier]).unwrap();
        let expected = one("a", Unit::MM, &[(1, 1.0), (3, 30.0), (4, 4.0)]);
        assert_eq!(merged, expected);
        assert_eq!((disorder.repeated, disorder.corrected), (1, 1));
        assert_eq!(disorder.out_of_order, 0);
    }

    #[test]
    fn files_in_two_units_become_one_series_in_that_of_the_first() {
        let centimetres = Unit::parse("cm").unwrap();
        let parts = vec![
            one("a", Unit::MM, &[(1, 5.0)]),
            one("a", centimetres, &[(2, 0.75)]),
        ];
        let (merged, _) = Recording::merge(parts).unwrap();
        assert_eq!(merged, one("a", Unit::MM, &[(1, 5.0), (2, 7.5)]));
    }

    #[test]
    fn a_velocity_of_unstated_span_is_not_joined_to_one_of_an_hour() {
        let mut hourly = one("a", Unit::MM_PER_DAY, &[]);
        hourly.series[0].averaging = Some(jiff::SignedDuration::from_hours(1));
        let parts = vec![hourly, one("a", Unit::MM_PER_DAY, &[])];
        let error = Recording::merge(parts).unwrap_err();
        assert!(matches!(error, MergeError::Averaging { .. }), "{error}");
    }

    #[test]
    fn one_series_needs_no_choosing_and_several_are_listed() {
        let parts = vec![
            one("b", Unit::MM, &[]),
            one("a", Unit::MM_PER_DAY, &[]),
            one("a", Unit::MM, &[]),
        ];
        assert_eq!(parts[0].series(None, None).unwrap().unit, Unit::MM);
        let (merged, _) = Recording::merge(parts).unwrap();
        let a = BenchmarkId::new("a");
        let chosen = merged.series(Some(&a), Some(Quantity::Velocity)).unwrap();
        assert_eq!(chosen.unit, Unit::MM_PER_DAY);
        let error = merged.series(Some(&a), None).unwrap_err().to_string();
        assert!(
            error.contains("a displacement (mm), a velocity (mm/day)"),
            "{error}"
        );
        assert!(!error.contains("b displacement"), "{error}");
    }

    #[test]
    fn a_benchmark_that_is_not_there_is_answered_with_those_that_are() {
        let recording = one("a", Unit::MM, &[]);
        let missing = BenchmarkId::new("z");
        let error = recording.series(Some(&missing), None).unwrap_err();
        assert!(error.to_string().contains("expected one of a displacement"));
        let error = Recording::default().series(None, None).unwrap_err();
        assert!(matches!(error, SelectError::Nothing { .. }));
    }
}

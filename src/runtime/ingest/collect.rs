//! Gathers single values into series and channels.

use super::Item;
use crate::reading::{BenchmarkId, Channel, Disorder, Quantity, Recording, Series};
use std::collections::BTreeMap;

/// The values of one file so far, in order of arrival.
#[derive(Debug, Default)]
pub(super) struct Collector {
    series: BTreeMap<(BenchmarkId, Quantity), Series>,
    channels: BTreeMap<String, Channel>,
    missing: usize,
}

/// A value in another unit, or of another averaging, than those before it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Inconsistent {
    /// The field of it.
    pub(super) field: &'static str,
    pub(super) found: String,
    pub(super) expected: &'static str,
}

impl Collector {
    pub(super) fn add(&mut self, item: Item) -> Result<(), Inconsistent> {
        match item {
            Item::Reading {
                benchmark,
                unit,
                averaging,
                reading,
            } => {
                let series = self
                    .series
                    .entry((benchmark.clone(), unit.quantity()))
                    .or_insert_with(|| Series {
                        benchmark,
                        unit,
                        averaging,
                        readings: Vec::new(),
                    });
                if series.unit != unit {
                    return Err(one_unit(unit.to_string()));
                }
                if series.averaging != averaging {
                    return Err(Inconsistent {
                        field: super::message::AVERAGING,
                        found: averaging.map_or("none".to_owned(), |span| span.to_string()),
                        expected: "the same averaging as in the first value",
                    });
                }
                series.readings.push(reading);
            }
            Item::Sample {
                channel,
                unit,
                sample,
            } => {
                let channel = self
                    .channels
                    .entry(channel)
                    .or_insert_with_key(|name| Channel {
                        name: name.clone(),
                        unit: unit.clone(),
                        stated: None,
                        samples: Vec::new(),
                    });
                if channel.unit != unit {
                    return Err(one_unit(unit.unwrap_or_default()));
                }
                channel.samples.push(sample);
            }
            Item::Missing { .. } => self.missing += 1,
        }
        Ok(())
    }

    pub(super) fn finish(self, provenance: BTreeMap<String, String>) -> (Recording, Disorder) {
        let mut recording = Recording {
            series: self.series.into_values().collect(),
            channels: self.channels.into_values().collect(),
            provenance,
        };
        let mut disorder = recording.put_in_order();
        disorder.missing = self.missing;
        (recording, disorder)
    }
}

fn one_unit(found: String) -> Inconsistent {
    Inconsistent {
        field: "unit",
        found,
        expected: "the same unit as in the first value",
    }
}

//! The units that a growing file began with: another one later is a fault, never another scale.

use super::Item;
use crate::reading::{BenchmarkId, Unit};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What is said in place of a reading whose unit is another than before begins with this.
pub(in crate::runtime) const UNIT_WAS: &str = "its unit was";

/// The unit of each quantity of each benchmark so far; to be kept with the place in the file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct FileUnits(BTreeMap<BenchmarkId, Vec<Unit>>);

impl FileUnits {
    /// The item itself, or a missing reading where its unit is not the one that the file began with.
    #[must_use]
    pub fn guard(&mut self, item: Item) -> Item {
        let Item::Reading {
            benchmark,
            unit,
            reading,
            ..
        } = &item
        else {
            return item;
        };
        // Not by entry(): nearly always it is there, and the name need not be copied.
        let known = match self.0.get_mut(benchmark) {
            Some(known) => known,
            None => self.0.entry(benchmark.clone()).or_default(),
        };
        let quantity = unit.quantity();
        match known.iter().find(|known| known.quantity() == quantity) {
            None => known.push(*unit),
            Some(known) if known == unit => {}
            Some(known) => {
                return Item::Missing {
                    benchmark: benchmark.clone(),
                    time: reading.time,
                    what: format!("{UNIT_WAS} {known} and is {unit}"),
                };
            }
        }
        item
    }
}

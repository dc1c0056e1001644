//! The units that a file began with. Where a line states another one of its value, or a header of the rows below it, the value is
//! given in the first one.

use super::Item;
use crate::reading::{BenchmarkId, Unit};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The unit of each quantity of each benchmark so far; to be kept with the place in the file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct FileUnits(BTreeMap<BenchmarkId, Vec<Unit>>);

impl FileUnits {
    /// The same value in the unit that the file began with.
    #[must_use]
    pub fn convert(&mut self, mut item: Item) -> Item {
        if let Some(known) = self.first(&item)
            && let Item::Reading { unit, reading, .. } = &mut item
            && *unit != known
        {
            let factor = unit.factor() / known.factor();
            reading.value *= factor;
            reading.sigma = reading.sigma.map(|sigma| sigma * factor);
            *unit = known;
        }
        item
    }

    /// The unit of the first value of the same quantity of a reading's benchmark, which may be this one.
    fn first(&mut self, item: &Item) -> Option<Unit> {
        let Item::Reading {
            benchmark, unit, ..
        } = item
        else {
            return None;
        };
        // Not by entry(): nearly always it is there, and the name need not be copied.
        let known = match self.0.get_mut(benchmark) {
            Some(known) => known,
            None => self.0.entry(benchmark.clone()).or_default(),
        };
        let quantity = unit.quantity();
        let first = known
            .iter()
            .copied()
            .find(|known| known.quantity() == quantity);
        if first.is_none() {
            known.push(*unit);
        }
        Some(first.unwrap_or(*unit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reading::Reading;

    fn item(value: f64, unit: &str) -> Item {
        Item::Reading {
            benchmark: BenchmarkId::new("5"),
            unit: Unit::parse(unit).unwrap(),
            averaging: None,
            reading: Reading {
                time: "2020-01-01T00:00:00Z".parse().unwrap(),
                value,
                sigma: Some(0.001),
            },
        }
    }

    #[test]
    fn a_value_in_another_unit_is_given_in_the_first_one() {
        let mut units = FileUnits::default();
        assert_eq!(units.convert(item(1.0, "mm")), item(1.0, "mm"));
        let Item::Reading { unit, reading, .. } = units.convert(item(0.25, "m")) else {
            panic!("a reading");
        };
        assert_eq!((unit.to_string(), reading.value), ("mm".to_owned(), 250.0));
        assert!((reading.sigma.unwrap() - 1.0).abs() < 1e-12);
        // A velocity is another quantity, with a first unit of its own.
        assert_eq!(units.convert(item(3.0, "mm/h")), item(3.0, "mm/h"));
    }
}

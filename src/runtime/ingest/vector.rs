//! Readings that are given by their components: projected on the direction of downslope motion.

use super::columns::{Column, Layout};
use crate::reading::{BenchmarkId, Unit};

/// A benchmark whose reading is the sum of columns, each times its part of the direction.
#[derive(Debug, Clone, PartialEq)]
pub struct VectorMap {
    /// Whose.
    pub benchmark: BenchmarkId,
    /// The unit of all columns.
    pub unit: Unit,
    /// The columns, and the components of the downslope direction (of length one) along them.
    pub components: Vec<(String, f64)>,
}

/// A vector whose columns have been found.
#[derive(Debug, Clone)]
pub(super) struct VectorColumns {
    pub(super) benchmark: BenchmarkId,
    pub(super) unit: Unit,
    /// The columns' places.
    pub(super) components: Vec<(usize, f64)>,
}

/// Finds the vectors' columns, which are no longer anything else then.
pub(super) fn claim(layout: &mut Layout, maps: &[VectorMap]) -> Vec<VectorColumns> {
    let mut vectors = Vec::new();
    for map in maps {
        let place = |(name, part): &(String, f64)| {
            let place = layout.names.iter().position(|one| one == name)?;
            Some((place, *part))
        };
        let found: Vec<(usize, f64)> = map.components.iter().filter_map(place).collect();
        if found.len() == map.components.len() {
            vectors.push(VectorColumns {
                benchmark: map.benchmark.clone(),
                unit: map.unit,
                components: found,
            });
        } else if !found.is_empty() {
            let (benchmark, columns) = (&map.benchmark, &layout.names);
            tracing::warn!(%benchmark, ?columns, "not all components of the benchmark are there: no reading of it");
        }
    }
    for vector in &vectors {
        for (place, _) in &vector.components {
            layout.columns[*place] = Column::Component {
                benchmark: vector.benchmark.clone(),
                unit: vector.unit,
            };
        }
    }
    vectors
}

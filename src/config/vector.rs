//! `components` and `direction` of a benchmark: columns that are projected on the slope.

use super::table::{Placed, Section};
use crate::reading::Unit;

/// A reading that is given by its components.
#[derive(Debug, Clone, PartialEq)]
pub struct Vector {
    /// The columns: east, north and height, or as many as there are.
    pub components: Vec<String>,
    /// The direction of downslope motion in them, of length one.
    pub direction: Vec<f64>,
    /// The unit of all of them.
    pub unit: Unit,
}

const EXAMPLE: &str =
    "components = [\"east_mm\", \"north_mm\", \"height_mm\"] and direction = [0.7, 0.6, -0.4]";

/// Reads both keys; `unit` is the benchmark's own, for columns whose names do not end in one.
pub(super) fn vector(section: &mut Section<'_>, unit: Option<Unit>) -> Option<Vector> {
    let components = section.texts("components");
    let direction = section.numbers("direction");
    let (components, direction) = match (components, direction) {
        (None, None) => return None,
        (Some(components), Some(direction)) => (components, direction),
        (Some(Placed { at, .. }), None) | (None, Some(Placed { at, .. })) => {
            let what = "benchmark.components and benchmark.direction are not both given";
            section.error(&at, what.to_owned(), format!("write {EXAMPLE}"));
            return None;
        }
    };
    if section.has("column") || section.has("quantity") {
        let what = "benchmark.column and benchmark.quantity do not go with benchmark.components";
        section.error(&components.at, what.to_owned(), "leave them out");
    }
    let length = direction
        .value
        .iter()
        .map(|part| part * part)
        .sum::<f64>()
        .sqrt();
    let counts = (components.value.len(), direction.value.len());
    if counts.0 != counts.1 || !(1..=3).contains(&counts.0) || !(length > 0.0 && length.is_finite())
    {
        let what = if counts.0 == counts.1 && (1..=3).contains(&counts.0) {
            "benchmark.direction is no direction: its length is 0, or no number".to_owned()
        } else {
            format!(
                "benchmark.direction is no direction: {} numbers for {} components",
                counts.1, counts.0
            )
        };
        section.error(&direction.at, what, format!("write {EXAMPLE}"));
        return None;
    }
    let names: Vec<String> = components
        .value
        .into_iter()
        .map(|name| name.value)
        .collect();
    let mut units = names
        .iter()
        .map(|name| unit.or_else(|| Unit::at_end_of(name)));
    let first = units.next().flatten();
    let Some(unit) = first.filter(|_| units.all(|unit| unit == first)) else {
        section.error(
            &components.at,
            "benchmark.components do not all say one unit".to_owned(),
            "add unit = with the one that they are in, such as \"mm\" or \"m\", or name columns that end in one and the same unit",
        );
        return None;
    };
    Some(Vector {
        components: names,
        direction: direction.value.iter().map(|part| part / length).collect(),
        unit,
    })
}

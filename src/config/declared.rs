//! `[[event]]`: what people did to the site or its instruments.

use super::table::{Placed, Section};
use super::{Benchmark, value};
use crate::monitor::{Declaration, Declared};
use crate::reading::{BenchmarkId, Quantity, Timestamp, Unit};
use jiff::SignedDuration;

/// Maintenance whose end is not declared.
const MAINTENANCE: SignedDuration = SignedDuration::from_hours(1);

pub(super) fn events(root: &mut Section<'_>, benchmarks: &[Benchmark]) -> Vec<Declared> {
    let sections = root.tables("event", "event").into_iter();
    sections
        .filter_map(|section| event(section, benchmarks))
        .collect()
}

fn event(mut section: Section<'_>, benchmarks: &[Benchmark]) -> Option<Declared> {
    let time = section
        .required("time", "\"2017-06-06T17:00:00Z\"")
        .and_then(|_| section.parsed("time", value::instant));
    let kind = kind(&mut section, time.as_ref().map(|given| given.value));
    let benchmark = section.text("benchmark");
    if let Some(given) = &benchmark
        && !benchmarks.is_empty()
        && benchmarks
            .iter()
            .all(|known| known.id.as_str() != given.value)
    {
        section.error(
            &given.at,
            format!("event.benchmark = {:?} is no [[benchmark]]", given.value),
            "name one that is declared, or leave it out for the whole site",
        );
    }
    section.finish();
    Some(Declared {
        time: time?.value,
        benchmark: benchmark.map(|given| BenchmarkId::new(given.value)),
        kind: kind?,
    })
}

fn kind(section: &mut Section<'_>, time: Option<Timestamp>) -> Option<Declaration> {
    let kind = section.required("kind", "\"reset\"")?;
    let until = section.parsed("until", value::instant);
    let size = size(section);
    if let Some(until) = &until
        && (kind.value != "maintenance" || time.is_some_and(|time| until.value <= time))
    {
        section.error(
            &until.at,
            "event.until is no end of anything".to_owned(),
            "give it to maintenance, and later than time",
        );
    }
    if let Some(size) = &size
        && kind.value != "reset"
    {
        section.error(
            &size.at,
            format!("event.size means nothing for {:?}", kind.value),
            "leave it out, or write kind = \"reset\"",
        );
    }
    match kind.value.as_str() {
        "reset" => Some(Declaration::Reset {
            size_mm: size.map(|size| size.value),
        }),
        "maintenance" => {
            let default = || time?.checked_add(MAINTENANCE).ok();
            let until = until.map(|given| given.value).or_else(default)?;
            Some(Declaration::Maintenance { until })
        }
        "blast" => Some(Declaration::Blast),
        _ => {
            section.error(
                &kind.at,
                format!("event.kind = {:?} cannot be used", kind.value),
                "write maintenance, reset or blast",
            );
            None
        }
    }
}

/// What the readings jump by, mm.
fn size(section: &mut Section<'_>) -> Option<Placed<f64>> {
    let unit = section.parsed("unit", |text| {
        Unit::parse(text)
            .ok()
            .filter(|unit| unit.quantity() == Quantity::Displacement)
            .ok_or_else(|| "write a unit of length, such as \"mm\"".to_owned())
    });
    let size = section.number("size");
    match (size, unit) {
        (Some(size), Some(unit)) => Some(Placed {
            value: size.value * unit.value.factor(),
            at: size.at,
        }),
        (Some(size), None) => {
            if !section.has("unit") {
                section.error(
                    &size.at,
                    "event.size is given without event.unit".to_owned(),
                    "add unit = \"mm\"",
                );
            }
            None
        }
        (None, Some(unit)) => {
            section.error(
                &unit.at,
                "event.unit is given without event.size".to_owned(),
                "add size = 74.0, or leave unit out",
            );
            None
        }
        (None, None) => None,
    }
}

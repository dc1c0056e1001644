//! `[[source]]`: where readings come from, and how they are written there.

use super::section::unique;
use super::table::Section;
use super::{FilePattern, Source, SourceKind, value};
use crate::reading::{Conventions, LocalClock, MissingValues, SummerTime};
use std::collections::BTreeSet;
use std::path::Path;

/// What may stand as `kind`.
const KINDS: &str = "supported: csv, ndjson, toa5, mcap";

pub(super) fn sources(root: &mut Section<'_>, base: &Path) -> Vec<Source> {
    let sections = root.tables("source", "source");
    if sections.is_empty() {
        root.error(
            root.at(),
            "there is no [[source]]".to_owned(),
            "add [[source]] with id, kind and path",
        );
    }
    let mut taken = BTreeSet::new();
    sections
        .into_iter()
        .filter_map(|section| source(section, base, &mut taken))
        .collect()
}

fn source(mut section: Section<'_>, base: &Path, taken: &mut BTreeSet<String>) -> Option<Source> {
    let id = section.required("id", "\"logger\"");
    unique(&section, id.as_ref(), taken);
    let kind = section
        .required("kind", "\"csv\"")
        .and_then(|_| section.parsed("kind", source_kind));
    let pattern = section
        .required("path", "\"incoming/*.csv\"")
        .and_then(|_| section.parsed("path", |text| FilePattern::parse(text, base)));
    let kind = kind.map(|given| given.value);
    let conventions = conventions(&mut section, kind);
    section.finish();
    Some(Source {
        id: id?.value,
        kind: kind?,
        pattern: pattern?.value,
        conventions,
    })
}

fn source_kind(text: &str) -> Result<SourceKind, String> {
    match text {
        "csv" => Ok(SourceKind::Csv),
        "ndjson" => Ok(SourceKind::Ndjson),
        "toa5" => Ok(SourceKind::Toa5),
        "mcap" => Ok(SourceKind::Mcap),
        "nats" => Err(format!("not yet supported; {KINDS}")),
        _ => Err(KINDS.to_owned()),
    }
}

/// How the source writes times and missing values.
fn conventions(section: &mut Section<'_>, kind: Option<SourceKind>) -> Conventions {
    let zone = section.parsed("time_zone", value::time_zone);
    let dst = section.parsed("dst", SummerTime::parse);
    let mut missing = MissingValues::default();
    let marks = section.marks("missing");
    let has_marks = !marks.is_empty();
    marks.iter().for_each(|mark| missing.add(mark));
    if let (Some(dst), None) = (&dst, &zone) {
        section.error(
            &dst.at,
            "source.dst is given without source.time_zone".to_owned(),
            "add time_zone = \"Europe/Rome\", or leave dst out",
        );
    }
    if kind == Some(SourceKind::Mcap) && (zone.is_some() || has_marks) {
        section.warning(
            section.at(),
            "source.time_zone and source.missing do nothing for mcap".to_owned(),
            "leave them out: MCAP times are instants, and its values are numbers",
        );
    }
    Conventions {
        clock: LocalClock {
            zone: zone.map(|given| given.value),
            summer_time: dst.map_or_else(SummerTime::default, |given| given.value),
        },
        missing,
    }
}

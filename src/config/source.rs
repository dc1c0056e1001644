//! `[[source]]`: where readings come from, and how they are written there.

use super::table::{Placed, Section, unique};
use super::{Broker, FilePattern, FileSource, SourceKind, broker, value};
use crate::reading::{
    Conventions, DecimalMark, Delimiter, Dialect, LocalClock, MOST_SKIPPED, MissingValues,
    SummerTime, ThousandsMark, TimeFormat, Timestamp,
};
use jiff::SignedDuration;
use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

/// The words for the kinds.
const KINDS: &str = "supported: csv, ndjson, toa5, mcap, mqtt";

pub(super) fn sources(root: &mut Section<'_>, base: &Path) -> (Vec<FileSource>, Vec<Broker>) {
    let sections = root.tables("source", "source");
    if sections.is_empty() {
        root.error(
            root.at(),
            "there is no [[source]]".to_owned(),
            "add [[source]] with id, kind and path",
        );
    }
    let mut taken = BTreeSet::new();
    let (mut sources, mut brokers) = (Vec::new(), Vec::new());
    for section in sections {
        match source(section, base, &mut taken) {
            Some(SourceOrigin::Files(source)) => sources.push(source),
            Some(SourceOrigin::Topics(broker)) => brokers.push(broker),
            None => {}
        }
    }
    (sources, brokers)
}

/// What a `[[source]]` is.
enum SourceOrigin {
    Files(FileSource),
    Topics(Broker),
}

/// What may stand as `kind`.
#[derive(Clone, Copy, PartialEq, Eq)]
enum StatedKind {
    Files(SourceKind),
    Mqtt,
}

fn source(
    mut section: Section<'_>,
    base: &Path,
    taken: &mut BTreeSet<String>,
) -> Option<SourceOrigin> {
    let id = section.required("id", "\"logger\"");
    unique(&section, id.as_ref(), taken);
    let id = id.map(|given| given.value);
    let kind = section
        .required("kind", "\"csv\"")
        .and_then(|_| section.parsed("kind", source_kind))
        .map(|given| given.value);
    if kind == Some(StatedKind::Mqtt) {
        let conventions = conventions(&mut section, kind);
        let broker = broker::broker(&mut section, id, conventions, base);
        section.finish();
        return broker.map(SourceOrigin::Topics);
    }
    let pattern = section
        .required("path", "\"incoming/*.csv\"")
        .and_then(|_| section.parsed("path", |text| FilePattern::parse(text, base)));
    let conventions = conventions(&mut section, kind);
    let dialect = dialect(&mut section, kind);
    let epoch = epoch(&mut section, kind);
    let reorder = section.parsed("reorder", value::duration_or_none);
    section.finish();
    let StatedKind::Files(kind) = kind? else {
        return None;
    };
    Some(SourceOrigin::Files(FileSource {
        id: id?,
        kind,
        pattern: pattern?.value,
        conventions,
        dialect,
        epoch,
        reorder: reorder.map_or(SignedDuration::ZERO, |given| given.value),
    }))
}

/// How the source's tables are written.
fn dialect(section: &mut Section<'_>, kind: Option<StatedKind>) -> Dialect {
    let delimiter = section.parsed("delimiter", Delimiter::parse);
    let decimal = section.parsed("decimal", DecimalMark::parse);
    let thousands = section.parsed("thousands", ThousandsMark::parse);
    let time_columns = section.text_or_texts("time_column");
    let time_format = section.parsed("time_format", TimeFormat::parse);
    let skip_lines = skip_lines(section);
    let given = [
        ("delimiter", delimiter.as_ref().map(|given| &given.at)),
        ("decimal", decimal.as_ref().map(|given| &given.at)),
        ("thousands", thousands.as_ref().map(|given| &given.at)),
        ("time_column", time_columns.as_ref().map(|given| &given.at)),
        ("time_format", time_format.as_ref().map(|given| &given.at)),
        ("skip_lines", skip_lines.as_ref().map(|given| &given.at)),
    ];
    for (key, at) in given {
        refuse_idle(section, kind, key, at);
    }
    let decimal = decimal.map_or_else(DecimalMark::default, |given| given.value);
    if let Some(given) = &thousands
        && given.value.is_decimal(decimal)
    {
        let name = given.value.name();
        section.error(
            &given.at,
            format!("source.thousands = {name:?} is what stands before the decimals too"),
            "write thousands = \"point\" beside decimal = \"comma\", or thousands = \"comma\""
                .to_owned(),
        );
    }
    Dialect {
        delimiter: delimiter.map(|given| given.value),
        decimal,
        thousands: thousands.map(|given| given.value),
        time_columns: time_columns.map_or_else(Vec::new, |given| given.value),
        time_format: time_format.map_or_else(TimeFormat::default, |given| given.value),
        skip_lines: skip_lines.map_or(0, |given| given.value),
    }
}

/// How many lines stand before the header.
fn skip_lines(section: &mut Section<'_>) -> Option<Placed<u64>> {
    let given = section.number("skip_lines")?;
    let lines = (0..=MOST_SKIPPED).find(|lines| (*lines as f64).total_cmp(&given.value).is_eq());
    if lines.is_none() {
        section.error(
            &given.at,
            format!("source.skip_lines = {} is no number of lines", given.value),
            format!("write a whole number from 0 to {MOST_SKIPPED}, such as skip_lines = 2"),
        );
    }
    lines.map(|value| Placed {
        value,
        at: given.at,
    })
}

/// Day 0 of a column `t_days`, which only tables have.
fn epoch(section: &mut Section<'_>, kind: Option<StatedKind>) -> Option<Timestamp> {
    let epoch = section.parsed("epoch", value::instant);
    refuse_idle(
        section,
        kind,
        "epoch",
        epoch.as_ref().map(|given| &given.at),
    );
    epoch.map(|given| given.value)
}

/// Refuses a key, which stands there, where it means nothing for the kind.
fn refuse_idle(
    section: &mut Section<'_>,
    kind: Option<StatedKind>,
    key: &str,
    at: Option<&Range<usize>>,
) {
    if let Some(at) = at.filter(|_| kind.is_some_and(|kind| !kind.takes(key))) {
        section.error(
            at,
            format!("source.{key} does nothing for this kind"),
            "leave it out, or write kind = \"csv\"",
        );
    }
}

impl StatedKind {
    /// Whether a key that says how a table is written means something for it.
    fn takes(self, key: &str) -> bool {
        match self {
            Self::Files(SourceKind::Csv) => true,
            Self::Files(SourceKind::Ndjson) => key.starts_with("time"),
            Self::Files(SourceKind::Toa5 | SourceKind::Mcap) | Self::Mqtt => false,
        }
    }
}

fn source_kind(text: &str) -> Result<StatedKind, String> {
    if let Some(kind) = SourceKind::ALL.into_iter().find(|kind| kind.name() == text) {
        return Ok(StatedKind::Files(kind));
    }
    match text {
        "mqtt" => Ok(StatedKind::Mqtt),
        "nats" => Err(format!("not yet supported; {KINDS}")),
        _ => Err(KINDS.to_owned()),
    }
}

/// How the source writes times and missing values.
fn conventions(section: &mut Section<'_>, kind: Option<StatedKind>) -> Conventions {
    let zone = section.parsed("time_zone", value::time_zone);
    let dst = section.parsed("dst", SummerTime::parse);
    let mut missing = MissingValues::default();
    let marks = section.marks("missing");
    let has_marks = marks.is_some();
    let marks = marks.into_iter().flat_map(|marks| marks.value);
    marks.for_each(|mark| missing.add(&mark));
    if let (Some(dst), None) = (&dst, &zone) {
        section.error(
            &dst.at,
            "source.dst is given without source.time_zone".to_owned(),
            "add time_zone = \"Europe/Rome\", or leave dst out",
        );
    }
    if kind == Some(StatedKind::Files(SourceKind::Mcap)) && (zone.is_some() || has_marks) {
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

//! Faults in words: a sentence for each kind in each source, and the short flags.

use super::super::explanation::Fault;
use super::super::kind::FaultKind;
use super::smooth::Smoothness;
use crate::reading::{Timestamp, Unit, counted};

/// More instances than this are counted and not listed.
const LISTED: usize = 4;

/// In short, what is wrong: each once, in the order of the kinds.
pub(super) fn flags(faults: &[Fault]) -> Vec<String> {
    // A covariate drawn in straight lines does not make an error of the readings worthless.
    let flagged = faults
        .iter()
        .filter(|fault| fault.kind != FaultKind::Interpolated || fault.channel.is_none());
    let mut kinds: Vec<FaultKind> = flagged.map(|fault| fault.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let flag = |kind: &FaultKind| match kind {
        FaultKind::Reset => "covariate-reset".to_owned(),
        FaultKind::RepeatedRows
        | FaultKind::Stuck
        | FaultKind::Interpolated
        | FaultKind::Outlier
        | FaultKind::UnitSlip
        | FaultKind::OutOfRange => kind.name().to_owned(),
    };
    kinds.iter().map(flag).collect()
}

/// A sentence for each kind of fault in each source, benchmark first.
pub(super) fn remarks(
    faults: &[Fault],
    smoothness: Option<Smoothness>,
    twins: &[(String, String)],
) -> Vec<String> {
    let mut keys: Vec<(Option<&str>, FaultKind)> = faults
        .iter()
        .map(|fault| (fault.channel.as_deref(), fault.kind))
        .collect();
    keys.sort_unstable();
    keys.dedup();
    let mut sentences: Vec<String> = keys
        .into_iter()
        .map(|(channel, kind)| {
            let alike = |fault: &&Fault| fault.channel.as_deref() == channel && fault.kind == kind;
            let these: Vec<&Fault> = faults.iter().filter(alike).collect();
            sentence(channel, kind, &these, smoothness)
        })
        .collect();
    sentences.extend(twins.iter().map(|(jumping, other)| {
        format!(
            "{jumping} measures the same as {other} but for its resets: they are one instrument, and count once."
        )
    }));
    sentences
}

fn sentence(
    channel: Option<&str>,
    kind: FaultKind,
    faults: &[&Fault],
    smoothness: Option<Smoothness>,
) -> String {
    let source = channel.unwrap_or("The readings");
    let values: usize = faults.iter().map(|fault| fault.values).sum();
    let listed = listed(faults);
    match kind {
        FaultKind::Reset => format!(
            "{source}: its zero jumps ({listed}); the jumps are taken out, and the values that straddle them."
        ),
        FaultKind::RepeatedRows => {
            let what = counted(
                values,
                "copy of an earlier value",
                "copies of earlier values",
            );
            format!("{source}: {what} ({listed}), taken out.")
        }
        FaultKind::Stuck => format!(
            "{source}: stuck ({listed}); all but the first value of each run are taken out."
        ),
        FaultKind::UnitSlip => format!(
            "{source}: from a time on all values are so many times as large ({listed}), as in another unit; they are taken in the unit before."
        ),
        FaultKind::Outlier => {
            let what = counted(values, "value far", "values far");
            format!("{source}: {what} from all around, and back again ({listed}), taken out.")
        }
        FaultKind::OutOfRange => {
            let what = counted(values, "value that is", "values that are");
            format!("{source}: {what} a logger's code or impossible ({listed}), taken out.")
        }
        FaultKind::Interpolated => {
            let how = channel.map_or(smoothness, |_| Some(Smoothness::Lines));
            interpolated(source, how)
        }
    }
}

/// That the newest reading, which is of that time, leaves those before it by `off`, all at once.
pub(super) fn of_newest(at: Timestamp, off: f64, unit: Unit) -> String {
    format!(
        "The readings: the last one, of {}, is {off:+.3} {unit} off the line of those before it, all at once: a mistake of the instrument and the beginning of a motion look the same until more is read, and it is left out until then.",
        date(at)
    )
}

/// That these readings stand out of a law with what was found, and out of no neighbours.
pub(super) fn beside_a_law(faults: &[&Fault]) -> String {
    let values: usize = faults.iter().map(|fault| fault.values).sum();
    let what = counted(values, "value far", "values far");
    let listed = listed(faults);
    format!(
        "The readings: {what} from the law with all that was found, and back again ({listed}), taken out; it was fitted again without."
    )
}

/// The first few faults, each with its size and date.
fn listed(faults: &[&Fault]) -> String {
    let first = faults.iter().take(LISTED).map(|fault| instance(fault));
    let mut listed = first.collect::<Vec<_>>().join(", ");
    if faults.len() > LISTED {
        listed += ", ...";
    }
    listed
}

fn instance(fault: &Fault) -> String {
    let date = date(fault.at);
    if let Some(original) = fault.copy_of {
        return format!("{date} repeats {}", self::date(original));
    }
    let size = fault.size.map_or(String::new(), |size| {
        if fault.kind == FaultKind::Reset {
            format!("{size:+.3}")
        } else {
            size.to_string()
        }
    });
    if fault.kind == FaultKind::UnitSlip {
        return format!("× {size} from {date} on");
    }
    let unit = fault.unit.as_deref().unwrap_or("");
    let until = fault
        .until
        .map_or(String::new(), |until| format!(" to {}", self::date(until)));
    format!("{size} {unit} on {date}{until}").replace("  ", " ")
}

fn interpolated(source: &str, smoothness: Option<Smoothness>) -> String {
    let how = match smoothness {
        Some(Smoothness::Lines) => "stand on straight lines between sparse points",
        Some(Smoothness::Drawing) => "are the vertices of a drawn curve",
        Some(Smoothness::Curve) | None => "are smoother than any instrument's",
    };
    format!("{source}: the values {how}; any error figure about them is worth little.")
}

fn date(time: Timestamp) -> String {
    time.strftime("%Y-%m-%d").to_string()
}

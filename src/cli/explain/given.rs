//! `--given KIND[:CHANNEL][@TIME]`: an effect that is declared to be there.

use crate::cli::exit::UsageError;
use crate::config::value;
use crate::effects::{Cause, Kind};
use crate::reading::{Channel, Series};

/// An effect as it is declared on the command line. A channel's name may hold `:` and `@`.
pub(super) fn cause(text: &str) -> Result<Cause, String> {
    let end = text.find([':', '@']).unwrap_or(text.len());
    let (name, rest) = text.split_at(end);
    let kind = kind(name)?;
    let (channel, time) = match rest.strip_prefix(':') {
        // The time is behind the last `@`, where the kind has one.
        Some(rest) if kind.has_time() => match rest.rsplit_once('@') {
            Some((channel, time)) => (Some(channel), Some(time)),
            None => (Some(rest), None),
        },
        Some(rest) => (Some(rest), None),
        None => (None, rest.strip_prefix('@')),
    };
    match (kind.has_channel(), channel) {
        (true, None | Some("")) => Err(format!(
            "{kind} works through a covariate: write {kind}:CHANNEL"
        )),
        (false, Some(channel)) => Err(format!(
            "{kind} works through no covariate, and {channel:?} is given"
        )),
        (true, Some(_)) | (false, None) => Ok(()),
    }?;
    if !kind.has_time() && time.is_some() {
        return Err(format!("{kind} acts all along and has no time"));
    }
    Ok(Cause {
        kind,
        channel: channel.map(str::to_owned),
        at: time.map(value::instant).transpose()?,
    })
}

fn kind(name: &str) -> Result<Kind, String> {
    let known = Kind::all().filter(|kind| kind.can_be_declared());
    let known: Vec<Kind> = known.collect();
    if let Some(kind) = known.iter().find(|kind| kind.name() == name) {
        return Ok(*kind);
    }
    let names: Vec<&str> = known.iter().map(|kind| kind.name()).collect();
    let names = names.join(", ");
    Err(if Kind::named(name).is_some() {
        format!(
            "{name} is nothing that is put into the law of one benchmark; expected one of {names}"
        )
    } else {
        format!("{name:?} is no kind of effect; expected one of {names}")
    })
}

/// Whether all that is declared can be meant of this series.
pub(super) fn check(
    causes: &[Cause],
    series: &Series,
    channels: &[Channel],
) -> Result<(), UsageError> {
    for (index, cause) in causes.iter().enumerate() {
        if causes[..index].contains(cause) {
            return Err(UsageError(format!("--given {cause} stands twice")));
        }
        if let Some(name) = &cause.channel
            && !channels.iter().any(|channel| channel.name == *name)
        {
            return Err(UsageError(no_channel(cause, name, channels)));
        }
        let (Some(first), Some(last)) = (series.readings.first(), series.readings.last()) else {
            continue;
        };
        if let Some(at) = cause.at
            && !(first.time..=last.time).contains(&at)
        {
            let (first, last) = (first.time, last.time);
            return Err(UsageError(format!(
                "--given {cause}: the readings are from {first} to {last}"
            )));
        }
    }
    Ok(())
}

fn no_channel(cause: &Cause, name: &str, channels: &[Channel]) -> String {
    let names: Vec<&str> = channels
        .iter()
        .map(|channel| channel.name.as_str())
        .collect();
    let there = if names.is_empty() {
        "there is none in these files".to_owned()
    } else {
        format!("there are {}", names.join(", "))
    };
    format!("--given {cause}: no covariate is called {name:?}; {there}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_declared_is_read_back_as_it_was_written() {
        for text in [
            "hydrological:lake_level_m",
            "thermal:air@2m:mean",
            "offset@2017-06-06T17:00:00Z",
            "load-step",
            "seasonal",
        ] {
            assert_eq!(cause(text).unwrap().to_string(), text);
        }
    }

    #[test]
    fn what_cannot_be_meant_is_refused_with_what_was_expected() {
        for (text, said) in [
            (
                "rain:lake",
                "no kind of effect; expected one of hydrological",
            ),
            ("partition", "is nothing that is put into the law"),
            ("none", "is nothing that is put into the law"),
            ("hydrological", "write hydrological:CHANNEL"),
            ("hydrological:", "write hydrological:CHANNEL"),
            ("offset:lake", "works through no covariate"),
            ("tide@2017-06-06T17:00:00Z", "has no time"),
            ("offset@tomorrow", "write it with its offset"),
            ("", "no kind of effect"),
        ] {
            let error = cause(text).unwrap_err();
            assert!(error.contains(said), "{text:?}: {error}");
        }
    }
}

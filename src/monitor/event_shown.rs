//! What is shown of each kind of event beside its fields: its name, its mark and its sentence.

use super::event::{AlertState, EventKind, FailureTime, SharedFailure, Summary, Unexplained};
use crate::alert::percent_in_words;
use crate::effects::{Kind, Rival};
use crate::reading::{BenchmarkId, Timestamp, figure, minute};
use std::f64::consts::LOG10_E;

/// How one kind of event is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KindShown {
    /// The word in its JSON.
    pub name: &'static str,
    /// Its letter on a benchmark's axis of time; `None`: it is not marked there.
    pub letter: Option<char>,
    /// Whether it stands in the site's log.
    pub is_listed: bool,
    about: About,
}

/// What an event is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum About {
    /// The slope, or what people do about it.
    Slope,
    /// What has changed over the whole record.
    Record,
    /// The data.
    Data,
}

/// A likelihood that is smaller by more than this, ln, is no figure.
const MOST_NATS: f64 = 50.0;

const REGIME_FLIP: KindShown = KindShown {
    name: "regime-flip",
    letter: Some('R'),
    is_listed: false,
    about: About::Record,
};

const INTERCEPT_DRIFT: KindShown = KindShown {
    name: "intercept-drift",
    letter: Some('i'),
    is_listed: false,
    about: About::Record,
};

const TRANSITION_DRIFT: KindShown = KindShown {
    name: "transition-drift",
    letter: Some('t'),
    is_listed: false,
    about: About::Record,
};

const UNEXPLAINED_RESIDUAL: KindShown = KindShown {
    name: "unexplained-residual",
    letter: Some('?'),
    is_listed: false,
    about: About::Slope,
};

const EFFECT_FOUND: KindShown = KindShown {
    name: "effect-found",
    letter: Some('E'),
    is_listed: false,
    about: About::Slope,
};

const EFFECT_DROPPED: KindShown = KindShown {
    name: "effect-dropped",
    letter: Some('e'),
    is_listed: false,
    about: About::Slope,
};

const TOGETHER: KindShown = KindShown {
    name: "together",
    letter: None,
    is_listed: true,
    about: About::Slope,
};

const DECLARED: KindShown = KindShown {
    name: "declared",
    letter: Some('D'),
    is_listed: true,
    about: About::Slope,
};

impl KindShown {
    /// A refit after a reading.
    pub const REFIT: Self = Self {
        name: "refit",
        letter: None,
        is_listed: false,
        about: About::Slope,
    };

    /// A level begins or ends.
    pub const ALERT: Self = Self {
        name: "alert",
        letter: None,
        is_listed: true,
        about: About::Slope,
    };

    /// The monitor cannot rely on what it is given.
    pub const FAULT: Self = Self {
        name: "fault",
        letter: Some('F'),
        is_listed: true,
        about: About::Data,
    };

    /// Late or corrected readings would have called another level.
    pub const CORRECTION: Self = Self {
        name: "correction",
        letter: Some('C'),
        is_listed: true,
        about: About::Data,
    };

    /// People asked for something.
    pub const ORDER: Self = Self {
        name: "order",
        letter: Some('O'),
        is_listed: true,
        about: About::Slope,
    };

    /// The end of a replay.
    pub const SUMMARY: Self = Self {
        name: "summary",
        letter: None,
        is_listed: false,
        about: About::Slope,
    };
}

impl EventKind {
    /// Every kind, as it is shown.
    pub const SHOWN: [KindShown; 14] = [
        KindShown::REFIT,
        REGIME_FLIP,
        INTERCEPT_DRIFT,
        TRANSITION_DRIFT,
        UNEXPLAINED_RESIDUAL,
        EFFECT_FOUND,
        EFFECT_DROPPED,
        KindShown::ALERT,
        TOGETHER,
        KindShown::FAULT,
        DECLARED,
        KindShown::CORRECTION,
        KindShown::ORDER,
        KindShown::SUMMARY,
    ];

    /// Every word that [`EventKind::name`] may give.
    pub const NAMES: [&'static str; 14] = {
        let mut names = [""; 14];
        let mut place = 0;
        while place < names.len() {
            names[place] = Self::SHOWN[place].name;
            place += 1;
        }
        names
    };

    /// How it is shown.
    pub fn shown(&self) -> KindShown {
        match self {
            Self::Refit { .. } => KindShown::REFIT,
            Self::RegimeFlip { .. } => REGIME_FLIP,
            Self::InterceptDrift { .. } => INTERCEPT_DRIFT,
            Self::TransitionDrift { .. } => TRANSITION_DRIFT,
            Self::UnexplainedResidual(_) => UNEXPLAINED_RESIDUAL,
            Self::EffectFound { .. } => EFFECT_FOUND,
            Self::EffectDropped { .. } => EFFECT_DROPPED,
            Self::Alert { .. } => KindShown::ALERT,
            Self::Together { .. } => TOGETHER,
            Self::Fault { .. } => KindShown::FAULT,
            Self::Declared { .. } => DECLARED,
            Self::Correction { .. } => KindShown::CORRECTION,
            Self::Order { .. } => KindShown::ORDER,
            Self::Summary(_) => KindShown::SUMMARY,
        }
    }

    /// The word in its JSON.
    pub fn name(&self) -> &'static str {
        self.shown().name
    }

    /// Whether it says what has changed over the whole record, which only who has judged it knows.
    pub(super) fn is_of_the_record(&self) -> bool {
        self.shown().about == About::Record
    }

    /// Whether it is about the data, not about the slope.
    pub fn is_of_data(&self) -> bool {
        self.shown().about == About::Data
    }

    /// What happened, for a person, with times in UTC.
    pub fn sentence(&self) -> String {
        match self {
            Self::Refit {
                regime,
                failure_time,
                velocity_mm_per_day,
                ..
            } => {
                let velocity = velocity_mm_per_day.map_or_else(String::new, |velocity| {
                    format!(", {} mm/day", figure(velocity, 3))
                });
                let failure = forecast(failure_time);
                format!("refit: {}{velocity}, {failure}", regime.label)
            }
            Self::RegimeFlip {
                from,
                to,
                probability,
            } => format!(
                "regime flip: {from} to {to} (probability {})",
                percent_in_words(*probability)
            ),
            Self::InterceptDrift {
                from,
                to,
                drift_days_per_day,
                expected_days_per_day,
            } => {
                let expected = expected_days_per_day.map_or_else(String::new, |drift| {
                    format!("; the fitted law expects {drift:+.2}")
                });
                drift(
                    "inverse-velocity intercept",
                    *from,
                    *to,
                    *drift_days_per_day,
                ) + &expected
            }
            Self::TransitionDrift {
                from,
                to,
                drift_days_per_day,
            } => drift("transition time", *from, *to, *drift_days_per_day),
            Self::UnexplainedResidual(what) => unexplained(what),
            Self::EffectFound { .. } => effect_found(self),
            Self::EffectDropped { effect, channel } => format!(
                "effect dropped: {}; forecasts go without it",
                through(*effect, channel.as_deref())
            ),
            Self::Alert {
                level, state, text, ..
            } => {
                let state = match state {
                    AlertState::Firing => "firing",
                    AlertState::Resolved => "resolved",
                };
                format!("ALERT {level} {state}: {text}")
            }
            Self::Together { groups } => together(groups),
            Self::Fault { kind, text } => format!("fault {kind}: {text}"),
            Self::Declared { text, .. } => format!("declared: {text}"),
            Self::Correction { text, .. } => format!("correction: {text}"),
            Self::Order { .. } => ordered(self),
            Self::Summary(Summary {
                readings,
                refits,
                alerts,
            }) => format!("summary: {readings} readings, {refits} refits, {alerts} alerts"),
        }
    }
}

fn together(groups: &[SharedFailure]) -> String {
    if groups.is_empty() {
        return "no benchmarks share a failure time any more".to_owned();
    }
    let each = groups.iter().map(|group| {
        let names: Vec<&str> = group.benchmarks.iter().map(BenchmarkId::as_str).collect();
        let names = names.join(", ");
        format!("{names} share one: {}", forecast(&group.failure_time))
    });
    format!("failure times: {}", each.collect::<Vec<_>>().join("; "))
}

fn ordered(kind: &EventKind) -> String {
    let EventKind::Order {
        order,
        until,
        given,
        ..
    } = kind
    else {
        return String::new();
    };
    let until = until.map_or_else(String::new, |until| format!(" until {}", minute(until)));
    let by = (given.by.as_ref()).map_or_else(String::new, |by| format!(" by {by}"));
    let why = (given.why.as_ref()).map_or_else(String::new, |why| format!(": {why}"));
    let since = if given.called_since.is_empty() {
        String::new()
    } else {
        format!(
            "; not of what was called since: {}",
            given.called_since.join(", ")
        )
    };
    format!("{}{by}{until}{why}{since}", order.name())
}

fn unexplained(what: &Unexplained) -> String {
    match what {
        Unexplained::Reading {
            surprise_nats,
            velocity_mm_per_day,
        } => {
            let velocity = velocity_mm_per_day
                .map_or_else(String::new, |v| format!(", {} mm/day", figure(v, 3)));
            let decades = (surprise_nats * LOG10_E).floor();
            let how = if *surprise_nats > MOST_NATS || decades < 1.0 {
                "far".to_owned()
            } else {
                format!("over 10^{decades:.0} times")
            };
            format!("unexplained residual: {how} less likely than the usual reading{velocity}")
        }
        Unexplained::Structure {
            bic_gain,
            load_sd,
            since,
        } => format!(
            "unexplained residual since {}: as under a load of {load_sd:.2} e-folds of velocity (BIC {bic_gain:.0})",
            minute(*since)
        ),
    }
}

fn through(effect: Kind, channel: Option<&str>) -> String {
    channel.map_or_else(
        || effect.to_string(),
        |channel| format!("{effect} {channel}"),
    )
}

fn effect_found(kind: &EventKind) -> String {
    let EventKind::EffectFound {
        effect,
        channel,
        form,
        at,
        lag_days,
        bic_gain,
        p_value,
        cannot_separate_from,
        adopted,
        ..
    } = kind
    else {
        return String::new();
    };
    let form = form.map_or_else(String::new, |form| format!(" by its {}", form.name()));
    let at = at.map_or_else(String::new, |at| format!(" at {}", minute(at)));
    let lag = lag_days.map_or_else(String::new, |lag| format!(", {lag:.1} days later"));
    let p = p_value.map_or_else(String::new, |p| format!(", p {p:.3}"));
    let rivals = if cannot_separate_from.is_empty() {
        String::new()
    } else {
        format!(
            ", cannot be separated from {}",
            Rival::listed(cannot_separate_from)
        )
    };
    let use_of = if *adopted {
        "forecasts use it"
    } else {
        "forecasts go without it"
    };
    let name = through(*effect, channel.as_deref());
    format!(
        "effect found: consistent with {name}{form}{at}{lag} (BIC {bic_gain:.0}{p}{rivals}); {use_of}"
    )
}

fn drift(name: &str, from: Timestamp, to: Timestamp, days_per_day: f64) -> String {
    let (from, to) = (minute(from), minute(to));
    format!("{name} drifts: {from} to {to} ({days_per_day:+.2} days a day)")
}

fn forecast(failure: &FailureTime) -> String {
    let chance = percent_in_words(failure.probability);
    let horizon = failure.horizon_days;
    let bound = |time: Option<Timestamp>| time.map_or("later".to_owned(), minute);
    match failure.median.or(failure.low) {
        None => format!("no failure predicted ({chance} within {horizon:.0} days)"),
        Some(_) => format!(
            "failure {} ({} to {}, {chance} within {horizon:.0} days)",
            bound(failure.median),
            bound(failure.low),
            bound(failure.high)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_kind_has_a_row_of_its_own_and_the_name_that_its_json_has() {
        let schema = serde_json::to_value(schemars::schema_for!(EventKind)).unwrap();
        let kinds = schema["oneOf"].as_array().unwrap().iter();
        let tags: BTreeSet<String> = kinds
            .map(|kind| {
                let tag = &kind["properties"]["event"]["const"];
                tag.as_str().unwrap().to_owned()
            })
            .collect();
        let names: BTreeSet<String> = EventKind::NAMES.map(str::to_owned).into();
        assert_eq!((names.len(), &tags), (EventKind::NAMES.len(), &names));
        let letters = EventKind::SHOWN.iter().filter_map(|row| row.letter);
        let letters: Vec<char> = letters.collect();
        let distinct: BTreeSet<char> = letters.iter().copied().collect();
        assert_eq!(distinct.len(), letters.len());
    }
}

//! One explanation beside the truth: what was named rightly, and by how much its figures are off.

use super::drawn::Drawn;
use super::family::SceneFamily;
use super::truth::{TrueEffect, Truth};
use slipwatch::effects::{Cause, Effect, Explained, Explanation, Kind, Options, error_given};
use slipwatch::reading::{Timestamp, days_since};
use std::collections::BTreeSet;

/// How near the first effect named is to the truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Grade {
    /// The right kind, through the right channel where it has one.
    Right,
    WrongChannel,
    /// Another kind, but the right one stands under `cannot_separate_from`.
    LeftOpen,
    Wrong,
}

/// How one series went.
#[derive(Debug, Clone)]
pub(crate) struct Outcome {
    pub(crate) family: SceneFamily,
    pub(crate) name: String,
    /// The first effect named, or `none` or `unexplained`.
    pub(crate) called: Kind,
    /// Every effect named.
    pub(crate) said: BTreeSet<Kind>,
    /// Every effect there is.
    pub(crate) there: BTreeSet<Kind>,
    pub(crate) grade: Grade,
    /// |t0 said - t0 true| of the effects rightly named, in intervals of the sampling.
    pub(crate) at_errors: Vec<f64>,
    /// |said / true - 1| of their gains or sizes.
    pub(crate) size_errors: Vec<f64>,
    /// Held-out error after, over [`reference_error`].
    pub(crate) held_out: Option<f64>,
    pub(crate) seconds: f64,
}

impl Outcome {
    pub(crate) fn of(
        family: SceneFamily,
        name: &str,
        (drawn, explanation): (&Drawn, &Explanation),
        seconds: f64,
    ) -> Self {
        let truth = &drawn.truth;
        let named = named(explanation, truth);
        let said: BTreeSet<Kind> = named.iter().map(|one| one.effect).collect();
        let there = there(truth);
        let called = named
            .first()
            .map_or_else(|| left(explanation), |one| one.effect);
        let right_kind = is_right(family, called, &said, &there);
        let pairs = matched(&named, truth);
        let through_channel = |(said, there): &(&Effect, &TrueEffect)| {
            there.channel.is_none() || said.channel == there.channel
        };
        let separable = |kind: &Kind| {
            let rivals = &explanation.cannot_separate_from;
            rivals.iter().any(|rival| rival.kind == *kind)
        };
        let grade = match right_kind {
            true if pairs.iter().all(through_channel) => Grade::Right,
            true => Grade::WrongChannel,
            false if there.iter().any(separable) => Grade::LeftOpen,
            false => Grade::Wrong,
        };
        Self {
            family,
            name: name.to_owned(),
            called,
            grade,
            at_errors: pairs
                .iter()
                .filter_map(|pair| at_error(*pair, truth))
                .collect(),
            size_errors: pairs.iter().filter_map(|pair| size_error(*pair)).collect(),
            held_out: held_out(drawn, explanation),
            said,
            there,
            seconds,
        }
    }

    /// Whether the kind is right.
    pub(crate) fn right_kind(&self) -> bool {
        matches!(self.grade, Grade::Right | Grade::WrongChannel)
    }

    /// All that is there is named and nothing else.
    pub(crate) fn exactly(&self) -> bool {
        self.right_kind() && self.said == self.there
    }
}

/// What was accepted; noise that remembers is no discovery where it was put beside the family's effect.
fn named<'a>(explanation: &'a Explanation, truth: &Truth) -> Vec<&'a Effect> {
    std::iter::once(&explanation.verdict)
        .chain(&explanation.also)
        .filter(|one| !one.effect.is_an_end())
        .filter(|one| !(truth.background_noise_remembers && one.effect == Kind::CORRELATED_NOISE))
        .collect()
}

/// The honest end of an explanation that names nothing of the family.
fn left(explanation: &Explanation) -> Kind {
    let (called, explained) = (explanation.verdict.effect, explanation.explained);
    let is_noise = called == Kind::CORRELATED_NOISE && explained == Explained::Full;
    if called == Kind::NONE || is_noise {
        Kind::NONE
    } else {
        Kind::UNEXPLAINED
    }
}

fn there(truth: &Truth) -> BTreeSet<Kind> {
    let kinds = truth.effects.iter().map(|one| one.effect);
    kinds.filter(|kind| *kind != Kind::UNEXPLAINED).collect()
}

fn is_right(
    family: SceneFamily,
    called: Kind,
    said: &BTreeSet<Kind>,
    there: &BTreeSet<Kind>,
) -> bool {
    match family {
        SceneFamily::Of(kind) if kind == Kind::NONE => said.is_empty() && called == Kind::NONE,
        SceneFamily::Outside => said.is_empty() && called == Kind::UNEXPLAINED,
        SceneFamily::Mixed => there.contains(&called),
        SceneFamily::Of(kind) => there.contains(&called) && said.contains(&kind),
    }
}

/// Each true effect with the one of its kind that was named, the nearest in time where there are several.
fn matched<'a>(named: &[&'a Effect], truth: &'a Truth) -> Vec<(&'a Effect, &'a TrueEffect)> {
    let far = |one: &Effect, there: &TrueEffect| match (one.at, there.at) {
        (Some(said), Some(at)) => apart(said, at),
        _ => 0.0,
    };
    let nearest = |there: &'a TrueEffect| {
        let same = named
            .iter()
            .copied()
            .filter(|one| one.effect == there.effect);
        same.min_by(|one, other| far(one, there).total_cmp(&far(other, there)))
            .map(|said| (said, there))
    };
    truth.effects.iter().filter_map(nearest).collect()
}

fn apart(one: Timestamp, other: Timestamp) -> f64 {
    days_since(one, other).abs()
}

fn at_error((said, there): (&Effect, &TrueEffect), truth: &Truth) -> Option<f64> {
    Some(apart(said.at?, there.at?) / truth.interval_days)
}

fn size_error((said, there): (&Effect, &TrueEffect)) -> Option<f64> {
    let gains = said.gain_per_sd.zip(there.gain_per_sd);
    let (said, there) = gains.or_else(|| said.size.zip(there.size))?;
    Some((said / there - 1.0).abs())
}

fn held_out(drawn: &Drawn, explanation: &Explanation) -> Option<f64> {
    let after = explanation.error.held_out.after?;
    let from = explanation.error.held_out_from?;
    Some(after / reference_error(drawn, from)?)
}

/// The effects that are there as causes to be given to a law; none where no label fits the truth.
pub(crate) fn causes(truth: &Truth) -> Option<Vec<Cause>> {
    let label = |one: &TrueEffect| one.effect != Kind::UNEXPLAINED;
    let cause = |one: &TrueEffect| Cause {
        kind: one.effect,
        channel: one.channel.clone(),
        at: one.at,
    };
    let all = truth.effects.iter();
    all.clone().all(label).then(|| all.map(cause).collect())
}

/// What the held-out error is measured by: that of the law given the true effects, fitted to the same readings; none where
/// no label fits the truth.
fn reference_error(drawn: &Drawn, from: Timestamp) -> Option<f64> {
    let causes = causes(&drawn.truth)?;
    let (series, channels) = (&drawn.series, &drawn.channels);
    let options = Options::default();
    error_given(series, channels, &causes, Some(from), &options)?
        .held_out
        .after
}

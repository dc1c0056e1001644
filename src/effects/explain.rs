//! The way from a benchmark's readings to an explanation.

use super::channels::{ChannelCopy, distinct};
use super::daily::{self, has_daily_tide};
use super::explanation::{Candidate, Effect, Explained, Explanation, Fault, SettingsReport};
use super::faults::inspect;
use super::filled::has_gaps;
use super::findings::{Findings, findings};
use super::forms;
use super::kind::{FaultKind, Kind};
use super::options::Options;
use super::outlook::forecast_change;
use super::own_event::parted_by;
use super::partition::partition_candidate;
use super::ready::Ready;
use super::remarks;
use super::search::{SearchResult, Withheld};
use super::term::Scratch;
use super::upslope;
use super::verdict::conclude;
use crate::reading::{Channel, Series, Timestamp};
use fnv::FnvHasher;
use std::collections::BTreeSet;
use std::hash::Hasher as _;

/// Said where a gauge that acts has gaps while the readings went on.
const FILLED: &str = "What fell while the gauge had no values is fitted to the readings with all else: it is no evidence of the rain, and what happened there besides is not seen.";
const NOT_FILLED: &str = "While a covariate in the law has no values the usual one stands in for it: its size and its delay are less certain than their intervals say.";

/// Said of a record with which nothing can be tried.
pub const TOO_FEW: &str = "There are too few readings to distinguish anything from noise.";

/// So often at most a search is made again without the outliers that stand out of the law that the one before came to.
const LOOKED_AGAIN: usize = 2;

/// Explains `series` by what its law lacks, from `channels` beside it; `neighbours` are the other
/// benchmarks of the slope. `progress` is called with the share done, 0 to 1.
pub fn explain(
    series: &Series,
    channels: &[Channel],
    neighbours: &[&Series],
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> Explanation {
    explained_by(series, channels, options, |cleaned, channels, is_drawn| {
        let (findings, remarks) = look(cleaned, channels, is_drawn, options, progress);
        let parted = partition_candidate(cleaned, neighbours, options);
        let parted = by_own_event(&findings, parted, cleaned, neighbours, options);
        progress(1.0);
        (with_partition(findings, parted), remarks)
    })
}

/// The explanation that `look` comes to, of the readings and covariates without their faults; the second argument of it:
/// whether the values are not raw readings.
pub(super) fn explained_by(
    series: &Series,
    channels: &[Channel],
    options: &Options,
    mut look: impl FnMut(&Series, &[Channel], bool) -> (Findings, Vec<String>),
) -> Explanation {
    let data_hash = hash(series, channels);
    let (first, last) = (series.readings.first(), series.readings.last());
    let (first, last, readings) = (
        first.map(|reading| reading.time),
        last.map(|reading| reading.time),
        series.readings.len(),
    );
    let mut inspected = inspect(series, channels);
    let faulty = inspected.faults.iter().filter_map(|f| f.channel.clone());
    let (channels, mut copies) = distinct(
        std::mem::take(&mut inspected.channels),
        &faulty.collect::<Vec<_>>(),
    );
    copies.retain(|one| !is_said_of(one, &inspected.twins));
    let channels = channels.as_slice();
    let is_interpolated =
        |one: &Fault| one.kind == FaultKind::Interpolated && one.channel.is_none();
    let is_drawn = inspected.faults.iter().any(is_interpolated);
    let (mut findings, mut of_search) = look(&inspected.series, channels, is_drawn);
    for _ in 0..LOOKED_AGAIN {
        let residual = findings.curves.residual();
        if is_drawn || !inspected.take_out_beside_a_law(residual, findings.effects()) {
            break;
        }
        (findings, of_search) = look(&inspected.series, channels, is_drawn);
    }
    let series = &inspected.series;
    if inspected.is_newest_left_out && findings.verdict.effect == Kind::NONE {
        // The newest reading may be the beginning of a motion: that is not nothing.
        findings.verdict = Effect::of(Kind::UNEXPLAINED);
    }
    let critical = options.critical_velocity_mm_per_day;
    let forecast = forecast_change(series, channels, &findings.known_load, critical);
    let of_channels = remarks::of_channels(series, channels);
    let remarks = inspected.remarks.into_iter();
    let of_jumps = remarks::of_forward_jumps(findings.effects());
    Explanation {
        benchmark: series.benchmark.clone(),
        quantity: series.quantity(),
        unit: series.unit,
        readings,
        first,
        last,
        verdict: findings.verdict,
        explained: findings.explained,
        also: findings.also,
        given: Vec::new(),
        cannot_separate_from: findings.cannot_separate_from,
        faults: inspected.faults,
        error: findings.error,
        forecast,
        candidates: findings.candidates,
        flags: inspected.flags,
        remarks: remarks
            .chain(copies.iter().map(ChannelCopy::remark))
            .chain(of_channels)
            .chain(of_search)
            .chain(of_jumps)
            .collect(),
        residual: findings.residual,
        noise: findings.noise,
        settings: SettingsReport {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: options.seed,
            surrogates: options.surrogates,
            bic_margin: options.bic_margin,
            data_hash,
        },
        curves: findings.curves,
        known_load: findings.known_load,
    }
}

/// Whether it is said already that these two channels are alike.
fn is_said_of(one: &ChannelCopy, twins: &[(String, String)]) -> bool {
    let are_these = |(a, b): &(String, String)| {
        [a, b]
            .iter()
            .all(|name| **name == one.copy || **name == one.of)
    };
    twins.iter().any(are_these)
}

/// What the proportions of the benchmarks show of a partition, made good by what the law shows of this one: where they do
/// not show it, an event that its neighbours had not; where they do, the time of the event, which the law knows more nearly.
fn by_own_event(
    findings: &Findings,
    (mut found, candidate): (Option<Effect>, Option<Candidate>),
    series: &Series,
    neighbours: &[&Series],
    options: &Options,
) -> (Option<Effect>, Option<Candidate>) {
    let effects: Vec<&Effect> = findings.effects().collect();
    if let Some(partition) = &mut found {
        let within = |at: Timestamp| {
            let interval = partition.at_interval;
            interval.is_some_and(|[from, until]| (from..=until).contains(&at))
        };
        let events = effects
            .iter()
            .filter(|one| one.effect.is_event_of_the_ground());
        if let Some(at) = events.filter_map(|one| one.at).find(|at| within(*at)) {
            partition.at = Some(at);
        }
        return (found, candidate);
    }
    let own = (effects.as_slice(), &findings.curves);
    match parted_by(series, neighbours, own, options.bic_margin) {
        Some((partition, own)) => (Some(partition), Some(own)),
        None => (None, candidate),
    }
}

/// The findings with a partition among them: before what the readings of one benchmark alone look like.
fn with_partition(
    mut findings: Findings,
    (partition, candidate): (Option<Effect>, Option<Candidate>),
) -> Findings {
    findings.candidates.extend(candidate);
    let Some(partition) = partition else {
        return findings;
    };
    if findings.explained == Explained::None {
        findings.explained = Explained::Partly;
    }
    let own = std::mem::replace(&mut findings.verdict, partition);
    let nothing = own.effect.is_an_end();
    if !nothing && !own.effect.fits_any_bend() && !own.effect.is_of_the_reading() {
        let partition = std::mem::replace(&mut findings.verdict, own);
        findings.also.insert(0, partition);
    } else if !nothing {
        findings.also.insert(0, own);
    }
    findings
}

/// Searches for what the law lacks; with what is to be remarked of it. `is_drawn`: the values are not raw readings.
fn look(
    series: &Series,
    channels: &[Channel],
    is_drawn: bool,
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> (Findings, Vec<String>) {
    let mut scratch = Scratch::default();
    let mut remarks = Vec::new();
    let none = Findings::none(series.unit);
    let Some(mut ready) = Ready::of(series, channels, &mut remarks) else {
        remarks.push(TOO_FEW.to_owned());
        return (none, remarks);
    };
    if let Some(refused) = upslope::refused(&ready.problem, series.unit, &mut remarks) {
        return (refused, remarks);
    }
    progress(0.05);
    let search = ready.search(options, is_drawn);
    let Some(mut found) = search.run(ready.plain.clone(), progress) else {
        return (none, remarks);
    };
    if let Some((filled, better)) = with_gaps_filled(&ready, &found, (is_drawn, options), progress)
    {
        (ready, found) = (filled, better);
        remarks.push(FILLED.to_owned());
    } else if found
        .full
        .terms
        .iter()
        .any(|term| has_gaps(&ready.problem, &ready.drivers, term))
    {
        remarks.push(NOT_FILLED.to_owned());
    }
    let verdict = conclude(&ready, &mut found, options, &mut scratch);
    let withheld = found.withheld;
    if found.is_daily {
        remarks.push(daily::REMARK.to_owned());
    } else if has_daily_tide(&verdict.effects, &ready.problem) {
        remarks.push(daily::of_both(channels));
    }
    let findings = findings(&ready, found, verdict, options, &mut scratch);
    remarks.extend(forms::left_open(&findings, options.bic_margin));
    if !is_drawn {
        return (findings, remarks);
    }
    remarks.extend(withheld.map(|best| best.remark()));
    (without_conclusions(findings, withheld.is_some()), remarks)
}

/// The search made again with what fell in the gaps of a gauge as the law that was found fits it, where that is better by the margin and comes to the
/// same covariates.
fn with_gaps_filled(
    ready: &Ready,
    found: &SearchResult,
    (is_drawn, options): (bool, &Options),
    progress: &mut dyn FnMut(f64),
) -> Option<(Ready, SearchResult)> {
    let drivers = ready.search(options, is_drawn).filled(&found.full)?;
    let filled = Ready {
        drivers,
        ..ready.clone()
    };
    let search = filled.search(options, is_drawn);
    let better = search.run(filled.plain.clone(), progress)?;
    let channels = |of: &SearchResult| -> BTreeSet<usize> {
        let each = of.full.terms.iter();
        each.filter_map(|term| term.channel).collect()
    };
    let has_all = channels(&better).is_superset(&channels(found));
    has_all.then_some((filled, better))
}

/// Of values that are not raw readings no noise is concluded, nor that nothing is there where something was withheld.
fn without_conclusions(mut findings: Findings, has_withheld: bool) -> Findings {
    if findings.verdict.effect == Kind::CORRELATED_NOISE {
        findings.verdict = Effect::of(Kind::UNEXPLAINED);
        findings.explained = Explained::None;
    }
    findings
        .also
        .retain(|also| also.effect != Kind::CORRELATED_NOISE);
    if has_withheld && findings.verdict.effect == Kind::NONE {
        findings.verdict = Effect::of(Kind::UNEXPLAINED);
    }
    findings
}

impl Withheld {
    /// What they would show if they were readings.
    fn remark(&self) -> String {
        let at = self
            .at
            .map_or(String::new(), |at| at.strftime(" of %Y-%m-%d").to_string());
        format!(
            "If the values were readings, {}{at} would be what explains them best; they are not, and nothing is concluded.",
            self.kind
        )
    }
}

/// FNV-1a over every time and value.
fn hash(series: &Series, channels: &[Channel]) -> String {
    let mut hasher = FnvHasher::default();
    let mut update = |bits: u64| hasher.write(&bits.to_le_bytes());
    for reading in &series.readings {
        update(reading.time.as_microsecond().cast_unsigned());
        update(reading.value.to_bits());
    }
    for sample in channels.iter().flat_map(|channel| &channel.samples) {
        update(sample.time.as_microsecond().cast_unsigned());
        update(sample.value.to_bits());
    }
    format!("{:016x}", hasher.finish())
}

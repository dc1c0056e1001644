//! The way from a benchmark's readings to an explanation.

use super::explanation::{
    Candidate, Change, Curves, Effect, ErrorChange, Explained, Explanation, ForecastChange,
    NoiseReport, ResidualTests, SettingsReport,
};
use super::faults::{Inspected, inspect};
use super::fuller::Fuller;
use super::judge::is_label;
use super::kind::{FaultKind, Kind};
use super::outlook::forecast_change;
use super::partition::partition_candidate;
use super::ready::Ready;
use super::remarks;
use super::search::Withheld;
use super::tell::tell;
use super::term::Scratch;
use super::verdict::conclude;
use super::witnesses::distinct;
use crate::reading::{Channel, Series};

/// What is asked of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Passing this velocity is failure, mm/day.
    pub critical_velocity_mm_per_day: f64,
    /// Of the surrogates.
    pub seed: u64,
    /// How many surrogates judge a gain.
    pub surrogates: usize,
    /// The fall of the BIC that an effect must bring.
    pub bic_margin: f64,
    /// The share of the record held out at its end.
    pub held_out_share: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            critical_velocity_mm_per_day: 1000.0,
            seed: 1,
            surrogates: 399,
            bic_margin: 10.0,
            held_out_share: 1.0 / 3.0,
        }
    }
}

/// Explains `series` by what its law lacks, from `channels` beside it; `neighbours` are the other
/// benchmarks of the slope. `progress` hears the share done, 0 to 1.
pub fn explain(
    series: &Series,
    channels: &[Channel],
    neighbours: &[&Series],
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> Explanation {
    let mut explanation = blank(series, channels, options);
    let Inspected {
        series,
        channels,
        faults,
        flags,
        remarks,
    } = inspect(series, channels);
    let faulty: Vec<String> = faults.iter().filter_map(|f| f.channel.clone()).collect();
    let channels = distinct(channels, &faulty);
    let (series, channels) = (&series, channels.as_slice());
    explanation.remarks = remarks;
    explanation
        .remarks
        .extend(remarks::of_channels(series, channels));
    explanation.faults = faults;
    explanation.flags = flags;
    look(&mut explanation, (series, channels), options, progress);
    let critical = options.critical_velocity_mm_per_day;
    explanation.forecast = forecast_change(series, channels, &explanation.fuller, critical);
    part(
        &mut explanation,
        partition_candidate(series, neighbours, options),
    );
    progress(1.0);
    explanation
}

/// Takes a partition into the explanation: before what the readings of one benchmark alone look like.
fn part(explanation: &mut Explanation, found: (Option<Effect>, Option<Candidate>)) {
    explanation.candidates.extend(found.1);
    let Some(partition) = found.0 else { return };
    if explanation.explained == Explained::None {
        explanation.explained = Explained::Partly;
    }
    let own = std::mem::replace(&mut explanation.verdict, partition);
    let nothing = matches!(own.effect, Kind::Unexplained | Kind::None);
    if !nothing && !is_label(own.effect) && !own.effect.is_of_the_reading() {
        let partition = std::mem::replace(&mut explanation.verdict, own);
        explanation.also.insert(0, partition);
    } else if !nothing {
        explanation.also.insert(0, own);
    }
}

/// Searches for what the law lacks, and writes what was found into the explanation.
fn look(
    explanation: &mut Explanation,
    (series, channels): (&Series, &[Channel]),
    options: &Options,
    progress: &mut dyn FnMut(f64),
) {
    let mut scratch = Scratch::default();
    let Some(ready) = Ready::of(series, channels, &mut explanation.remarks) else {
        let few = "There are too few readings to tell anything from noise.";
        explanation.remarks.push(few.to_owned());
        return;
    };
    progress(0.05);
    let is_drawn = explanation
        .faults
        .iter()
        .any(|fault| fault.kind == FaultKind::Interpolated && fault.channel.is_none());
    let search = ready.search(options, is_drawn);
    if let Some(mut found) = search.run(ready.plain.clone(), progress) {
        let ground = (
            &ready.problem,
            ready.bank.as_slice(),
            ready.drivers.as_slice(),
        );
        let verdict = conclude(
            ground,
            series.unit,
            &mut found,
            (options.bic_margin, &mut scratch),
        );
        let withheld = found.withheld;
        tell(explanation, ground, (found, verdict), options, &mut scratch);
        if is_drawn {
            withhold(explanation, withheld);
        }
    }
}

/// Of values that are no readings no noise is concluded, and what they would show if they were readings is a remark.
fn withhold(explanation: &mut Explanation, best: Option<Withheld>) {
    if explanation.verdict.effect == Kind::CorrelatedNoise {
        explanation.verdict = Effect::of(Kind::Unexplained);
        explanation.explained = Explained::None;
    }
    explanation
        .also
        .retain(|also| also.effect != Kind::CorrelatedNoise);
    let Some(best) = best else { return };
    if explanation.verdict.effect == Kind::None {
        explanation.verdict = Effect::of(Kind::Unexplained);
    }
    let at = best
        .at
        .map_or(String::new(), |at| at.strftime(" of %Y-%m-%d").to_string());
    explanation.remarks.push(format!(
        "If the values were readings, {}{at} would be what explains them best; they are not, and nothing is concluded.",
        best.kind
    ));
}

/// Everything that is known before the search.
fn blank(series: &Series, channels: &[Channel], options: &Options) -> Explanation {
    Explanation {
        benchmark: series.benchmark.clone(),
        quantity: series.quantity(),
        unit: series.unit,
        readings: series.readings.len(),
        first: series.readings.first().map(|reading| reading.time),
        last: series.readings.last().map(|reading| reading.time),
        verdict: Effect::of(Kind::None),
        explained: Explained::None,
        also: Vec::new(),
        cannot_separate_from: Vec::new(),
        faults: Vec::new(),
        error: ErrorChange {
            unit: series.unit,
            fit: Change::default(),
            held_out: Change::default(),
            held_out_step: Change::default(),
            held_out_from: None,
            caveat: None,
        },
        forecast: ForecastChange::default(),
        candidates: Vec::new(),
        flags: Vec::new(),
        remarks: Vec::new(),
        residual: ResidualTests {
            runs: Change::default(),
            stoffer_toloi: Change::default(),
            undeclared_load_bic_gain: Change::default(),
            undeclared_load_sd: Change::default(),
            structure: Vec::new(),
        },
        noise: NoiseReport {
            white: 0.0,
            correlated: 0.0,
            memory_days: None,
        },
        settings: SettingsReport {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: options.seed,
            surrogates: options.surrogates,
            bic_margin: options.bic_margin,
            data_hash: hash(series, channels),
        },
        curves: Curves::default(),
        fuller: Fuller::default(),
    }
}

/// FNV-1a over every time and value.
fn hash(series: &Series, channels: &[Channel]) -> String {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut eat = |bits: u64| {
        for byte in bits.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for reading in &series.readings {
        eat(reading.time.as_microsecond().cast_unsigned());
        eat(reading.value.to_bits());
    }
    for sample in channels.iter().flat_map(|channel| &channel.samples) {
        eat(sample.time.as_microsecond().cast_unsigned());
        eat(sample.value.to_bits());
    }
    format!("{hash:016x}")
}

//! Rows that repeat earlier rows exactly, where chance would hardly have them equal.
//!
//! The information of a copy, in nats, is summed over its rows: of the first value by its resolution and
//! how densely the values lie there, of each further one by what usually follows the one before it,
//! and of the covariates of the same rows by how rare their values are.

use super::trace::{Trace, extreme, resolutions, symbols};
use std::collections::{BTreeMap, BTreeSet};

/// Expected number of such coincidences in the whole file, at most.
const CHANCE: f64 = 1e-3;
/// A value or block is looked at where it stands this often at most; what recurs is no copy.
const OCCURRENCES: usize = 3;
/// Longest block by which copies are looked for; longer ones contain one.
const LONGEST_KEY: usize = 64;
/// Where more rows than this repeat others, the series is periodic, not copied.
const PERIODIC: f64 = 0.2;
/// Rows this near to each other share their weather, which then says nothing of a copy.
const NEAR: usize = 10;
/// Share of a channel's values up to which one that stands in both rows counts as copied with them.
const RARE: f64 = 0.1;
/// Of the companions of a copied block this share agrees at least: a value may have been corrected.
const AGREE: f64 = 0.8;
/// How much what follows a value weighs its general frequency, in observations.
const BACKING: f64 = 1.0;

/// A block of rows and where it was copied from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Copied {
    /// First row of the original.
    pub older: usize,
    /// First row of the copy.
    pub newer: usize,
    /// How many rows.
    pub rows: usize,
}

/// A covariate at the rows of another trace: a symbol for its value, and the share of its values that
/// are the same.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Companion {
    symbols: Vec<Option<u32>>,
    shares: Vec<f64>,
    /// How often it agrees where the trace and the companions before it do, and of how many.
    agreeing: (f64, f64),
}

/// Finds the values of `channels` at exactly the times of `trace`.
pub(super) fn companions(channels: &[Trace], trace: &Trace) -> Vec<Companion> {
    let mut rows = symbols(&trace.values, extreme(&trace.values));
    let mut companions = Vec::with_capacity(channels.len());
    for channel in channels {
        let of_values = symbols(&channel.values, extreme(&channel.values));
        let counts = counted(&of_values);
        let share = |symbol: &Option<u32>| {
            let count = symbol.map_or(0, |symbol| counts[&symbol]);
            count.saturating_sub(2).max(1) as f64 / channel.len().max(1) as f64
        };
        let symbol = |time| Some(of_values[channel.times.binary_search(time).ok()?]);
        let symbols: Vec<Option<u32>> = trace.times.iter().map(symbol).collect();
        let together = rows.iter().zip(&symbols);
        let finer = ranked(&together.map(|(&a, &b)| (a, b)).collect::<Vec<_>>());
        companions.push(Companion {
            agreeing: agreeing(&rows, &finer),
            shares: symbols.iter().map(share).collect(),
            symbols,
        });
        rows = finer;
    }
    companions
}

/// Of the rows that repeat a key of `rows`, how many repeat that of `finer` too; of how many.
fn agreeing(rows: &[u32], finer: &[u32]) -> (f64, f64) {
    let repeats = |keys: &[u32]| keys.len() - counted(keys).len();
    (repeats(finer) as f64, repeats(rows) as f64)
}

impl Companion {
    /// Whether rows `a` and `b` have the same value, and one rare enough to have been copied.
    pub(super) fn is_copied(&self, a: usize, b: usize) -> bool {
        let is_same = self.symbols[a].is_some() && self.symbols[a] == self.symbols[b];
        is_same && self.shares[b] <= RARE
    }

    /// The information that rows `a` and `b` have the same value, where all before it are the same;
    /// `None` where it is not. A companion that always agrees adds nothing.
    fn information(&self, a: usize, b: usize) -> Option<f64> {
        if self.symbols[a]? != self.symbols[b]? {
            return None;
        }
        let general = self.shares[b];
        let (agreeing, all) = self.agreeing;
        // The pair at hand is no evidence of itself.
        let agreeing = (agreeing - 1.0).max(0.0) + BACKING * general;
        let given_others = agreeing / ((all - 1.0).max(0.0) + BACKING);
        Some(-given_others.max(general).min(1.0).ln())
    }
}

/// The blocks of rows that are copies of earlier ones.
pub(super) fn copied_rows(trace: &Trace, companions: &[Companion]) -> Vec<Copied> {
    if trace.len() < 4 {
        return Vec::new();
    }
    let language = Language::of(trace);
    let pairs = 0.5 * (trace.len() as f64).powi(2);
    let mut copies: Vec<Copied> = blocks(&language.values, companions)
        .into_iter()
        .filter(|copy| pairs * (-information(copy, &language, companions)).exp() < CHANCE)
        .collect();
    copies.sort_by_key(|copy| (copy.newer, copy.older));
    copies.dedup_by(|later, kept| later.newer < kept.newer + kept.rows);
    let rows: usize = copies.iter().map(|copy| copy.rows).sum();
    if rows as f64 > PERIODIC * trace.len() as f64 {
        copies.clear();
    }
    copies
}

fn information(copy: &Copied, language: &Language, companions: &[Companion]) -> f64 {
    let further: f64 = (1..copy.rows)
        .map(|row| language.information_of_next(copy.newer + row))
        .sum();
    language.first[copy.newer] + further + information_beside(copy, companions)
}

/// That of the companions. A row that was copied brings all of them along: where some differ, those that agree do so by chance.
fn information_beside(copy: &Copied, companions: &[Companion]) -> f64 {
    if copy.newer - copy.older <= NEAR {
        return 0.0;
    }
    let rows = (0..copy.rows).map(|row| (copy.older + row, copy.newer + row));
    let pairs = rows.flat_map(|rows| companions.iter().map(move |one| (one, rows)));
    let (mut sum, mut agree, mut all) = (0.0, 0.0, 0.0);
    for (one, (older, newer)) in pairs {
        if one.symbols[older].is_some() && one.symbols[newer].is_some() {
            all += 1.0;
        }
        if let Some(information) = one.information(older, newer) {
            agree += 1.0;
            sum += information;
        }
    }
    if agree >= AGREE * all { sum } else { 0.0 }
}

/// What values usually stand and follow in a trace.
struct Language {
    values: Vec<u32>,
    steps: Vec<u32>,
    /// Surprise of each value met without knowing the one before.
    first: Vec<f64>,
    of_values: Following,
    of_steps: Following,
}

impl Language {
    fn of(trace: &Trace) -> Self {
        let scale = extreme(&trace.values);
        let values = symbols(&trace.values, scale);
        // Differences carry the rounding of two values.
        let steps = symbols(&trace.increments(), 10.0 * scale);
        Self {
            first: first_information(trace, &values),
            of_values: Following::of(&values),
            of_steps: Following::of(&steps),
            values,
            steps,
        }
    }

    /// Surprise of the value at `row`, the one before it known: by values or by steps, whichever
    /// makes less of it. Rain returns to zero, and a level rests.
    fn information_of_next(&self, row: usize) -> f64 {
        let by_value = self
            .of_values
            .information(self.values[row - 1], self.values[row]);
        let by_step = if row >= 2 {
            self.of_steps
                .information(self.steps[row - 2], self.steps[row - 1])
        } else {
            f64::INFINITY
        };
        by_value.min(by_step)
    }
}

/// By the resolution of a value and how densely values lie about it, and by how often it stands
/// besides the copy and the original.
fn first_information(trace: &Trace, symbols: &[u32]) -> Vec<f64> {
    let count = trace.len();
    let counts = counted(symbols);
    let steps = resolutions(&trace.values);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| trace.values[a].total_cmp(&trace.values[b]));
    let reach = (count / 20).clamp(3, 50);
    let mut information = vec![0.0; count];
    for (place, &row) in order.iter().enumerate() {
        let low = place.saturating_sub(reach);
        let high = (place + reach).min(count - 1);
        let width = trace.values[order[high]] - trace.values[order[low]];
        let within = (high - low) as f64 * steps[row] / width.max(steps[row]);
        let others = counts[&symbols[row]].saturating_sub(2) as f64;
        information[row] = -(within.max(others) / count as f64).min(1.0).ln();
    }
    information
}

/// How often each symbol follows each.
struct Following {
    total: f64,
    single: BTreeMap<u32, usize>,
    pairs: BTreeMap<(u32, u32), usize>,
    /// How many different symbols follow each.
    different: BTreeMap<u32, usize>,
}

impl Following {
    fn of(symbols: &[u32]) -> Self {
        let mut pairs = BTreeMap::new();
        for pair in symbols.windows(2) {
            *pairs.entry((pair[0], pair[1])).or_insert(0) += 1;
        }
        let mut different = BTreeMap::new();
        for (before, _) in pairs.keys() {
            *different.entry(*before).or_insert(0) += 1;
        }
        Self {
            total: symbols.len() as f64,
            single: counted(symbols),
            pairs,
            different,
        }
    }

    /// Without the two occurrences that are the original and the copy themselves. As much weight as the number of different symbols that follow goes to
    /// those that did not follow yet (Witten and Bell 1991): after a dry day nearly every wet one is new, and none is surprising for that.
    fn information(&self, before: u32, after: u32) -> f64 {
        let besides =
            |count: Option<&usize>| count.map_or(0, |count| count.saturating_sub(2)) as f64;
        let general = besides(self.single.get(&after)).max(1.0) / self.total;
        let together = besides(self.pairs.get(&(before, after)));
        let alone = besides(self.single.get(&before));
        let pair = self.pairs.get(&(before, after)).copied().unwrap_or(0);
        let different = self.different.get(&before).copied().unwrap_or(0);
        let different = different.saturating_sub(usize::from(pair <= 2)).max(1) as f64;
        -((together + different * general) / (alone + different))
            .min(1.0)
            .ln()
    }
}

fn counted(symbols: &[u32]) -> BTreeMap<u32, usize> {
    let mut counts = BTreeMap::new();
    for &symbol in symbols {
        *counts.entry(symbol).or_insert(0) += 1;
    }
    counts
}

/// The longest blocks of equal values, looked for by rare values, rare runs of values, and rare rows.
fn blocks(values: &[u32], companions: &[Companion]) -> Vec<Copied> {
    let mut candidates = BTreeSet::new();
    let mut keys = values.to_vec();
    let mut length = 1;
    while length <= LONGEST_KEY && !keys.is_empty() {
        collect_rare(&keys, &mut candidates);
        let longer = keys.iter().zip(keys.iter().skip(length));
        keys = ranked(&longer.map(|(&a, &b)| (a, b)).collect::<Vec<_>>());
        length *= 2;
    }
    let mut rows = values.to_vec();
    for companion in companions {
        let beside = rows.iter().zip(&companion.symbols);
        rows = ranked(&beside.map(|(&a, &b)| (a, b)).collect::<Vec<_>>());
    }
    collect_rare(&rows, &mut candidates);
    // A block found by many keys is extended once: each diagonal remembers how far it is known.
    let mut known: BTreeMap<usize, usize> = BTreeMap::new();
    let mut blocks = Vec::new();
    for (older, newer) in candidates {
        let end = known.entry(newer - older).or_insert(0);
        if newer >= *end {
            let block = extended(values, older, newer);
            *end = block.newer + block.rows;
            blocks.push(block);
        }
    }
    blocks
}

fn ranked<T: Ord>(keys: &[T]) -> Vec<u32> {
    let mut order: Vec<usize> = (0..keys.len()).collect();
    order.sort_by(|&a, &b| keys[a].cmp(&keys[b]));
    let mut ranks = vec![0; keys.len()];
    let mut rank = 0;
    for pair in order.windows(2) {
        rank += u32::from(keys[pair[0]] != keys[pair[1]]);
        ranks[pair[1]] = rank;
    }
    ranks
}

/// Pairs of places with the same key, for keys that stand two or three times.
fn collect_rare(keys: &[u32], candidates: &mut BTreeSet<(usize, usize)>) {
    let mut order: Vec<usize> = (0..keys.len()).collect();
    order.sort_by_key(|&place| (keys[place], place));
    for group in order.chunk_by(|&a, &b| keys[a] == keys[b]) {
        if (2..=OCCURRENCES).contains(&group.len()) {
            candidates.extend(group.windows(2).map(|pair| (pair[0], pair[1])));
        }
    }
}

/// The block of equal values about one pair of rows, the copy clear of the original.
fn extended(values: &[u32], older: usize, newer: usize) -> Copied {
    let apart = newer - older;
    let mut before = 0;
    while before < older
        && before + 1 < apart
        && values[older - before - 1] == values[newer - before - 1]
    {
        before += 1;
    }
    let mut after = 1;
    while newer + after < values.len()
        && before + after < apart
        && values[older + after] == values[newer + after]
    {
        after += 1;
    }
    Copied {
        older: older - before,
        newer: newer - before,
        rows: before + after,
    }
}

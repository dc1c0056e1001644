//! Learns how the panel weighs its members, on simulated slopes alone: `learn [SLOPES]` writes
//! src/forecast/learned.rs.
//!
//! Lives are those of `Corpus::TRAINING`, which no scorecard uses. Each is looked at at the scored leads and evenly over its
//! record; the weights are those of least CRPS, each taken over the time that was left, and the recalibration is the
//! distribution of where in the mixture the failures came.

#![expect(clippy::print_stderr, reason = "progress is what it prints")]

mod descent;
mod looks;

use descent::Batch;
use looks::Look;
use slipwatch::forecast::{Corpus, LEVELS, SITUATIONS, Weighing, situation};
use std::fmt::Write as _;

/// A failure is forecast with this probability at least where it teaches when.
const LEAST_CHANCE: f64 = 0.3;
/// Forecasts that each situation starts with, spread evenly, so that few cannot decide.
const EVEN: f64 = 10.0;

fn main() -> anyhow::Result<()> {
    let count = std::env::args().nth(1);
    let count = count.map_or(Ok(Corpus::LIVES), |text| text.parse())?;
    let looks = looks::all(count);
    eprintln!("{} looks at {count} simulated slopes", looks.len());
    let batch = Batch::of(&looks);
    let (gates, harshness) = batch.least_crps();
    let mut weighing = Weighing {
        gates,
        harshness,
        recalibration: [std::array::from_fn(even); SITUATIONS],
    };
    weighing.recalibration = recalibration(&looks, &weighing);
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/src/forecast/learned.rs");
    std::fs::write(file, source(&weighing, count)?)?;
    eprintln!("wrote {file}");
    Ok(())
}

fn even(level: usize) -> f64 {
    level as f64 / (LEVELS - 1) as f64
}

/// The share of failures by each level of the mixture, in each situation; a look counts for the two nearest.
fn recalibration(looks: &[Look], weighing: &Weighing) -> [[f64; LEVELS]; SITUATIONS] {
    let mut counts = [[0.0; LEVELS]; SITUATIONS];
    let mut totals = [0.0; SITUATIONS];
    for look in looks.iter().filter(|look| look.failed) {
        let times = weighing.mixture(&look.members);
        let total: f64 = times.iter().map(|(_, share)| share).sum();
        if total < LEAST_CHANCE {
            continue;
        }
        let within = times.iter().take_while(|(days, _)| *days <= look.remaining);
        let level = within.map(|(_, share)| share).sum::<f64>() / total;
        let at = situation(&times, total, look.members.interval_days);
        for knot in 0..SITUATIONS {
            let weight = total * (1.0 - (at - knot as f64).abs()).max(0.0);
            totals[knot] += weight;
            for (index, count) in counts[knot].iter_mut().enumerate() {
                *count += if level <= even(index) { weight } else { 0.0 };
            }
        }
    }
    for (levels, total) in counts.iter_mut().zip(totals) {
        for (index, count) in levels.iter_mut().enumerate() {
            *count = (*count + EVEN * even(index)) / (total + EVEN);
        }
        (levels[0], levels[LEVELS - 1]) = (0.0, 1.0);
    }
    counts
}

/// The file that holds what was learnt.
fn source(weighing: &Weighing, count: u64) -> anyhow::Result<String> {
    let mut text = format!(
        "//! What the panel has learnt on {count} simulated slopes: written by `cargo run --release --example learn`.\n\
         #![allow(clippy::approx_constant, reason = \"a learnt figure may come near to a constant\")]\n\n\
         use super::members::{{FEATURES, MEMBERS}};\n\
         use super::weighing::{{LEVELS, SITUATIONS, Weighing}};\n\n\
         /// Of each member but the law: its window's line, and last the one that says the slope will stand.\n\
         const GATES: [[f64; FEATURES]; MEMBERS - 1] = [\n"
    );
    for gate in &weighing.gates {
        writeln!(text, "    {},", row(gate))?;
    }
    text.push_str(
        "];\n\n/// The share of failures by each level, a row for each situation.\n\
         const RECALIBRATION: [[f64; LEVELS]; SITUATIONS] = [\n",
    );
    for levels in &weighing.recalibration {
        writeln!(text, "    {},", row(levels))?;
    }
    write!(
        text,
        "];\n\n/// The weighing in force.\npub const LEARNED: Weighing = Weighing {{\n    gates: GATES,\n    \
         harshness: {:.3},\n    recalibration: RECALIBRATION,\n}};\n",
        weighing.harshness
    )?;
    Ok(text)
}

fn row(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().map(|value| format!("{value:.4}")).collect();
    format!("[{}]", values.join(", "))
}

//! Learns how the panel weighs its members, on simulated slopes alone: `learn [SLOPES]` writes
//! src/forecast/learned.rs.
//!
//! Lives are those of `Corpus::TRAINING`, which no scorecard uses. Each is looked at at the scored leads and evenly over its
//! record; the weights are those of least CRPS, each taken over the time that was left, and the recalibration is how
//! often each probability came true.

#![expect(clippy::print_stderr, reason = "progress is what it prints")]

mod descent;
mod looks;

use descent::Batch;
use looks::Look;
use slipwatch::forecast::{Corpus, LEVELS, SITUATIONS, Weighing, situation};
use std::fmt::Write as _;

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

/// How often a failure had come by the time at which the mixture gave it each probability, among the looks that gave
/// it at all, in each situation; a look counts for the two nearest. What stood until its record ended never failed.
fn recalibration(looks: &[Look], weighing: &Weighing) -> [[f64; LEVELS]; SITUATIONS] {
    let mut came = [[0.0; LEVELS]; SITUATIONS];
    let mut given = [[0.0; LEVELS]; SITUATIONS];
    for look in looks {
        let times = weighing.mixture(&look.members);
        let total: f64 = times.iter().map(|(_, share)| share).sum();
        if total <= 0.0 {
            continue;
        }
        let within = times.iter().take_while(|(days, _)| *days <= look.remaining);
        let by_then: f64 = within.map(|(_, share)| share).sum();
        let level = if look.failed { by_then } else { f64::INFINITY };
        let at = situation(&times, total, look.members.interval_days);
        for knot in 0..SITUATIONS {
            let weight = (1.0 - (at - knot as f64).abs()).max(0.0);
            for index in (0..LEVELS).filter(|index| even(*index) <= total) {
                given[knot][index] += weight;
                came[knot][index] += if level <= even(index) { weight } else { 0.0 };
            }
        }
    }
    for (came, given) in came.iter_mut().zip(given) {
        let mut highest: f64 = 0.0;
        for (index, share) in came.iter_mut().enumerate() {
            let often = (*share + EVEN * even(index)) / (given[index] + EVEN);
            highest = highest.max(often);
            *share = highest;
        }
        came[0] = 0.0;
    }
    came
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
        "];\n\n/// How often a failure had come by the time at which it was given each probability, a row for each situation.\n\
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

//! Outliers that only a law shows: where the slope moves fast, the readings beside one lie as far apart as it lies from them.

use super::outlier::outlying_readings;
use super::trace::Trace;
use super::{FaultBench, Inspected, Source, remarks};
use crate::effects::explanation::{Effect, Fault};
use crate::effects::kind::{FaultKind, Kind};
use crate::reading::{Quantity, Timestamp};

/// Two jumps of the reading no further apart than this many readings, of which one takes back at least half of the other, are what lies between them.
const BETWEEN: usize = 3;
const TAKES_BACK: f64 = 0.5;

impl Inspected {
    /// Takes out what stands out of its neighbours in `residual`, the readings less a law, one a reading, and what lies between two of `effects` that are
    /// jumps of the reading there and back; whether there was any. Of velocities nothing: they rise and come back in earnest.
    pub(in crate::effects) fn take_out_beside_a_law<'a>(
        &mut self,
        residual: Vec<f64>,
        effects: impl Iterator<Item = &'a Effect>,
    ) -> bool {
        let trace = Trace::of_series(&self.series);
        if self.series.quantity() == Quantity::Velocity || residual.len() != trace.len() {
            return false;
        }
        let left = Trace {
            values: residual,
            ..trace.clone()
        };
        let mut wrong = outlying_readings(&left, Quantity::Displacement);
        // What the first reading is, nothing before it shows.
        wrong[0] = false;
        for rows in there_and_back(&trace.times, effects) {
            wrong[rows].fill(true);
        }
        if !wrong.contains(&true) {
            return false;
        }
        let mut bench = FaultBench {
            series: self.series.clone(),
            channels: Vec::new(),
            natures: Vec::new(),
            faults: Vec::new(),
            twins: Vec::new(),
        };
        bench.take_out_marked(FaultKind::Outlier, Source::Benchmark, &trace, &wrong);
        let found: Vec<&Fault> = bench.faults.iter().collect();
        self.remarks.push(remarks::beside_a_law(&found));
        self.series = bench.series;
        self.faults.extend(bench.faults);
        self.faults.sort_by_key(|fault| fault.at);
        self.flags = remarks::flags(&self.faults);
        true
    }
}

/// The readings between each jump and the next that takes it back.
fn there_and_back<'a>(
    times: &[Timestamp],
    effects: impl Iterator<Item = &'a Effect>,
) -> Vec<std::ops::Range<usize>> {
    let jumps = effects.filter(|one| one.effect == Kind::OFFSET);
    let place = |at: Timestamp| times.partition_point(|time| *time < at);
    let mut jumps: Vec<(usize, f64)> = jumps
        .filter_map(|one| Some((place(one.at?), one.size?)))
        .collect();
    jumps.sort_by_key(|(from, _)| *from);
    let pairs = jumps.windows(2).map(|pair| (pair[0], pair[1]));
    let back = pairs.filter(|((from, there), (until, back))| {
        let (small, large) = (there.abs().min(back.abs()), there.abs().max(back.abs()));
        until - from <= BETWEEN && there * back < 0.0 && small >= TAKES_BACK * large
    });
    back.map(|((from, _), (until, _))| from..until).collect()
}

//! What is wrong with the data themselves: found, named and taken out before any effect is looked for.
//!
//! In this order, since each needs what the ones before it have cleaned: codes and impossible values, changes of the unit,
//! copied rows, stuck values, outliers, resets of covariates; and last whether what is left is any
//! instrument's. A jump of the benchmark's own reading is left in it: that is an effect (`offset`).

mod after_law;
mod codes;
mod copies;
mod nature;
mod outlier;
mod remarks;
mod reset;
mod smooth;
mod stuck;
mod trace;
mod twin;
mod unit_slip;

use super::explanation::Fault;
use super::kind::FaultKind;
use crate::effects::quantiles::median;
use crate::reading::{Channel, RunningTotal, Series, Timestamp, days_since};
use copies::Copied;
use nature::Nature;
use reset::ChannelReset;
use smooth::Smoothness;
use std::ops::Range;
use trace::Trace;

pub use codes::is_code;
pub(super) use trace::resolution;

/// Readings and covariates without the faults that were found in them.
#[derive(Debug, Clone, PartialEq)]
pub struct Inspected {
    /// The readings, faulty rows taken out.
    pub series: Series,
    /// The covariates in the order given, codes taken out, resets corrected.
    pub channels: Vec<Channel>,
    /// What was found, by time.
    pub faults: Vec<Fault>,
    /// The kinds found, in short: `interpolated` only where it is the readings that are,
    /// `covariate-reset` for a reset.
    pub flags: Vec<String>,
    /// The same for people, a sentence each.
    pub remarks: Vec<String>,
    /// Whether the newest reading is left out until more is read: it left all before it at once.
    pub(super) is_newest_left_out: bool,
    /// Channels that are one instrument: the one with resets, and the other.
    pub(super) twins: Vec<(String, String)>,
}

/// Looks for faults of the data in `series` and in each of `channels`, and takes out what can be.
pub fn inspect(series: &Series, channels: &[Channel]) -> Inspected {
    let mut bench = FaultBench {
        series: series.clone(),
        natures: channels.iter().map(Nature::of).collect(),
        channels: channels.to_vec(),
        faults: Vec::new(),
        twins: Vec::new(),
    };
    bench.take_out_codes();
    bench.take_out_unit_slips();
    bench.take_out_copies();
    bench.take_out_stuck();
    bench.take_out_outliers();
    bench.take_out_resets();
    let smoothness = bench.find_interpolated();
    bench.faults.sort_by(|a, b| {
        let key = |fault: &Fault| (fault.at, fault.channel.clone(), fault.kind);
        key(a).cmp(&key(b))
    });
    let of_newest = bench.leave_out_newest_alone();
    Inspected {
        is_newest_left_out: of_newest.is_some(),
        flags: remarks::flags(&bench.faults),
        remarks: remarks::remarks(&bench.faults, smoothness, &bench.twins)
            .into_iter()
            .chain(of_newest)
            .collect(),
        series: bench.series,
        channels: bench.channels,
        faults: bench.faults,
        twins: bench.twins,
    }
}

/// Whose values are meant: the benchmark's, or those of the channel of that index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Source {
    Benchmark,
    Channel(usize),
}

/// Data from which faults are removed one after another.
struct FaultBench {
    series: Series,
    channels: Vec<Channel>,
    natures: Vec<Nature>,
    faults: Vec<Fault>,
    /// Channels that are one instrument: the one with resets, and the other.
    twins: Vec<(String, String)>,
}

impl FaultBench {
    fn sources(&self) -> Vec<Source> {
        let channels = (0..self.channels.len()).map(Source::Channel);
        [Source::Benchmark].into_iter().chain(channels).collect()
    }

    fn trace(&self, source: Source) -> Trace {
        match source {
            Source::Benchmark => Trace::of_series(&self.series),
            Source::Channel(index) => Trace::of_channel(&self.channels[index]),
        }
    }

    /// Takes the marked rows out.
    fn drop_rows(&mut self, source: Source, wrong: &[bool]) {
        let mut wrong = wrong.iter();
        let mut is_right = || !wrong.next().is_some_and(|wrong| *wrong);
        match source {
            Source::Benchmark => self.series.readings.retain(|_| is_right()),
            Source::Channel(index) => self.channels[index].samples.retain(|_| is_right()),
        }
    }

    /// A fault of `kind` in these rows, with nothing more said.
    fn fault(&self, kind: FaultKind, source: Source, trace: &Trace, rows: &Range<usize>) -> Fault {
        let channel = match source {
            Source::Benchmark => None,
            Source::Channel(index) => Some(&self.channels[index]),
        };
        let unit = match channel {
            None => Some(self.series.unit.to_string()),
            Some(channel) => channel.unit.clone(),
        };
        Fault {
            kind,
            channel: channel.map(|channel| channel.name.clone()),
            at: trace.times[rows.start],
            until: (rows.len() > 1).then(|| trace.times[rows.end - 1]),
            size: None,
            unit,
            values: rows.len(),
            copy_of: None,
        }
    }

    fn take_out_codes(&mut self) {
        for source in self.sources() {
            let nature = match source {
                Source::Benchmark => None,
                Source::Channel(index) => Some(self.natures[index]),
            };
            let trace = self.trace(source);
            let wrong = codes::out_of_range(&trace, nature);
            self.take_out_marked(FaultKind::OutOfRange, source, &trace, &wrong);
        }
    }

    /// Names each change of the readings' unit, and gives what follows in the unit before it.
    fn take_out_unit_slips(&mut self) {
        let trace = self.trace(Source::Benchmark);
        for slip in unit_slip::unit_slips(&trace) {
            let rows = slip.from..trace.len();
            let mut fault = self.fault(FaultKind::UnitSlip, Source::Benchmark, &trace, &rows);
            (fault.size, fault.unit) = (Some(slip.times), None);
            self.faults.push(fault);
            for reading in &mut self.series.readings[rows] {
                reading.value /= slip.times;
                reading.sigma = reading.sigma.map(|sigma| sigma / slip.times);
            }
        }
    }

    fn take_out_outliers(&mut self) {
        for source in self.sources() {
            let trace = self.trace(source);
            let wrong = match source {
                Source::Benchmark => outlier::outlying_readings(&trace, self.series.quantity()),
                Source::Channel(index) => outlier::outlying_samples(&trace, self.natures[index]),
            };
            self.take_out_marked(FaultKind::Outlier, source, &trace, &wrong);
        }
    }

    /// Names each stretch of marked rows, its first value as the size, and takes it out.
    fn take_out_marked(&mut self, kind: FaultKind, source: Source, trace: &Trace, wrong: &[bool]) {
        let mut start = 0;
        for stretch in wrong.chunk_by(|a, b| a == b) {
            let rows = start..start + stretch.len();
            start = rows.end;
            if stretch[0] {
                let mut fault = self.fault(kind, source, trace, &rows);
                fault.size = Some(trace.values[rows.start]);
                self.faults.push(fault);
            }
        }
        self.drop_rows(source, wrong);
    }

    fn take_out_copies(&mut self) {
        self.take_out_copied_readings();
        for source in self.sources().into_iter().skip(1) {
            let trace = self.trace(source);
            if self.is_running_total(source, &trace) {
                continue;
            }
            let copies = copies::copied_rows(&trace, &[]);
            self.take_out_copied(source, &trace, &copies);
        }
    }

    /// Whether it is rain as a running total: on dry days that repeats itself.
    fn is_running_total(&self, source: Source, trace: &Trace) -> bool {
        let is_rain = matches!(source, Source::Channel(index) if self.natures[index].is_rain());
        is_rain && RunningTotal::of(&trace.values).is_some()
    }

    /// The copied rows of the benchmark, and of each channel the values that were copied with them.
    fn take_out_copied_readings(&mut self) {
        let trace = self.trace(Source::Benchmark);
        let channels: Vec<Trace> = self.channels.iter().map(Trace::of_channel).collect();
        let companions = copies::companions(&channels, &trace);
        let copies = copies::copied_rows(&trace, &companions);
        for (index, companion) in companions.iter().enumerate() {
            let mut copied: Vec<Timestamp> = Vec::new();
            for copy in &copies {
                let pairs = (0..copy.rows).map(|row| (copy.older + row, copy.newer + row));
                let same = pairs.filter(|&(older, newer)| companion.is_copied(older, newer));
                copied.extend(same.map(|(_, newer)| trace.times[newer]));
            }
            let is_copied = |time: &Timestamp| copied.binary_search(time).is_ok();
            let wrong: Vec<bool> = channels[index].times.iter().map(is_copied).collect();
            self.drop_rows(Source::Channel(index), &wrong);
        }
        self.take_out_copied(Source::Benchmark, &trace, &copies);
    }

    fn take_out_copied(&mut self, source: Source, trace: &Trace, copies: &[Copied]) {
        let mut wrong = vec![false; trace.len()];
        for copy in copies {
            let rows = copy.newer..copy.newer + copy.rows;
            let mut fault = self.fault(FaultKind::RepeatedRows, source, trace, &rows);
            fault.size = (copy.rows == 1).then(|| trace.values[copy.newer]);
            fault.copy_of = Some(trace.times[copy.older]);
            self.faults.push(fault);
            wrong[rows].fill(true);
        }
        self.drop_rows(source, &wrong);
    }

    /// Keeps the first value of each stuck run, which may have been measured.
    fn take_out_stuck(&mut self) {
        for source in self.sources() {
            if let Source::Channel(index) = source
                && self.natures[index].is_rain()
            {
                continue;
            }
            let trace = self.trace(source);
            let mut wrong = vec![false; trace.len()];
            for run in stuck::stuck_runs(&trace) {
                let mut fault = self.fault(FaultKind::Stuck, source, &trace, &run);
                fault.size = Some(trace.values[run.start]);
                self.faults.push(fault);
                wrong[run.start + 1..run.end].fill(true);
            }
            self.drop_rows(source, &wrong);
        }
    }

    /// First what two channels say of each other, then what each shows by itself, then what another
    /// channel's reset makes likely.
    fn take_out_resets(&mut self) {
        self.take_out_resets_of_twins();
        let mut found: Vec<(usize, Vec<ChannelReset>)> = Vec::new();
        for index in 0..self.channels.len() {
            let trace = self.trace(Source::Channel(index));
            let resets = reset::resets(&trace, self.natures[index]);
            if !resets.is_empty() {
                found.push((index, resets));
            }
        }
        for (index, resets) in found {
            self.take_out_resets_of(index, &resets);
        }
        let is_reset = |fault: &&Fault| fault.kind == FaultKind::Reset;
        let known: Vec<Timestamp> = self.faults.iter().filter(is_reset).map(|f| f.at).collect();
        for index in 0..self.channels.len() {
            for &at in &known {
                self.take_out_reset_beside(index, at);
            }
        }
    }

    /// A logger was in hand at `at`: were this channel's values shifted too?
    fn take_out_reset_beside(&mut self, index: usize, at: Timestamp) {
        let trace = self.trace(Source::Channel(index));
        let Some(first) = trace.times.first() else {
            return;
        };
        let day = days_since(*first, at);
        if let Some(reset) = reset::reset_near(&trace, self.natures[index], day)
            && !self.is_reset_near(index, at)
        {
            self.take_out_resets_of(index, &[reset]);
        }
    }

    fn is_reset_near(&self, index: usize, at: Timestamp) -> bool {
        let interval = median(&self.trace(Source::Channel(index)).intervals());
        self.faults.iter().any(|fault| {
            fault.kind == FaultKind::Reset
                && fault.channel.as_ref() == Some(&self.channels[index].name)
                && days_since(fault.at, at).abs() <= 2.0 * interval
        })
    }

    fn take_out_resets_of_twins(&mut self) {
        let mut done = vec![false; self.channels.len()];
        for first in 0..self.channels.len() {
            for second in first + 1..self.channels.len() {
                let [a, b] = [first, second].map(|index| &self.channels[index]);
                if done[first] || done[second] || a.unit != b.unit {
                    continue;
                }
                let traces = [first, second].map(|index| self.trace(Source::Channel(index)));
                let Some(twins) = twin::twins(&traces[0], &traces[1]) else {
                    continue;
                };
                let (jumping, other, resets) = if twins.first_jumps {
                    (first, second, twins.of_first)
                } else {
                    (second, first, twins.of_second)
                };
                let name = |index: usize| self.channels[index].name.clone();
                self.twins.push((name(jumping), name(other)));
                self.take_out_resets_of(jumping, &resets);
                done[jumping] = true;
            }
        }
    }

    /// Names the resets of a channel and shifts what follows each back to the zero before.
    fn take_out_resets_of(&mut self, index: usize, resets: &[ChannelReset]) {
        let source = Source::Channel(index);
        let trace = self.trace(source);
        for (place, reset) in resets.iter().enumerate() {
            let next = resets.get(place + 1).map_or(trace.len(), |next| next.from);
            let instant = reset.from..reset.from + 1;
            let mut fault = self.fault(FaultKind::Reset, source, &trace, &instant);
            // What has to be added to all that follows, as a visit's log has it.
            fault.size = Some(-reset.size);
            fault.values = next - reset.from;
            self.faults.push(fault);
        }
        let (values, straddles) = reset::corrected(&trace.values, resets);
        for (sample, value) in self.channels[index].samples.iter_mut().zip(values) {
            sample.value = value;
        }
        self.drop_rows(source, &straddles);
    }

    /// What is to be said of a newest reading that stands far from those before it, and is left out.
    fn leave_out_newest_alone(&mut self) -> Option<String> {
        let trace = self.trace(Source::Benchmark);
        let off = outlier::newest_alone(&trace)?;
        let at = trace.times.last()?;
        self.series.readings.pop();
        Some(remarks::of_newest(*at, off, self.series.unit))
    }

    /// Names what no instrument can have measured; it stays, since there is nothing else.
    fn find_interpolated(&mut self) -> Option<Smoothness> {
        let trace = self.trace(Source::Benchmark);
        let smoothness = smooth::smoothness(&trace);
        if smoothness.is_some() {
            let rows = 0..trace.len();
            let fault = self.fault(FaultKind::Interpolated, Source::Benchmark, &trace, &rows);
            self.faults.push(fault);
        }
        for index in 0..self.channels.len() {
            let source = Source::Channel(index);
            let trace = self.trace(source);
            if smooth::is_lines(&trace) {
                let fault = self.fault(FaultKind::Interpolated, source, &trace, &(0..trace.len()));
                self.faults.push(fault);
            }
        }
        smoothness
    }
}

#[cfg(test)]
mod tests;

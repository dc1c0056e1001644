//! How often intervals hold the truth, and how often what was said to be probable was so.

use super::drawn::{DrawnSeries, Measured, Starts};
use slipwatch::fit::{Assumptions, LawDraws, LawSample, RateOptions};
use slipwatch::model::Law;
use slipwatch::regime::Regime;
use std::fmt::Write as _;

/// What intervals are scored.
pub(crate) const PLACED: [&str; 7] = [
    "failure, if any",
    "failure",
    "m",
    "r",
    "kappa",
    "v",
    "onset",
];
/// What probabilities are scored.
pub(crate) const SAID: [&str; 3] = ["regime", "unstable", "accelerating"];
/// Failure, as far as numbers go: this many times the present velocity.
const FAILED: f64 = 1e13;
/// A start found within this factor of the true distance from the present is the true one.
const SAME_START: f64 = 1.05;
const BINS: u32 = 10;
/// Multiples of this, less their whole part, are spread evenly over 0 to 1.
const GOLDEN: f64 = 0.618_033_988_75;

/// Whether the central 90 % of one distribution held the truth of one series.
#[derive(Debug, Clone, Copy)]
struct Placed {
    what: &'static str,
    measured: Measured,
    held: bool,
}

/// What was said of a thing that is so or is not.
#[derive(Debug, Clone, Copy)]
struct StatedChance {
    what: &'static str,
    probability: f64,
    so: bool,
}

/// Everything that was said of the series so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tally {
    placed: Vec<Placed>,
    said: Vec<StatedChance>,
    series: u32,
    without: u32,
    evaluations: usize,
}

/// Reads one number off a law.
type Read = fn(&Law) -> f64;

fn failure_days(law: &Law) -> Option<f64> {
    let fails = law.regime() == Regime::UnstableAccelerating;
    law.days_to_velocity(law.v_i * FAILED).filter(|_| fails)
}

fn weight(samples: &[LawSample], is: impl Fn(&Law) -> bool) -> f64 {
    let met = samples.iter().filter(|one| is(&one.law));
    met.map(|one| one.weight).sum()
}

fn central(share: f64) -> bool {
    (0.05..=0.95).contains(&share)
}

impl Tally {
    /// Fits one series and notes what was said of it.
    pub(crate) fn add(&mut self, drawn: &DrawnSeries, starts: Starts) {
        self.series += 1;
        let all = 0..drawn.observations.values.len();
        let rates = drawn.observations.rates(all, RateOptions::default());
        let posterior = LawDraws::of(&rates, &Assumptions::CONSTANT_LOAD);
        let Some(posterior) = posterior else {
            self.without += 1;
            return;
        };
        self.evaluations += posterior.evaluations;
        self.regimes(drawn, &posterior.ensemble.samples);
        self.intervals(drawn, &posterior.ensemble.samples);
        if starts == Starts::ToBeFound {
            let onset = posterior.onset();
            let ago = |days: f64| posterior.ensemble.now_days - days;
            let truth = ago(drawn.onset_days);
            let held = truth <= ago(onset.low_days) * SAME_START
                && truth * SAME_START >= ago(onset.high_days);
            self.place("onset", drawn.measured, held);
        }
    }

    fn regimes(&mut self, drawn: &DrawnSeries, samples: &[LawSample]) {
        let truth = drawn.law.regime();
        for regime in Regime::KNOWN {
            let probability = weight(samples, |law| law.regime() == regime);
            self.say("regime", probability, truth == regime);
        }
        let unstable = weight(samples, |law| law.kappa > 0.0);
        self.say("unstable", unstable, drawn.law.kappa > 0.0);
        let accelerating = weight(samples, |law| law.r > 0.0);
        self.say("accelerating", accelerating, drawn.law.r > 0.0);
    }

    fn intervals(&mut self, drawn: &DrawnSeries, samples: &[LawSample]) {
        let of: [(&'static str, Read); 4] = [
            ("m", |law| law.p),
            ("r", |law| law.r),
            ("kappa", |law| law.kappa),
            ("v", |law| law.v_i),
        ];
        for (what, value) in of {
            let truth = value(&drawn.law);
            let below = weight(samples, |law| value(law) < truth);
            self.place(what, drawn.measured, central(below));
        }
        let fails = weight(samples, |law| failure_days(law).is_some());
        let Some(truth) = failure_days(&drawn.law) else {
            // Never is one point with all of its probability: the truth lies anywhere in that, evenly.
            let share = fails + (1.0 - fails) * (f64::from(self.series) * GOLDEN).fract();
            self.place("failure", drawn.measured, central(share));
            return;
        };
        let before = weight(samples, |law| {
            failure_days(law).is_some_and(|days| days < truth)
        });
        self.place("failure", drawn.measured, central(before));
        let among = fails > 0.0 && central(before / fails);
        self.place("failure, if any", drawn.measured, among);
    }

    fn place(&mut self, what: &'static str, measured: Measured, held: bool) {
        self.placed.push(Placed {
            what,
            measured,
            held,
        });
    }

    fn say(&mut self, what: &'static str, probability: f64, so: bool) {
        self.said.push(StatedChance {
            what,
            probability,
            so,
        });
    }

    /// Share of the truths within the central 90 %, and how many there were.
    pub(crate) fn coverage(&self, what: &str, measured: Option<Measured>) -> (f64, usize) {
        let met = |one: &&Placed| {
            one.what == what && measured.is_none_or(|measured| measured == one.measured)
        };
        let all = self.placed.iter().filter(met).count();
        let held = self
            .placed
            .iter()
            .filter(met)
            .filter(|one| one.held)
            .count();
        (held as f64 / all.max(1) as f64, all)
    }

    /// (Mean probability, share that was so, how many) of each tenth of the scale.
    fn bins(&self, what: &str) -> Vec<(f64, f64, usize)> {
        let bin = |index: u32| {
            let low = f64::from(index) / f64::from(BINS);
            let high = low + 1.0 / f64::from(BINS) + f64::from(index / (BINS - 1));
            let within = |one: &&StatedChance| {
                one.what == what && one.probability >= low && one.probability < high
            };
            let met: Vec<&StatedChance> = self.said.iter().filter(within).collect();
            let count = met.len().max(1) as f64;
            let mean = met.iter().map(|one| one.probability).sum::<f64>() / count;
            let so = met.iter().filter(|one| one.so).count() as f64 / count;
            (mean, so, met.len())
        };
        (0..BINS).map(bin).collect()
    }

    /// Expected calibration error over ten bins.
    pub(crate) fn calibration_error(&self, what: &str) -> f64 {
        let bins = self.bins(what);
        let all: usize = bins.iter().map(|(.., count)| count).sum();
        let gaps = bins
            .iter()
            .map(|(mean, so, count)| (mean - so).abs() * *count as f64);
        gaps.sum::<f64>() / all.max(1) as f64
    }

    /// The table that is printed.
    pub(crate) fn table(&self) -> String {
        let mut out = String::new();
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "{} series, {} without a posterior; {:.0} laws weighed each\n",
            self.series,
            self.without,
            self.evaluations as f64 / f64::from(self.series.max(1)),
        );
        let _ = writeln!(out, "share of truths in the central 90 % (how many)");
        let _ = writeln!(
            out,
            "{:17}{:>14}{:>14}{:>16}{:>14}",
            "", "all", "velocity", "sigma stated", "displacement"
        );
        for what in PLACED {
            let _ = write!(out, "{what:17}");
            let groups = [
                (None, 7),
                (Some(Measured::Velocity), 7),
                (Some(Measured::VelocityWithSigma), 9),
                (Some(Measured::Displacement), 7),
            ];
            for (group, width) in groups {
                let (share, count) = self.coverage(what, group);
                let _ = write!(out, "{share:>width$.3} {:>6}", format!("({count})"));
            }
            let _ = writeln!(out);
        }
        let _ = writeln!(
            out,
            "\nexpected calibration error; said/so (how many) by tenths"
        );
        for what in SAID {
            let _ = write!(out, "{what:17}{:.3} ", self.calibration_error(what));
            for (mean, so, count) in self.bins(what) {
                let _ = write!(out, " {mean:.2}/{so:.2}({count})");
            }
            let _ = writeln!(out);
        }
        out
    }
}

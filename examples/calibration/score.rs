//! How often intervals hold the truth, and how probable what came true was said to be.

use super::drawn::{Drawn, Measured};
use slipwatch::fit::{Curvature, Posterior, RateOptions};
use slipwatch::regime::Regime;
use std::fmt::Write as _;

/// Where the truth lies in one distribution, for one series.
#[derive(Debug, Clone, Copy)]
struct Place {
    what: &'static str,
    group: &'static str,
    share: f64,
}

/// What was said of a thing that is so or is not.
#[derive(Debug, Clone, Copy)]
struct Said {
    what: &'static str,
    probability: f64,
    came_true: bool,
}

/// Everything that was said of the series so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tally {
    places: Vec<Place>,
    said: Vec<Said>,
    pub(crate) series: u32,
    pub(crate) without: u32,
    effective: Vec<f64>,
    evaluations: usize,
}

/// Days to an infinite velocity, as far as numbers go: e^30 times the present one.
fn failure_days(law: &slipwatch::model::Law) -> Option<f64> {
    let fails = law.regime() == Regime::UnstableAccelerating;
    law.days_to_velocity(law.v_i * 1e13).filter(|_| fails)
}

impl Tally {
    /// Fits one series and notes what was said of it.
    pub(crate) fn add(&mut self, drawn: &Drawn, with_onset: bool) {
        self.series += 1;
        let all = 0..drawn.observations.values.len();
        let rates = drawn.observations.rates(all, RateOptions::default());
        let posterior = if with_onset {
            Posterior::over_onsets(&rates)
        } else {
            Posterior::fit(&rates, Curvature::Free, None)
        };
        let Some(posterior) = posterior else {
            self.without += 1;
            return;
        };
        self.effective.push(posterior.effective_draws);
        self.evaluations += posterior.evaluations;
        let group = match drawn.measured {
            Measured::Velocity => "velocity",
            Measured::VelocityWithSigma => "velocity, sigma stated",
            Measured::Displacement => "displacement",
        };
        let samples = &posterior.ensemble.samples;
        for regime in Regime::KNOWN {
            let met = samples.iter().filter(|one| one.law.regime() == regime);
            self.said.push(Said {
                what: "regime",
                probability: met.map(|one| one.weight).sum(),
                came_true: drawn.law.regime() == regime,
            });
        }
        let unstable: f64 = samples
            .iter()
            .filter(|s| s.law.kappa > 0.0)
            .map(|s| s.weight)
            .sum();
        let accelerating: f64 = samples
            .iter()
            .filter(|s| s.law.r > 0.0)
            .map(|s| s.weight)
            .sum();
        self.say("unstable", unstable, drawn.law.kappa > 0.0);
        self.say("accelerating", accelerating, drawn.law.r > 0.0);
        let below = |of: &dyn Fn(&slipwatch::model::Law) -> f64| {
            let truth = of(&drawn.law);
            let met = samples.iter().filter(|one| of(&one.law) < truth);
            met.map(|one| one.weight).sum::<f64>()
        };
        let mut place = |what, share| self.places.push(Place { what, group, share });
        if with_onset {
            let spans = samples.iter().zip(&posterior.spans_days);
            let truth = posterior.ensemble.now_days - drawn.onset_days;
            let of = |later: bool| {
                let met = spans.clone().filter(|(_, span)| {
                    if later {
                        **span < truth * 0.95
                    } else {
                        **span < truth * 1.05
                    }
                });
                met.map(|(sample, _)| sample.weight).sum::<f64>()
            };
            place(
                "onset",
                if of(true) <= 0.95 && of(false) >= 0.05 {
                    0.5
                } else {
                    0.0
                },
            );
        }
        place("m", below(&|law| law.p));
        place("r", below(&|law| law.r));
        place("kappa", below(&|law| law.kappa));
        place("v", below(&|law| law.v_i));
        if let Some(truth) = failure_days(&drawn.law) {
            let times: Vec<(f64, f64)> = samples
                .iter()
                .filter_map(|one| Some((failure_days(&one.law)?, one.weight)))
                .collect();
            let fails: f64 = times.iter().map(|(_, w)| w).sum();
            let before: f64 = times
                .iter()
                .filter(|(t, _)| *t < truth)
                .map(|(_, w)| w)
                .sum();
            place(
                "failure, if any",
                if fails > 0.0 { before / fails } else { 2.0 },
            );
            place("failure", before);
        }
    }

    fn say(&mut self, what: &'static str, probability: f64, came_true: bool) {
        self.said.push(Said {
            what,
            probability,
            came_true,
        });
    }

    /// Share of the truths within the central 90 %, and how many there were.
    pub(crate) fn coverage(&self, what: &str, group: Option<&str>) -> (f64, usize) {
        let met = self
            .places
            .iter()
            .filter(|p| p.what == what && group.is_none_or(|g| g == p.group));
        let shares: Vec<f64> = met.map(|place| place.share).collect();
        let inside = shares.iter().filter(|s| (0.05..=0.95).contains(*s)).count();
        (inside as f64 / shares.len().max(1) as f64, shares.len())
    }

    /// Expected calibration error over ten bins.
    pub(crate) fn calibration_error(&self, what: &str) -> f64 {
        let said: Vec<&Said> = self.said.iter().filter(|one| one.what == what).collect();
        let mut error = 0.0;
        for bin in 0..10 {
            let of = |one: &&&Said| ((one.probability * 10.0) as i32).min(9) == bin;
            let (mut gap, mut n) = (0.0, 0);
            for one in said.iter().filter(of) {
                gap += one.probability - f64::from(u8::from(one.came_true));
                n += 1;
            }
            if n > 0 {
                error += gap.abs();
            }
        }
        error / said.len().max(1) as f64
    }

    /// The table that is printed.
    pub(crate) fn table(&self) -> String {
        let mut out = String::new();
        let _ = writeln!(
            out,
            "{} series, {} without a posterior",
            self.series, self.without
        );
        let mut eff = self.effective.clone();
        eff.sort_by(f64::total_cmp);
        let q = |s: f64| {
            eff.get((s * eff.len() as f64) as usize)
                .copied()
                .unwrap_or(0.0)
        };
        let _ = writeln!(
            out,
            "effective draws 1 5 25 50 75 %: {:.1} {:.1} {:.1} {:.1} {:.1}; evaluations {:.0}",
            q(0.01),
            q(0.05),
            q(0.25),
            q(0.5),
            q(0.75),
            self.evaluations as f64 / f64::from(self.series)
        );
        for what in [
            "failure, if any",
            "failure",
            "m",
            "r",
            "kappa",
            "v",
            "onset",
        ] {
            let _ = write!(out, "{what:16}");
            for group in [
                None,
                Some("velocity"),
                Some("velocity, sigma stated"),
                Some("displacement"),
            ] {
                let (c, n) = self.coverage(what, group);
                let _ = write!(out, " {:.3} ({n})", c);
            }
            let met: Vec<f64> = self
                .places
                .iter()
                .filter(|p| p.what == what)
                .map(|p| p.share)
                .collect();
            let low = met.iter().filter(|s| **s < 0.05).count();
            let high = met.iter().filter(|s| **s > 0.95).count();
            let _ = writeln!(out, "   below {low} above {high}");
        }
        for what in ["regime", "unstable", "accelerating"] {
            let _ = write!(out, "{what:16} {:.4}  ", self.calibration_error(what));
            for bin in 0..10 {
                let said: Vec<&Said> = self
                    .said
                    .iter()
                    .filter(|o| o.what == what && ((o.probability * 10.0) as i32).min(9) == bin)
                    .collect();
                let mean =
                    said.iter().map(|o| o.probability).sum::<f64>() / said.len().max(1) as f64;
                let t =
                    said.iter().filter(|o| o.came_true).count() as f64 / said.len().max(1) as f64;
                let _ = write!(out, " {mean:.2}/{t:.2}({})", said.len());
            }
            let _ = writeln!(out);
        }
        out
    }
}

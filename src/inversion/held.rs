//! The posterior of a constant load where m is given: those of its laws whose m is about that.

use crate::fit::{Ensemble, Exponent, LawDraws, LawSample};

/// p = 1 - 1/m is within this of that of the m given, and on the same side of 0: which separates the regimes.
const NEAR_P: f64 = 0.05;
/// Fewer laws than this bound nothing.
const FEWEST_LAWS: usize = 50;

/// All of it where m is free; `None` where too few of its laws have the m that is given.
pub(super) fn under(exponent: Exponent, posterior: LawDraws) -> Option<LawDraws> {
    let Exponent::Fixed(m) = exponent else {
        return Some(posterior);
    };
    let given = 1.0 - 1.0 / m;
    let is_near = |p: f64| (p - given).abs() <= NEAR_P && p * given >= 0.0;
    let all = posterior.ensemble.samples.iter();
    let kept = all.zip(&posterior.spans_days);
    let kept = kept.filter(|(sample, _)| is_near(sample.law.p));
    let (mut samples, spans_days): (Vec<LawSample>, Vec<f64>) = kept.unzip();
    if samples.len() < FEWEST_LAWS {
        return None;
    }
    let total: f64 = samples.iter().map(|one| one.weight).sum();
    for sample in &mut samples {
        sample.weight /= total;
    }
    Some(LawDraws {
        ensemble: Ensemble {
            samples,
            ..posterior.ensemble
        },
        spans_days,
        ..posterior
    })
}

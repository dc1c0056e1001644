//! The same laws under other priors: what the readings say, and what is taken for granted.

use super::prior::{CAUCHY_SCALE, P_PRIOR};
use super::{Ensemble, LawSample, Posterior};
use crate::model::Law;

/// Scale of the wider priors on kappa L and r L.
const WIDER_SCALE: f64 = 10.0;

/// A prior other than the stated one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OtherPrior {
    /// kappa L Cauchy with scale 10.
    WiderKappa,
    /// r L Cauchy with scale 10.
    WiderSlope,
    /// m, not p, even in its range on either side of 1.
    EvenInM,
}

impl OtherPrior {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::WiderKappa, Self::WiderSlope, Self::EvenInM];

    /// In words.
    pub fn label(self) -> &'static str {
        match self {
            Self::WiderKappa => "kappa wider (Cauchy scale 10)",
            Self::WiderSlope => "r wider (Cauchy scale 10)",
            Self::EvenInM => "even in m",
        }
    }

    /// Its density over the stated one's.
    fn ratio(self, law: &Law, span_days: f64) -> f64 {
        let wider = |value: f64| {
            let density = |scale: f64| 1.0 / (scale * (1.0 + (value / scale).powi(2)));
            density(WIDER_SCALE) / density(CAUCHY_SCALE)
        };
        match self {
            Self::WiderKappa => wider(law.kappa * span_days),
            Self::WiderSlope => wider(law.r * span_days),
            Self::EvenInM => {
                let edge = if law.kappa > 0.0 {
                    P_PRIOR.1
                } else {
                    P_PRIOR.0
                };
                let range_of_m = (1.0 / (1.0 - edge) - 1.0).abs();
                edge.abs() / (range_of_m * (1.0 - law.p).powi(2))
            }
        }
    }
}

impl Posterior {
    /// The ensemble under another prior, by weighing the same laws again.
    pub fn under(&self, prior: OtherPrior) -> Ensemble {
        let samples = self.ensemble.samples.iter().zip(&self.spans_days);
        let mut samples: Vec<LawSample> = samples
            .map(|(sample, span)| LawSample {
                law: sample.law,
                weight: sample.weight * prior.ratio(&sample.law, *span),
            })
            .collect();
        let total: f64 = samples.iter().map(|sample| sample.weight).sum();
        for sample in &mut samples {
            sample.weight /= total;
        }
        Ensemble {
            samples,
            ..self.ensemble.clone()
        }
    }
}

//! The same laws under other priors: what the readings say, and what is taken for granted.

use super::assumptions::{Assumptions, KAPPA_SCALE};
use super::prior::{P_PRIOR, above_kept};
use super::{Ensemble, LawDraws, LawSample};
use crate::model::Law;

/// Scale of the wider prior of kappa times the length of the record.
const WIDER_SCALE: f64 = 10.0;

/// A prior other than that of a constant load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OtherPrior {
    /// Of the slopes that are watched: m above 1 the likelier, and what a stable one keeps mostly low.
    OfWatchedSlopes,
    /// The curvature less confined.
    WiderKappa,
    /// m, not p, even in its range on either side of 1.
    EvenInM,
}

impl OtherPrior {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::OfWatchedSlopes, Self::WiderKappa, Self::EvenInM];

    /// In words.
    pub fn label(self) -> &'static str {
        match self {
            Self::OfWatchedSlopes => "as the monitor's",
            Self::WiderKappa => "kappa wider (Cauchy scale 10)",
            Self::EvenInM => "even in m",
        }
    }

    /// Its density over that of a constant load.
    fn ratio(self, law: &Law, length_days: f64) -> f64 {
        match self {
            Self::OfWatchedSlopes => {
                let watched = Assumptions::CHANGING_LOAD.unstable;
                let own = Assumptions::CONSTANT_LOAD.unstable;
                let is_unstable = law.kappa > 0.0;
                let of_side = if is_unstable {
                    watched / own
                } else {
                    (1.0 - watched) / (1.0 - own)
                };
                if is_unstable || law.r <= 0.0 {
                    return of_side;
                }
                let above = above_kept(law.v_i.ln() - (law.b / law.a).ln() / law.p);
                of_side * (-0.5 * above * above).exp()
            }
            Self::WiderKappa => {
                let cauchy = |scale: f64| 1.0 / (scale + (law.kappa * length_days).powi(2) / scale);
                cauchy(WIDER_SCALE) / cauchy(KAPPA_SCALE)
            }
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

impl LawDraws {
    /// The ensemble under another prior, by weighing the same laws again.
    pub fn under(&self, prior: OtherPrior) -> Ensemble {
        let samples = self.ensemble.samples.iter();
        let length = self.ensemble.now_days - self.from_days;
        let mut samples: Vec<LawSample> = samples
            .map(|sample| LawSample {
                law: sample.law,
                weight: sample.weight * prior.ratio(&sample.law, length),
            })
            .collect();
        let total: f64 = samples.iter().map(|sample| sample.weight).sum();
        if total > 0.0 {
            for sample in &mut samples {
                sample.weight /= total;
            }
        }
        Ensemble {
            samples,
            ..self.ensemble.clone()
        }
    }
}

//! What is known of a drawn series: the effects in it, the law, the noise, the prediction without noise.

use super::read::Groups;
use serde::Serialize;
use slipwatch::effects::{Form, Kind};
use slipwatch::model::Law;
use slipwatch::reading::Timestamp;

/// One effect that is in the series.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct TrueEffect {
    /// The label that fits; `unexplained` where none does.
    pub(crate) effect: Kind,
    /// What it is, where the label does not say.
    pub(crate) what: String,
    pub(crate) channel: Option<String>,
    pub(crate) form: Option<Form>,
    /// Mean delay of the response, days.
    pub(crate) lag_days: Option<f64>,
    /// 1 is exponential, more a gamma.
    pub(crate) response_shape: Option<usize>,
    /// Log-load (or the reading's unit) for one standard deviation of the response.
    pub(crate) gain_per_sd: Option<f64>,
    pub(crate) period_days: Option<f64>,
    pub(crate) at: Option<Timestamp>,
    /// Of a step the log-load, of an offset mm, of a reset the factor, of a mean its window in days, ...
    pub(crate) size: Option<f64>,
    pub(crate) unit: Option<String>,
    pub(crate) groups: Option<Groups>,
    /// rms of what the best constant-load law leaves of the motion with this effect alone, over the noise's
    /// standard deviation; of an effect of the reading, its own rms about its mean over the same.
    pub(crate) rms_over_noise: f64,
}

impl TrueEffect {
    pub(crate) fn of(effect: Kind) -> Self {
        Self {
            effect,
            what: effect.name().to_owned(),
            channel: None,
            form: None,
            lag_days: None,
            response_shape: None,
            gain_per_sd: None,
            period_days: None,
            at: None,
            size: None,
            unit: None,
            groups: None,
            rms_over_noise: 0.0,
        }
    }
}

/// The law's parameters as written beside the series.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct TrueLaw {
    pub(crate) v_i_mm_per_day: f64,
    pub(crate) r_per_day: f64,
    pub(crate) kappa_per_day: f64,
    pub(crate) p: f64,
    pub(crate) a_per_day: f64,
    pub(crate) b_per_day: f64,
}

impl TrueLaw {
    /// Of a law of unit velocity, slipping `mm` where it slips 1.
    pub(crate) fn scaled(law: &Law, mm: f64) -> Self {
        Self {
            v_i_mm_per_day: law.v_i * mm,
            r_per_day: law.r,
            kappa_per_day: law.kappa,
            p: law.p,
            a_per_day: law.a,
            b_per_day: law.b,
        }
    }
}

/// The noise of the readings: mm, or a share of the velocity.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct TrueNoise {
    pub(crate) white: f64,
    /// Standard deviation of what remembers; of a random walk, of its step over one nominal interval.
    pub(crate) correlated: f64,
    /// Days; null for white noise and for a random walk.
    pub(crate) memory_days: Option<f64>,
    pub(crate) is_share_of_velocity: bool,
}

/// Everything known of one series.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Truth {
    pub(crate) family: String,
    pub(crate) seed: u64,
    /// Empty where there is nothing to find.
    pub(crate) effects: Vec<TrueEffect>,
    /// AR(1) noise that is no effect of the family, and right to be named.
    pub(crate) background_noise_remembers: bool,
    pub(crate) law: TrueLaw,
    pub(crate) noise: TrueNoise,
    pub(crate) interval_days: f64,
    pub(crate) length_days: f64,
    pub(crate) readings: usize,
    /// Draws made until one met the conditions.
    pub(crate) draws: u32,
    /// What each reading would be without noise, in the readings' unit.
    pub(crate) prediction: Vec<f64>,
}

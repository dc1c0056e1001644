//! What effects are made of: the ways in which the law, and the reading of it, can be acted on.

/// How an effect acts.
#[derive(Debug, Clone)]
pub enum Act {
    /// On the log-load: columns at the days on which the law is solved, each with standard deviation 1.
    Load(Vec<Vec<f64>>),
    /// The log-load steps.
    Step,
    /// ln y jumps.
    Reset,
    /// So many of b, ln a and p change, 1 to 3: b alone is the pace.
    Friction(usize),
    /// The load falls with the velocity.
    PerVelocity,
    /// The load falls with the slip.
    PerSlip,
    /// On the reading: columns at the readings.
    Reading(Vec<Vec<f64>>),
    /// Velocities are means over so many median spacings.
    Averaging,
}

impl Act {
    /// How many coefficients it has.
    pub(super) fn coefficients(&self) -> usize {
        match self {
            Self::Load(columns) | Self::Reading(columns) => columns.len(),
            Self::Friction(count) => *count,
            Self::Step | Self::Reset | Self::PerVelocity | Self::PerSlip | Self::Averaging => 1,
        }
    }

    /// Where its coefficients may start a fit: next to nothing, or, where nothing is the edge of what they may be, at
    /// several sizes.
    pub(super) fn starts(&self) -> &'static [f64] {
        match self {
            Self::PerVelocity => &[0.1, 0.4, 1.5, 5.0],
            Self::PerSlip => &[0.3, 2.0],
            Self::Averaging => &[2.0, 8.0],
            // From next to nothing a fit seldom finds its way to a state that was halved or doubled.
            Self::Reset => &[1e-3, -0.7, 0.7],
            Self::Load(_) | Self::Step | Self::Friction(_) | Self::Reading(_) => &[1e-3],
        }
    }

    /// Standard deviation of the prior of its coefficient of that index; infinite for those of the reading.
    pub(super) fn prior(&self, index: usize) -> f64 {
        match self {
            Self::Load(_) | Self::Step | Self::Reset => 1.5,
            Self::Friction(_) if index == 2 => 0.6,
            Self::Friction(_) if index == 1 => 2.0,
            Self::Friction(_) => 10.0,
            Self::PerVelocity | Self::PerSlip => 5.0,
            Self::Reading(_) => f64::INFINITY,
            Self::Averaging => 30.0,
        }
    }
}

/// Sines and cosines of these periods, days, at `times`: for each period in turn sqrt 2 times a cosine, and a sine.
pub(super) fn harmonics(times: &[f64], periods: &[f64]) -> Vec<Vec<f64>> {
    let mut columns = Vec::new();
    for period in periods {
        let phase = |t: &f64| std::f64::consts::TAU * t / period;
        let root = std::f64::consts::SQRT_2;
        columns.push(times.iter().map(|t| root * phase(t).cos()).collect());
        columns.push(times.iter().map(|t| root * phase(t).sin()).collect());
    }
    columns
}

/// The amplitudes of waves with these coefficients of [`harmonics`].
pub(super) fn amplitudes(coefficients: &[f64]) -> impl Iterator<Item = f64> {
    coefficients.chunks(2).map(|pair| {
        let sine = pair.get(1).copied().unwrap_or(0.0);
        pair[0].hypot(sine) * std::f64::consts::SQRT_2
    })
}

/// The mean, and the standard deviation about it.
pub(super) fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n;
    (mean, variance.sqrt())
}

/// The same values with mean 0 and standard deviation 1; `None` where they do not change.
pub(super) fn standardise(mut values: Vec<f64>) -> Option<Vec<f64>> {
    let (mean, deviation) = mean_and_deviation(&values);
    let size = values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    if !(deviation.is_finite() && deviation > 1e-9 * size) {
        return None;
    }
    for value in &mut values {
        *value = (*value - mean) / deviation;
    }
    Some(values)
}

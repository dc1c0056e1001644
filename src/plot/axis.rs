//! How numbers and dates stand along an axis.

use super::calendar;

/// How numbers stand along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisScale {
    /// Evenly.
    Linear,
    /// By their logarithms.
    Log,
    /// As days since 1970-01-01, evenly, with dates at the ticks.
    Date,
    /// Evenly, with names at the ticks.
    Named,
}

/// One axis; what lies outside its range is cut off.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// At its beginning.
    pub from: f64,
    /// At its end.
    pub to: f64,
    /// What lies between.
    pub scale: AxisScale,
    /// What stands where, of an axis that is [`AxisScale::Named`].
    pub names: Vec<(f64, String)>,
}

/// A linear axis has at most about so many ticks.
const TICKS: f64 = 6.0;
/// How much closer than side by side labels may stand above one another.
const UPRIGHT: f64 = 2.5;

impl Axis {
    /// Numbers, evenly.
    pub fn linear(label: &str, from: f64, to: f64) -> Self {
        Self {
            label: label.to_owned(),
            from,
            to,
            scale: AxisScale::Linear,
            names: Vec::new(),
        }
    }

    /// Places from the bottom up, each with its name; bare where there are no names.
    pub fn named(from: f64, to: f64, names: Vec<(f64, String)>) -> Self {
        Self {
            scale: AxisScale::Named,
            names,
            ..Self::linear("", from, to)
        }
    }

    /// Positive numbers, by their logarithms.
    pub fn log(label: &str, from: f64, to: f64) -> Self {
        Self {
            scale: AxisScale::Log,
            ..Self::linear(label, from, to)
        }
    }

    /// Days since 1970-01-01, with dates at the ticks.
    pub fn dates(label: &str, from: f64, to: f64) -> Self {
        Self {
            scale: AxisScale::Date,
            ..Self::linear(label, from, to)
        }
    }

    /// A linear axis that shows all of `values` that are finite, with some room around them.
    pub fn around(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let mut low = f64::INFINITY;
        let mut high = f64::NEG_INFINITY;
        for value in values.into_iter().filter(|value| value.is_finite()) {
            low = low.min(value);
            high = high.max(value);
        }
        let span = high - low;
        let room = match span {
            span if span > 0.0 => 0.05 * span,
            // All values are one: any range around it will do.
            0.0 => (0.05 * high.abs()).max(0.5),
            _ => return Self::linear(label, 0.0, 1.0),
        };
        Self::linear(label, low - room, high + room)
    }

    /// The share of the axis at `value`; `None` where it has none.
    pub(super) fn share(&self, value: f64) -> Option<f64> {
        let share = match self.scale {
            AxisScale::Linear | AxisScale::Date | AxisScale::Named => {
                (value - self.from) / (self.to - self.from)
            }
            AxisScale::Log => (value / self.from).ln() / (self.to / self.from).ln(),
        };
        // Far outside is as good as the edge of the sheet, and keeps the numbers short.
        share.is_finite().then(|| share.clamp(-20.0, 20.0))
    }

    /// Where ticks stand on an axis of `length` units of the sheet, and what stands at them.
    pub(super) fn ticks(&self, length: f64) -> Vec<(f64, String)> {
        match self.scale {
            AxisScale::Linear => self.linear_ticks(),
            AxisScale::Log => self.decades(),
            AxisScale::Date => calendar::ticks(self.from, self.to, length),
            AxisScale::Named => self.names.clone(),
        }
    }

    /// The same on an axis that stands, where labels need only a line's height.
    pub(super) fn upright_ticks(&self, length: f64) -> Vec<(f64, String)> {
        self.ticks(UPRIGHT * length)
    }

    fn linear_ticks(&self) -> Vec<(f64, String)> {
        let rough = (self.to - self.from) / TICKS;
        let decade = 10_f64.powf(rough.log10().floor());
        let factors = [1.0, 2.0, 5.0, 10.0];
        let factor = factors.iter().find(|factor| **factor * decade >= rough);
        let step = factor.copied().unwrap_or(10.0) * decade;
        let places = (1..=6)
            .filter(|places| step < 9.99 * 0.1_f64.powi(*places))
            .count();
        let first = (self.from / step - 1e-9).ceil();
        (0..40)
            .map(|index| (first + f64::from(index)) * step)
            .take_while(|value| *value <= self.to + 1e-9 * step)
            // A sum with zero has no sign.
            .map(|value| (value, format!("{:.places$}", value + 0.0)))
            .collect()
    }

    fn decades(&self) -> Vec<(f64, String)> {
        let span = (self.to / self.from).log10();
        let every = (span / TICKS).ceil().max(1.0);
        let first = (self.from.log10() / every - 1e-9).ceil() * every;
        let exponents = (0..40).map(|index| first + every * f64::from(index));
        exponents
            .take_while(|exponent| *exponent <= self.to.log10() + 1e-9)
            .map(|exponent| (10_f64.powf(exponent), power_of_ten(exponent)))
            .collect()
    }
}

fn power_of_ten(exponent: f64) -> String {
    if (-2.0..=3.0).contains(&exponent) {
        let places = if exponent < 0.0 { -exponent } else { 0.0 };
        return match places {
            2.0 => "0.01".to_owned(),
            1.0 => "0.1".to_owned(),
            _ => format!("{:.0}", 10_f64.powf(exponent)),
        };
    }
    let raised = |digit: char| match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        '9' => '⁹',
        _ => '⁰',
    };
    let digits: String = format!("{exponent:.0}").chars().map(raised).collect();
    format!("10{digits}")
}

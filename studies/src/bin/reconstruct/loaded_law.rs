//! The law while its load changes: `v = v_i e^f / y`, `dy/dt = a y^p - b e^f`.

use slipwatch::model::Law;

/// Where a loaded block is: its inverse velocity under the law alone, and its slip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Block {
    /// Days since the start.
    pub(crate) days: f64,
    /// `v_i e^f / v`.
    pub(crate) y: f64,
    /// Displacement since the start, mm.
    pub(crate) slip_mm: f64,
}

impl Block {
    /// At the start of its motion.
    pub(crate) const START: Self = Self {
        days: 0.0,
        y: 1.0,
        slip_mm: 0.0,
    };

    /// Velocity under log-load `f`, mm/day.
    pub(crate) fn velocity(&self, law: &Law, f: f64) -> f64 {
        law.v_i * f.exp() / self.y
    }

    /// The block one Runge-Kutta step of `step` days later, under the log-load `f` of days.
    pub(crate) fn step(&self, law: &Law, f: impl Fn(f64) -> f64, step: f64) -> Self {
        let b = law.a + law.r;
        let slopes = |load: f64, y: f64| {
            let gain = load.exp();
            (law.a * y.powf(law.p) - b * gain, law.v_i * gain / y)
        };
        let (f_0, f_half, f_1) = (f(self.days), f(self.days + step / 2.0), f(self.days + step));
        let k_1 = slopes(f_0, self.y);
        let k_2 = slopes(f_half, self.y + step / 2.0 * k_1.0);
        let k_3 = slopes(f_half, self.y + step / 2.0 * k_2.0);
        let k_4 = slopes(f_1, self.y + step * k_3.0);
        let mean = |a: f64, b: f64, c: f64, d: f64| (a + 2.0 * b + 2.0 * c + d) / 6.0;
        Self {
            days: self.days + step,
            y: self.y + step * mean(k_1.0, k_2.0, k_3.0, k_4.0),
            slip_mm: self.slip_mm + step * mean(k_1.1, k_2.1, k_3.1, k_4.1),
        }
    }

    /// The block `days` later, in `steps` equal steps.
    pub(crate) fn advance(self, law: &Law, f: impl Fn(f64) -> f64, days: f64, steps: u32) -> Self {
        let step = days / f64::from(steps);
        (0..steps).fold(self, |block, _| block.step(law, &f, step))
    }
}

//! The law seen backwards from the present: ln y and slip over the present velocity, by days ago.
//!
//! One equation of one variable: the days ago are an integral over w = ln y, by Gauss-Legendre on panels
//! that keep their distance from the pole at the steady state, and between the panels' ends ln y and the
//! slip are quintic polynomials of time. Within 1e-4, where readings scatter by a per cent: a fraction of the
//! cost of [`crate::model::Trajectory`], which is as exact as f64 allows.

/// Largest |ln y| that is followed: velocities beyond a factor of a million are held there.
const MOST_LN_Y: f64 = 14.0;
/// Longest panel in ln y, and the share of the distance to a pole ahead that a panel may take.
const LONGEST_PANEL: f64 = 0.18;
const SHARE_AHEAD: f64 = 0.5;
/// What is left to move, in ln y, when the motion counts as steady.
const STEADY: f64 = 1e-6;
const MOST_PANELS: usize = 120;
/// Four-point Gauss-Legendre quadrature on [-1, 1].
const NODES: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_8),
    (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_8),
];

/// The law's shape: r and kappa at the present in 1/day, and p.
#[derive(Debug, Clone, Copy)]
pub(super) struct PastShape {
    pub(super) r: f64,
    pub(super) kappa: f64,
    pub(super) p: f64,
}

/// One solution; its buffers are used again by the next.
#[derive(Debug, Default)]
pub(super) struct PastSolution {
    panels: Vec<PastPanel>,
    last: Node,
}

/// Position and derivatives by days ago.
#[derive(Debug, Clone, Copy, Default)]
struct Node {
    ago: f64,
    ln_y: f64,
    first: f64,
    second: f64,
    slip: f64,
}

#[derive(Debug, Clone, Copy)]
struct PastPanel {
    ago: f64,
    span: f64,
    ln_y: [f64; 6],
    slip: [f64; 6],
}

impl PastSolution {
    /// Solves over `span` days ago; false where the velocity left the range that is followed within them.
    /// Before that the slope creeps at the velocity it had then.
    pub(super) fn solve(&mut self, shape: PastShape, span: f64) -> bool {
        self.panels.clear();
        let mut is_whole = true;
        let mut node = shape.node(0.0, 0.0, 0.0);
        let toward = shape.r.signum();
        let pole = shape.steady();
        loop {
            let left = span - node.ago;
            let steady = node.first.abs() * left < STEADY
                && (shape.kappa >= 0.0 || shape.r == 0.0 || shape.kappa.abs() * left < 1.0);
            if left <= 0.0 || steady || self.panels.len() >= MOST_PANELS {
                break;
            }
            let clearance = pole.map_or(f64::INFINITY, |pole| {
                let ahead = (pole - node.ln_y) * toward;
                if ahead > 0.0 {
                    SHARE_AHEAD * ahead
                } else {
                    -ahead
                }
            });
            if clearance < 1e-9 {
                break;
            }
            let next = shape.advance(&node, toward * clearance.min(LONGEST_PANEL));
            if !next.ago.is_finite() || next.ago < node.ago {
                is_whole = false;
                break;
            }
            self.panels.push(PastPanel::between(&node, &next));
            node = next;
            if node.ln_y.abs() > MOST_LN_Y && node.ago < span {
                is_whole = false;
                break;
            }
        }
        self.last = node;
        if node.ago > span
            && let Some(panel) = self.panels.last().copied()
        {
            // Creep before the span: the motion is held where it ends.
            let (ln_y, slip) = panel.at(span);
            self.last = Node {
                ago: span,
                ln_y,
                first: 0.0,
                second: 0.0,
                slip,
            };
        }
        is_whole
    }

    /// (ln y, slip over the present velocity) `ago` days ago; `hint` moves along with growing `ago`.
    pub(super) fn at(&self, ago: f64, hint: &mut usize) -> (f64, f64) {
        if ago >= self.last.ago || self.panels.is_empty() {
            let creep = (-self.last.ln_y).exp();
            return (
                self.last.ln_y,
                self.last.slip + creep * (ago - self.last.ago),
            );
        }
        while *hint + 1 < self.panels.len() && self.panels[*hint + 1].ago <= ago {
            *hint += 1;
        }
        while *hint > 0 && self.panels[*hint].ago > ago {
            *hint -= 1;
        }
        self.panels[*hint].at(ago)
    }
}

impl PastShape {
    /// exp(p ln y) and -d ln y / d(days ago) times y: r - kappa bc(y; p).
    fn pull(&self, ln_y: f64) -> (f64, f64) {
        if self.p == 0.0 {
            return (1.0, self.r - self.kappa * ln_y);
        }
        let less_one = (self.p * ln_y).exp_m1();
        (1.0 + less_one, self.r - self.kappa * less_one / self.p)
    }

    fn node(&self, ago: f64, ln_y: f64, slip: f64) -> Node {
        let (power, pull) = self.pull(ln_y);
        let fast = (-ln_y).exp();
        let first = pull * fast;
        Node {
            ago,
            ln_y,
            first,
            second: -first * (self.kappa * power * fast + first),
            slip,
        }
    }

    /// ln of the steady y, where there is one.
    fn steady(&self) -> Option<f64> {
        if self.kappa == 0.0 {
            return None;
        }
        let z = self.r / self.kappa;
        let ln_y = if self.p == 0.0 {
            z
        } else {
            (self.p * z).ln_1p() / self.p
        };
        ln_y.is_finite().then_some(ln_y)
    }

    fn advance(&self, from: &Node, step: f64) -> Node {
        let (mut days, mut slip) = (0.0, 0.0);
        for (x, weight) in NODES {
            let ln_y = from.ln_y + 0.5 * step * (1.0 + x);
            let (_, pull) = self.pull(ln_y);
            let share = weight / pull;
            days += share * ln_y.exp();
            slip += share;
        }
        self.node(
            from.ago + 0.5 * step * days,
            from.ln_y + step,
            from.slip + 0.5 * step * slip,
        )
    }
}

impl PastPanel {
    fn between(from: &Node, to: &Node) -> Self {
        let span = to.ago - from.ago;
        let fast = |node: &Node| (-node.ln_y).exp();
        let (fast_from, fast_to) = (fast(from), fast(to));
        Self {
            ago: from.ago,
            span,
            ln_y: quintic(
                span,
                [from.ln_y, from.first, from.second],
                [to.ln_y, to.first, to.second],
            ),
            slip: quintic(
                span,
                [from.slip, fast_from, -from.first * fast_from],
                [to.slip, fast_to, -to.first * fast_to],
            ),
        }
    }

    fn at(&self, ago: f64) -> (f64, f64) {
        let u = (ago - self.ago) / self.span;
        let horner = |c: &[f64; 6]| {
            let high = (c[5] * u + c[4]) * u + c[3];
            ((high * u + c[2]) * u + c[1]) * u + c[0]
        };
        (horner(&self.ln_y), horner(&self.slip))
    }
}

/// Coefficients on [0, 1] of the quintic with these values, slopes and curvatures at its ends.
fn quintic(h: f64, from: [f64; 3], to: [f64; 3]) -> [f64; 6] {
    let (a1, a2) = (h * from[1], 0.5 * h * h * from[2]);
    let value = to[0] - from[0] - a1 - a2;
    let slope = h * to[1] - a1 - 2.0 * a2;
    let bend = h * h * to[2] - 2.0 * a2;
    [
        from[0],
        a1,
        a2,
        10.0 * value - 4.0 * slope + 0.5 * bend,
        -15.0 * value + 7.0 * slope - bend,
        6.0 * value - 3.0 * slope + 0.5 * bend,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Accuracy, Law, Trajectory};

    #[test]
    fn the_past_is_that_of_the_exact_solution_to_a_ten_thousandth() {
        let mut past = PastSolution::default();
        let mut seen = 0;
        for r in [-3.0, -0.9, -0.3, -1e-4, 0.0, 1e-4, 0.5, 4.0, 60.0] {
            for kappa in [-8.0, -1.0, -0.05, 0.0, 0.05, 1.0, 8.0, 100.0] {
                for p in [-0.9, -0.2, 0.0, 0.2, 0.55] {
                    let shape = PastShape { r, kappa, p };
                    if !past.solve(shape, 1.0) {
                        continue;
                    }
                    let law = Law::from_fit(1.0, r, kappa, p).reversed();
                    let exact = Trajectory::solve(&law, 1.0, Accuracy::Full);
                    let mut hint = 0;
                    for step in 0..=50 {
                        let ago = f64::from(step) / 50.0;
                        let Some(want) = exact.at(ago) else {
                            panic!("{shape:?} has no past {ago} days ago");
                        };
                        let (ln_y, slip) = past.at(ago, &mut hint);
                        let error = (ln_y - want.y.ln()).abs();
                        assert!(error < 1e-4, "{shape:?} at {ago}: ln y off by {error:e}");
                        let error = (slip / want.displacement.max(1e-9) - 1.0).abs();
                        assert!(
                            ago == 0.0 || error < 1e-4,
                            "{shape:?} at {ago}: slip off by {error:e}"
                        );
                    }
                    seen += 1;
                }
            }
        }
        assert!(seen > 200, "{seen} laws");
    }
}

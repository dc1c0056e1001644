//! The law's curve over a record, fast enough for a search: nodes in ln y by quadrature, between them a
//! polynomial in time.
//!
//! Time and slip are explicit in y (`dt = dy / F`), so a step needs F and its derivatives at its two
//! ends only, and its length is bounded by the distance to the steady state, the one pole of 1/F. F is
//! written about that pole, where nothing cancels. Two exponentials a node; no step is ever rejected.

use crate::reading::Quantity;

/// A law with velocity 1 at the anchor of its chart; times are in lengths of the record, away from the anchor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CurveShape {
    /// dy/dt at the anchor, where y = 1.
    pub(super) slope: f64,
    /// ln y of the steady state, of either sign but not 0.
    pub(super) ln_steady: f64,
    /// 1 - 1/m.
    pub(super) p: f64,
}

impl CurveShape {
    /// F = dy/dt at ln y, and the part of it that goes with y^p.
    fn slope_at(&self, scale: f64, ln_y: f64) -> (f64, f64) {
        let q = self.p * (ln_y - self.ln_steady);
        if self.steady_side_is_flat() {
            let below = q.exp_m1();
            (-scale * below, -scale * (below + 1.0))
        } else {
            let grown = scale * (self.p * ln_y).exp();
            (-grown * (-q).exp_m1(), grown)
        }
    }

    /// Whether y^p is smaller than at the steady state, so that F tends to a constant away from it.
    fn steady_side_is_flat(&self) -> bool {
        self.p * self.ln_steady > 0.0
    }

    /// F at the anchor over its part that is 1 there.
    fn scale(&self) -> f64 {
        let q = -self.p * self.ln_steady;
        let part = if self.steady_side_is_flat() { q } else { -q };
        -self.slope / part.exp_m1()
    }

    /// The same law with its anchor moved to where ln y is `ln_y`.
    pub(super) fn moved(&self, ln_y: f64) -> Self {
        let (slope, _) = self.slope_at(self.scale(), ln_y);
        Self {
            slope: slope * (-ln_y).exp(),
            ln_steady: self.ln_steady - ln_y,
            p: self.p,
        }
    }

    /// d ln(slope over time scale) / d ln(y over steady y) at the anchor.
    pub(super) fn stretch(&self) -> f64 {
        self.p / -(self.p * self.ln_steady).exp_m1() - 1.0
    }
}

/// How finely a curve is solved: the longest step as a share of the distance to the steady state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fineness(pub(super) f64);

impl Fineness {
    /// For a first look: about 1e-5.
    pub(super) const COARSE: Self = Self(0.7);
    /// For a search on few readings: about 1e-7.
    pub(super) const MIDDLE: Self = Self(0.5);
    /// For a search on all readings: about 1e-8.
    pub(super) const FINE: Self = Self(0.4);
    /// For what is reported: about 1e-10.
    pub(super) const EXACT: Self = Self(0.25);
}

/// More nodes than a curve within the charts needs; one bit each in [`LawCurve::known`].
const MOST_NODES: usize = 128;
/// ln y is followed no further than this, where velocities have left every instrument's range.
const FARTHEST_LN_Y: f64 = 300.0;
/// Nearer to the steady state than this (in ln y and in p ln y) the approach is exponential.
const NEARLY_STEADY: f64 = 1e-4;
/// A step towards the steady state ends nearer to it than it began.
const TOWARDS_STEADY: f64 = 0.8;
/// ln of what is left of an approach that no longer counts.
const SPENT: f64 = -40.0;

/// The quantity at a node, with three derivatives in time (y itself for velocities).
#[derive(Debug, Clone, Copy)]
struct CurveNode {
    t: f64,
    value: [f64; 4],
    /// ln of y over its steady value.
    ln_excess: f64,
    /// d ln y / dt.
    growth: f64,
}

/// Hermite's polynomial from one node to the next.
#[derive(Debug, Clone, Copy)]
struct Piece {
    over_span: f64,
    low: [f64; 4],
    high: [f64; 4],
}

/// The last stretch towards a steady state: (t, ln excess, rate, steady y, slip).
#[derive(Debug, Clone, Copy)]
struct Approach {
    t: f64,
    ln_excess: f64,
    rate: f64,
    steady_y: f64,
    value: f64,
}

/// A solved curve; its memory is used again by the next.
#[derive(Debug, Clone)]
pub(super) struct LawCurve {
    quantity: Quantity,
    nodes: Vec<CurveNode>,
    /// From each node to the next, where `known` has its bit.
    pieces: Vec<Piece>,
    known: u128,
    approach: Option<Approach>,
}

/// Derivatives at a node: of t and of slip in ln y, of y in t.
struct Local {
    t: [f64; 4],
    slip: [f64; 4],
    y: [f64; 4],
}

impl Local {
    /// `g` is the part of F whose derivatives in ln y are p g, p^2 g, ...
    fn new(y: f64, f: f64, g: f64, p: f64) -> Self {
        let over_f = 1.0 / f;
        let first = p * g * over_f;
        let (second, third) = (p * first, p * p * first);
        // Derivatives of 1/F over 1/F.
        let w1 = -first;
        let w2 = 2.0 * first * first - second;
        let w3 = first * (6.0 * second - 6.0 * first * first) - third;
        let over = y * over_f;
        let growth = f / y;
        let f_1 = p * g;
        Self {
            t: [
                over,
                over * (1.0 + w1),
                over * (1.0 + 2.0 * w1 + w2),
                over * (1.0 + 3.0 * (w1 + w2) + w3),
            ],
            slip: [over_f, over_f * w1, over_f * w2, over_f * w3],
            y: [
                y,
                f,
                f_1 * growth,
                growth * growth * (p * f_1 + f_1 * first - f_1),
            ],
        }
    }

    /// The quantity and its derivatives in time.
    fn value(&self, quantity: Quantity, slip: f64) -> [f64; 4] {
        match quantity {
            Quantity::Velocity => self.y,
            Quantity::Displacement => {
                let u = 1.0 / self.y[0];
                let first = -self.y[1] * u * u;
                let second = -self.y[2] * u * u - 2.0 * self.y[1] * u * first;
                [slip, u, first, second]
            }
        }
    }
}

/// Integral over a step of `h` from the integrand and three derivatives at both ends.
fn between(h: f64, from: &[f64; 4], to: &[f64; 4]) -> f64 {
    let third = h * (from[3] - to[3]) / 1680.0;
    let second = h * ((from[2] + to[2]) / 84.0 + third);
    let first = h * ((from[1] - to[1]) * (3.0 / 28.0) + second);
    h * (0.5 * (from[0] + to[0]) + first)
}

/// A stretch of a curve laid over the record: curve time is `start + span * record time`.
#[derive(Debug, Clone, Copy)]
pub(super) struct CurveWindow {
    pub(super) first_node: usize,
    pub(super) start: f64,
    pub(super) span: f64,
}

impl CurveWindow {
    /// The curve as it was solved.
    pub(super) const WHOLE: Self = Self {
        first_node: 0,
        start: 0.0,
        span: 1.0,
    };
}

impl LawCurve {
    pub(super) fn new(quantity: Quantity) -> Self {
        Self {
            quantity,
            nodes: Vec::with_capacity(MOST_NODES),
            pieces: vec![Piece::NONE; MOST_NODES],
            known: 0,
            approach: None,
        }
    }

    /// Solves from y = 1 up to `end`; false where the law ends before, or leaves the range of numbers.
    pub(super) fn solve(&mut self, shape: &CurveShape, end: f64, fineness: Fineness) -> bool {
        let scale = shape.scale();
        let sign = shape.slope.signum();
        let ahead = sign * shape.ln_steady > 0.0;
        let share = fineness.0 * if ahead { TOWARDS_STEADY } else { 1.0 };
        let changes_over = if shape.steady_side_is_flat() {
            1.0
        } else {
            (1.0 - shape.p).abs().max(1.0)
        };
        let longest = fineness.0 / changes_over;
        self.nodes.clear();
        self.known = 0;
        self.approach = None;
        let (mut ln_y, mut t, mut slip, mut h) = (0.0_f64, 0.0, 0.0, 0.0);
        let mut before: Option<Local> = None;
        loop {
            let y = ln_y.exp();
            let (f, g) = shape.slope_at(scale, ln_y);
            if !(f * sign > 0.0 && f.is_finite() && ln_y.abs() < FARTHEST_LN_Y) {
                return false;
            }
            let local = Local::new(y, f, g, shape.p);
            if let Some(before) = &before {
                t += between(h, &before.t, &local.t);
                if self.quantity == Quantity::Displacement {
                    slip += between(h, &before.slip, &local.slip);
                }
            }
            let ln_excess = ln_y - shape.ln_steady;
            self.nodes.push(CurveNode {
                t,
                value: local.value(self.quantity, slip),
                ln_excess,
                growth: f / y,
            });
            if t >= end {
                return true;
            }
            if ahead && ln_excess.abs() * shape.p.abs().max(1.0) < NEARLY_STEADY {
                self.approach_from(ln_excess, f / y, y);
                return true;
            }
            if self.nodes.len() == MOST_NODES {
                return false;
            }
            h = sign * (share * ln_excess.abs()).min(longest);
            ln_y += h;
            before = Some(local);
        }
    }

    fn approach_from(&mut self, ln_excess: f64, growth: f64, y: f64) {
        self.approach = self.nodes.last().map(|last| Approach {
            t: last.t,
            ln_excess,
            rate: growth / ln_excess,
            steady_y: y * (-ln_excess).exp(),
            value: last.value[0],
        });
    }

    /// How many nodes it has.
    pub(super) fn count(&self) -> usize {
        self.nodes.len()
    }

    /// Time of a node.
    pub(super) fn time(&self, node: usize) -> f64 {
        self.nodes[node].t
    }

    /// ln of y over its steady value at a node.
    pub(super) fn ln_excess(&self, node: usize) -> f64 {
        self.nodes[node].ln_excess
    }

    /// d ln y / dt at a node.
    pub(super) fn growth(&self, node: usize) -> f64 {
        self.nodes[node].growth
    }

    /// The time at which ln of y over its steady value has this size, on a curve that approaches it.
    pub(super) fn time_at_excess(&self, size: f64) -> f64 {
        let ln = |node: &CurveNode| node.ln_excess.abs().ln();
        for pair in self.nodes.windows(2) {
            let (far, near) = (&pair[0], &pair[1]);
            if near.ln_excess.abs() <= size {
                let share = (ln(far) - size.ln()) / (ln(far) - ln(near));
                return far.t + (near.t - far.t) * share.clamp(0.0, 1.0);
            }
        }
        self.nodes.last().map_or(0.0, |last| last.t)
    }

    /// Velocity, or displacement from the anchor, at `times` (increasing, in the record's), and their
    /// derivatives in the curve's time where wanted.
    pub(super) fn follow(
        &mut self,
        window: &CurveWindow,
        times: &[f64],
        out: &mut [f64],
        rates: Option<&mut [f64]>,
    ) {
        match (self.quantity, rates) {
            (Quantity::Velocity, None) => self.walk::<true, false>(window, times, out, &mut []),
            (Quantity::Displacement, None) => {
                self.walk::<false, false>(window, times, out, &mut []);
            }
            (Quantity::Velocity, Some(rates)) => self.walk::<true, true>(window, times, out, rates),
            (Quantity::Displacement, Some(rates)) => {
                self.walk::<false, true>(window, times, out, rates);
            }
        }
    }

    /// One loop a case, because nearly all the time of a search is spent here.
    fn walk<const IS_VELOCITY: bool, const WITH_RATES: bool>(
        &mut self,
        window: &CurveWindow,
        times: &[f64],
        out: &mut [f64],
        rates: &mut [f64],
    ) {
        let mut put = |index: usize, (value, rate): (f64, f64)| {
            let (value, rate) = if IS_VELOCITY {
                let u = 1.0 / value;
                (u, -rate * u * u)
            } else {
                (value, rate)
            };
            out[index] = value;
            if WITH_RATES {
                rates[index] = rate;
            }
        };
        let (mut node, last) = (window.first_node, self.nodes.len() - 1);
        let mut index = 0;
        while index < times.len() {
            let mut t = window.start + window.span * times[index];
            while node < last && t > self.nodes[node + 1].t {
                node += 1;
            }
            if node == last {
                put(index, self.approaching(t));
                index += 1;
                continue;
            }
            let (begin, end) = (self.nodes[node].t, self.nodes[node + 1].t);
            let piece = self.piece(node);
            loop {
                put(index, piece.at::<WITH_RATES>(t - begin));
                index += 1;
                if index == times.len() {
                    return;
                }
                t = window.start + window.span * times[index];
                if t > end {
                    break;
                }
            }
        }
    }

    /// y or the displacement, and its derivative, beyond the last node.
    fn approaching(&self, t: f64) -> (f64, f64) {
        let Some(from) = &self.approach else {
            let last = self.nodes[self.nodes.len() - 1].value;
            return (last[0], last[1]);
        };
        let since = t - from.t;
        let left = from.rate * since;
        let left = if left > SPENT { left.exp() } else { 0.0 };
        let excess = from.ln_excess * left;
        match self.quantity {
            Quantity::Velocity => (
                from.steady_y * (1.0 + excess),
                from.steady_y * excess * from.rate,
            ),
            Quantity::Displacement => (
                from.value + (since - (excess - from.ln_excess) / from.rate) / from.steady_y,
                (1.0 - excess) / from.steady_y,
            ),
        }
    }

    fn piece(&mut self, node: usize) -> &Piece {
        let bit = 1 << node;
        if self.known & bit == 0 {
            self.pieces[node] = Piece::new(&self.nodes[node], &self.nodes[node + 1]);
            self.known |= bit;
        }
        &self.pieces[node]
    }

    /// ln y at the end of the record.
    pub(super) fn last_ln_y(&mut self, shape: &CurveShape) -> f64 {
        let mut end = [0.0];
        self.follow(&CurveWindow::WHOLE, &[1.0], &mut end, None);
        debug_assert!(self.quantity == Quantity::Velocity);
        // The side of the steady state is kept, however near it is.
        let ln_y = -end[0].ln();
        let least = f64::EPSILON * shape.ln_steady.abs();
        if shape.ln_steady < 0.0 {
            ln_y.max(shape.ln_steady + least)
        } else {
            ln_y.min(shape.ln_steady - least)
        }
    }
}

impl Piece {
    const NONE: Self = Self {
        over_span: 0.0,
        low: [0.0; 4],
        high: [0.0; 4],
    };

    fn new(from: &CurveNode, to: &CurveNode) -> Self {
        let h = to.t - from.t;
        let scaled = |v: &[f64; 4]| [v[0], v[1] * h, v[2] * h * h / 2.0, v[3] * h * h * h / 6.0];
        let (c, d) = (scaled(&from.value), scaled(&to.value));
        // What the cubic of the first end leaves at the second, divided by x^4 about x = 1.
        let r0 = d[0] - (c[0] + c[1] + c[2] + c[3]);
        let r1 = d[1] - (c[1] + 2.0 * c[2] + 3.0 * c[3]);
        let r2 = d[2] - (c[2] + 3.0 * c[3]);
        let r3 = d[3] - c[3];
        Self {
            over_span: 1.0 / h,
            low: c,
            high: [
                r0,
                r1 - 4.0 * r0,
                r2 - 4.0 * r1 + 10.0 * r0,
                r3 - 4.0 * r2 + 10.0 * r1 - 20.0 * r0,
            ],
        }
    }

    /// Value and derivative so long after the first end; the derivative only where wanted.
    fn at<const WITH_RATE: bool>(&self, since: f64) -> (f64, f64) {
        let (c, e) = (&self.low, &self.high);
        let x = since * self.over_span;
        let u = x - 1.0;
        let fourth = (x * x) * (x * x);
        let upper = (e[0] + u * e[1]) + (u * u) * (e[2] + u * e[3]);
        let value = (c[0] + x * c[1]) + (x * x) * (c[2] + x * c[3]) + fourth * upper;
        if !WITH_RATE {
            return (value, 0.0);
        }
        let lower_rate = c[1] + x * (2.0 * c[2] + x * (3.0 * c[3]));
        let upper_rate = e[1] + u * (2.0 * e[2] + u * (3.0 * e[3]));
        let rate = lower_rate + x * x * x * (4.0 * upper + x * upper_rate);
        (value, rate * self.over_span)
    }
}

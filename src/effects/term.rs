//! Effects as terms of the law and of the reading, and the prediction that they make together.

use super::act::Act;
use super::kind::Kind;
use super::problem::Problem;
use super::response::Response;
use crate::model::{Drive, Driven, Law, LoadEvent};
use crate::reading::{Quantity, Timestamp, after_days};

/// One effect with its shape; its coefficients stand among the parameters.
#[derive(Debug, Clone)]
pub(super) struct Term {
    pub(super) kind: Kind,
    /// Index of the covariate.
    pub(super) channel: Option<usize>,
    pub(super) response: Option<Response>,
    /// Index of the reading before which it happens.
    pub(super) at: Option<usize>,
    /// How much of the time between that reading and the one before it had passed by then, 0 to 1.
    pub(super) share: f64,
    pub(super) act: Act,
}

impl Term {
    /// How many coefficients it has.
    pub(super) fn coefficients(&self) -> usize {
        self.act.coefficients()
    }

    /// Whether it is a jump of the reading, and not of the ground.
    pub(super) fn is_jump_of_reading(&self) -> bool {
        matches!(self.act, Act::Reading(_)) && self.at.is_some()
    }

    /// What it costs in the BIC: coefficients, and the shape that was searched for.
    pub(super) fn parameters(&self) -> f64 {
        let has_start = self.response.is_some_and(|own| own.before != 0.0);
        let shape = [self.at.is_some(), self.response.is_some(), has_start];
        let shape = shape.into_iter().filter(|has| *has).count();
        (self.coefficients() + shape) as f64
    }
}

/// Parameters of the law, before those of the terms: ln of the first velocity (mm/day); r times the span; ln of
/// a times the span; p; and for displacements where the first reading's zero is.
pub(super) fn law_parameters(problem: &Problem) -> usize {
    match problem.quantity {
        Quantity::Displacement => 5,
        Quantity::Velocity => 4,
    }
}

/// Where among the parameters the coefficients of the term of that index stand.
pub(super) fn coefficients_of(
    problem: &Problem,
    terms: &[Term],
    index: usize,
) -> std::ops::Range<usize> {
    let earlier: usize = terms[..index].iter().map(Term::coefficients).sum();
    let from = law_parameters(problem) + earlier;
    from..from + terms[index].coefficients()
}

/// How the load answers to the motion, and over how long the motion is read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Feedback {
    /// eta: the log-load lost per mm/day of velocity.
    pub(super) per_velocity: f64,
    /// k: the log-load lost per mm of slip.
    pub(super) per_slip: f64,
    /// Days over which velocities are means; 0: of the moment.
    pub(super) averaging: f64,
}

impl Feedback {
    pub(super) fn of(problem: &Problem, terms: &[Term], parameters: &[f64]) -> Self {
        let (typical, span) = (problem.typical_velocity(), problem.whole_span());
        let mut feedback = Self {
            per_velocity: 0.0,
            per_slip: 0.0,
            averaging: problem.averaging_days,
        };
        let mut at = law_parameters(problem);
        for term in terms {
            match term.act {
                Act::PerVelocity => feedback.per_velocity = parameters[at].max(0.0) / typical,
                Act::PerSlip => feedback.per_slip = parameters[at] / (typical * span),
                Act::Averaging => feedback.averaging += parameters[at].max(0.0) * problem.spacing,
                Act::Load(_) | Act::Step | Act::Reset | Act::Friction(_) | Act::Reading(_) => {}
            }
            at += term.coefficients();
        }
        feedback
    }
}

/// Bounds of ln(a span) and of p: beyond them nothing changes that readings could show.
const LN_A_SPAN: (f64, f64) = (-7.0, 6.0);
const P: (f64, f64) = (-3.0, 0.95);

/// ln(a span) of a law of which a is not known: the middle of what is held to be likely of it.
const ANY_LN_A: f64 = -1.0;
/// p of a law that is bent the same way, where its own lies beyond what parameters stand for.
const ANY_P: f64 = -1.0;
/// Near m = 1 the curvature is all that shows: a law with a times the span larger than this, at a p smaller than that, is the same with
/// the smaller a.
const LARGE_A: f64 = 50.0;
const SMALL_P: f64 = 0.05;
/// Times the span, a curvature of the inverse velocity smaller than this is none.
const STRAIGHT: f64 = 1e-3;

/// The law's own parameters, but for the zero of displacements, that stand for `law`: for one as near to it as may be where m < 0,
/// for which none stand.
pub(super) fn parameters_of(law: &Law, span: f64) -> [f64; 4] {
    let kappa = law.kappa * span;
    let (ln_a, p) = if kappa.abs() < STRAIGHT {
        (ANY_LN_A, 0.0)
    } else if law.a > 0.0 && law.a * span < LARGE_A {
        ((law.a * span).ln(), law.p)
    } else if law.p.abs() < SMALL_P {
        (LARGE_A.ln(), kappa / LARGE_A)
    } else {
        ((kappa / ANY_P).ln(), ANY_P)
    };
    let ln_a = ln_a.clamp(LN_A_SPAN.0, LN_A_SPAN.1);
    [law.v_i.ln(), law.r * span, ln_a, p.clamp(P.0, P.1)]
}

/// Room for solutions, and the newest of them.
#[derive(Debug, Clone, Default)]
pub(super) struct Scratch {
    pub(super) driven: Driven,
    pub(super) prediction: Vec<f64>,
    pub(super) log_load: Vec<f64>,
    events: Vec<LoadEvent>,
}

/// The law that the parameters stand for; mm and days, t = 0 at the first node.
pub(super) fn law(span: f64, parameters: &[f64]) -> Law {
    let a = parameters[2].clamp(LN_A_SPAN.0, LN_A_SPAN.1).exp() / span;
    let r = parameters[1] / span;
    let p = parameters[3].clamp(P.0, P.1);
    Law {
        v_i: parameters[0].exp(),
        r,
        kappa: a * p,
        p,
        a,
        b: a + r,
    }
}

impl Scratch {
    /// The prediction of every reading; `false` where the velocity becomes infinite before the last.
    pub(super) fn predict(
        &mut self,
        problem: &Problem,
        terms: &[Term],
        parameters: &[f64],
    ) -> bool {
        // The scales are those of the whole record, so that parameters mean the same on a part of it.
        let span = problem.whole_span();
        let law = law(span, parameters);
        let first = law_parameters(problem);
        self.load(problem, terms, &parameters[first..], span);
        let feedback = Feedback::of(problem, terms, parameters);
        let drive = Drive {
            nodes: &problem.nodes,
            log_load: &self.log_load,
            events: &self.events,
            per_velocity: feedback.per_velocity,
            per_slip: feedback.per_slip,
        };
        if !self.driven.solve(&law, &drive) {
            return false;
        }
        read(
            problem,
            &self.driven,
            feedback.averaging,
            &mut self.prediction,
        );
        if problem.quantity == Quantity::Displacement {
            for value in &mut self.prediction {
                *value += parameters[4];
            }
        }
        let mut at = first;
        for term in terms {
            if let Act::Reading(columns) = &term.act {
                for (column, size) in columns.iter().zip(&parameters[at..]) {
                    for (value, by) in self.prediction.iter_mut().zip(column) {
                        *value += size * by;
                    }
                }
            }
            at += term.coefficients();
        }
        true
    }

    /// Gathers f(t) at the nodes, and what happens at them.
    fn load(&mut self, problem: &Problem, terms: &[Term], coefficients: &[f64], span: f64) {
        self.log_load.clear();
        self.log_load.resize(problem.nodes.len(), 0.0);
        self.events.clear();
        let mut at = 0;
        for term in terms {
            let own = &coefficients[at..at + term.coefficients()];
            at += own.len();
            if let Act::Load(columns) = &term.act {
                for (column, gain) in columns.iter().zip(own) {
                    for (f, by) in self.log_load.iter_mut().zip(column) {
                        *f += gain * by;
                    }
                }
            }
            let Some(reading) = term.at else { continue };
            let (node, early) = event_place(problem, (reading, term.share));
            let mut event = LoadEvent {
                node,
                early,
                log_load: 0.0,
                ln_y: 0.0,
                ln_a: 0.0,
                b: 0.0,
                p: 0.0,
            };
            match term.act {
                Act::Step => event.log_load = own[0],
                Act::Reset => event.ln_y = own[0],
                Act::Friction(_) => {
                    let change = |index: usize| own.get(index).copied().unwrap_or(0.0);
                    (event.b, event.ln_a) = (change(0) / span, change(1));
                    event.p = change(2);
                }
                Act::Load(_)
                | Act::PerVelocity
                | Act::PerSlip
                | Act::Reading(_)
                | Act::Averaging => continue,
            }
            self.events.push(event);
        }
        let earlier = |one: &LoadEvent, other: &LoadEvent| {
            let by_node = one.node.cmp(&other.node);
            by_node.then(other.early.total_cmp(&one.early))
        };
        self.events.sort_by(earlier);
    }
}

/// From the motion to what would be read of it, velocities as means over `averaging` days.
pub(super) fn read(problem: &Problem, driven: &Driven, averaging: f64, readings: &mut Vec<f64>) {
    readings.clear();
    let value = |&node: &usize| match problem.quantity {
        Quantity::Displacement => driven.slip[node],
        Quantity::Velocity if averaging <= 0.0 => driven.velocity[node],
        Quantity::Velocity => {
            let from = problem.nodes[node] - averaging;
            (driven.slip[node] - slip_at(problem, driven, from)) / averaging
        }
    };
    readings.extend(problem.node_of.iter().map(value));
}

/// The velocity before the first node differs from the first one's by no more than so many e-folds.
const MOST_BEFORE: f64 = 1.0;

/// Where what happens once is tried: in the middle between two readings.
pub(super) const MIDDLE: f64 = 0.5;

/// When what happens once happened; `None` of what acts all along.
pub(super) fn time_of(problem: &Problem, term: &Term) -> Option<Timestamp> {
    let (node, early) = event_place(problem, (term.at?, term.share));
    after_days(problem.epoch, problem.nodes[node] - early)
}

/// Of an event before a reading, with the share of the time since the reading before that had passed: the first node that
/// it does not come after, and the days between.
pub(super) fn event_place(problem: &Problem, (reading, share): (usize, f64)) -> (usize, f64) {
    let after = problem.t[reading];
    let before = reading
        .checked_sub(1)
        .map_or(problem.nodes[0], |before| problem.t[before]);
    let t = after - (1.0 - share) * (after - before);
    let last = problem.node_of[reading];
    let node = problem.nodes[..last].partition_point(|node| *node < t);
    (node, (problem.nodes[node] - t).max(0.0))
}

/// The motion before the first node: the velocity grows there as it does over as long a time after it.
pub(super) struct MotionBefore {
    /// The slip from the first node back, in days at that node's velocity, below 0.
    pub(super) days: f64,
    /// Its change by that of the growth, days squared.
    pub(super) by_growth: f64,
    /// The growth is that of ln v from the first node to this one, so many days after it.
    pub(super) ahead: usize,
    pub(super) apart: f64,
}

impl MotionBefore {
    /// Back to `t`, by the velocities at the nodes.
    pub(super) fn back_to(problem: &Problem, velocity: &[f64], t: f64) -> Self {
        let first = problem.nodes[0];
        let back = t - first;
        let mirrored = problem.nodes.partition_point(|node| *node <= first - back);
        let ahead = mirrored.clamp(1, problem.nodes.len() - 1);
        let apart = problem.nodes[ahead] - first;
        let growth = (velocity[ahead] / velocity[0]).ln() / apart;
        let exponent = growth * back;
        let (days, by_growth) = if !exponent.is_finite() || exponent.abs() < 1e-5 {
            (back, 0.5 * back * back)
        } else if exponent.abs() < MOST_BEFORE {
            let days = exponent.exp_m1() / growth;
            (days, (back * exponent.exp() - days) / growth)
        } else {
            let days = MOST_BEFORE.copysign(exponent).exp_m1() / growth;
            (days, -days / growth)
        };
        Self {
            days,
            by_growth,
            ahead,
            apart,
        }
    }
}

/// Slip at `t`, between nodes by the velocities at both; before the first node the velocity grows as it does over as long a
/// time after it.
pub(super) fn slip_at(problem: &Problem, driven: &Driven, t: f64) -> f64 {
    let k = problem.nodes.partition_point(|node| *node <= t);
    let Some(before) = k.checked_sub(1) else {
        return driven.slip[0]
            + driven.velocity[0] * MotionBefore::back_to(problem, &driven.velocity, t).days;
    };
    let (h, v) = (t - problem.nodes[before], driven.velocity[before]);
    let Some(&next) = problem.nodes.get(k) else {
        return driven.slip[before] + v * h;
    };
    let whole = next - problem.nodes[before];
    // Cubic: slips and velocities of both ends.
    let s = h / whole;
    let rise = driven.slip[k] - driven.slip[before];
    let (m_0, m_1) = (v * whole, driven.velocity[k] * whole);
    let cubic = s * s * (3.0 - 2.0 * s) * rise + s * (1.0 - s) * ((1.0 - s) * m_0 - s * m_1);
    driven.slip[before] + cubic
}

//! The solution from t = 0 on, piece by piece: beside a steady state, Taylor segments, before failure.

use super::accuracy::Accuracy;
use super::coefficients::Coefficients;
use super::law::Law;
use super::relaxation::Relaxation;
use super::tail;
use super::taylor::{BlockPoint, Segment};

/// Where the segments stop and the last stretch before failure begins, and where the block is then.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tail {
    pub(super) start: f64,
    pub(super) at: BlockPoint,
    pub(super) failure_days: f64,
}

/// The pieces of a solution, in the order of time.
#[derive(Debug, Clone)]
pub(super) struct SolutionPath {
    departure: Option<Relaxation>,
    segments: Vec<Segment>,
    arrival: Option<Relaxation>,
    tail: Option<Tail>,
}

/// What holds at a time asked for.
#[derive(Debug, Clone, Copy)]
pub(super) enum PathPlace {
    /// Where the block is.
    At(BlockPoint),
    /// So many days before the failure, on the tail.
    BeforeFailure(f64),
    /// Past the failure, or past what was solved.
    Nowhere,
}

impl SolutionPath {
    /// Room for a solution; what a slope needs is under 30 segments as a rule.
    pub(super) fn empty() -> Self {
        Self {
            departure: None,
            segments: Vec::with_capacity(32),
            arrival: None,
            tail: None,
        }
    }

    /// Solves over `[0, end_days]`, in the room that there is.
    pub(super) fn solve(
        &mut self,
        law: &Law,
        coefficients: &Coefficients,
        end_days: f64,
        accuracy: Accuracy,
    ) {
        self.segments.clear();
        (self.departure, self.arrival, self.tail) = (None, None, None);
        let fails = tail::fails_from(law, 0.0);
        let order = accuracy.order();
        let (mut t, mut at) = (0.0, BlockPoint { y: 1.0, slip: 0.0 });
        self.departure = Relaxation::new(coefficients, order, t, at);
        if let Some(departure) = &self.departure {
            if departure.end > end_days {
                return;
            }
            t = departure.end;
            at = departure.at(t);
        }
        while t <= end_days && self.segments.len() < accuracy.most_segments() {
            if fails && at.y.ln() < accuracy.ln_y_of_tail() {
                self.tail = Some(Tail {
                    start: t,
                    at,
                    failure_days: tail::remaining_days(law, 0.0),
                });
                return;
            }
            if law.kappa < 0.0 && self.departure.is_none() {
                self.arrival = Relaxation::new(coefficients, order, t, at);
                if self.arrival.is_some() {
                    return;
                }
            }
            let mut segment = Segment::expand(coefficients, order, t, at);
            segment.span = segment
                .span
                .min((end_days - t).max(0.0) * 1.01 + f64::MIN_POSITIVE);
            let next = t + segment.span;
            at = segment.at(next);
            self.segments.push(segment);
            let BlockPoint { y, slip } = at;
            if !(next > t && y > 0.0 && y.is_finite() && slip.is_finite()) {
                return;
            }
            t = next;
        }
    }

    pub(super) fn tail(&self) -> Option<&Tail> {
        self.tail.as_ref()
    }

    /// What holds `t` days after the start.
    pub(super) fn place(&self, t: f64) -> PathPlace {
        if let Some(tail) = &self.tail
            && t > tail.start
        {
            return if t < tail.failure_days {
                PathPlace::BeforeFailure(tail.failure_days - t)
            } else {
                PathPlace::Nowhere
            };
        }
        let beside = self.departure.iter().chain(&self.arrival);
        if let Some(beside) = beside
            .into_iter()
            .find(|one| t >= one.start && t <= one.end)
        {
            return PathPlace::At(beside.at(t));
        }
        let index = self
            .segments
            .partition_point(|segment| segment.start() <= t)
            .saturating_sub(1);
        match self.segments.get(index) {
            Some(segment) if t <= segment.start() + segment.span * (1.0 + 1e-9) => {
                let at = segment.at(t);
                if at.y > 0.0 {
                    PathPlace::At(at)
                } else {
                    PathPlace::Nowhere
                }
            }
            _ => PathPlace::Nowhere,
        }
    }
}

//! Whether `explain` finds what was put into measured readings, with nothing declared, beside what it says of them as they
//! are.

use crate::put_in::{Changed, PutIn, What, put_in};
use slipwatch::effects::{Effect, Explanation, FaultKind, Kind, Options, explain};
use slipwatch::reading::{Channel, Series, days_since};

/// An event is found where it is dated within so many of the usual intervals between readings.
const NEAR_INTERVALS: f64 = 3.0;
/// A wave that the readings had before is found where it is said to be so many times as large as before.
const LARGER: f64 = 3.0;

/// One effect put in, and what was said without and with it.
#[derive(Debug)]
pub(crate) struct Trial {
    pub(crate) put_in: PutIn,
    pub(crate) without: Explanation,
    pub(crate) with: Explanation,
    /// Median days between readings.
    interval_days: f64,
}

/// What came nearest to the effect that was put in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Found {
    pub(crate) kind: Kind,
    /// Named among the faults of the data, before any search.
    pub(crate) as_fault: bool,
    /// Days too late; of a wave none.
    pub(crate) late_days: Option<f64>,
    /// As what was put in.
    pub(crate) size: Option<f64>,
}

impl Trial {
    /// One trial; `None` where the effect cannot be put in.
    pub(crate) fn of(
        series: &Series,
        channels: &[Channel],
        without: &Explanation,
        (what, seed): (What, u64),
    ) -> Option<Self> {
        let Changed {
            series: changed,
            put_in,
        } = put_in(series, without, what, seed)?;
        let readings = series.readings.windows(2);
        let mut gaps: Vec<f64> = readings
            .map(|pair| days_since(pair[0].time, pair[1].time))
            .collect();
        gaps.sort_by(f64::total_cmp);
        Some(Self {
            put_in,
            without: without.clone(),
            with: alone(&changed, channels),
            interval_days: *gaps.get(gaps.len() / 2)?,
        })
    }

    /// What was found of it: of its kind, or, of a step of the velocity, of a kind that changes the velocity too.
    pub(crate) fn found(&self) -> Option<Found> {
        let right = self.put_in.what.kind();
        self.nearest(&[right]).or_else(|| match self.put_in.what {
            What::Step => self.nearest(&[Kind::STATE_RESET, Kind::FRICTION_CHANGE]),
            What::Reset | What::Tide | What::Season => None,
        })
    }

    /// Whether it was found as what it is.
    pub(crate) fn is_right(&self) -> bool {
        self.found()
            .is_some_and(|found| found.kind == self.put_in.what.kind())
    }

    /// The error of a date in the intervals between readings.
    pub(crate) fn intervals(&self, days: f64) -> f64 {
        days / self.interval_days
    }

    /// Whether it is said of the readings as they are too: an event is known by its date, a wave by its size.
    fn is_new(&self, one: &Effect) -> bool {
        if self.put_in.what.period_days().is_none() {
            return true;
        }
        let before = effects(&self.without).into_iter();
        let before = before.filter(|old| old.effect == one.effect);
        let sizes = before.filter_map(|old| old.size).map(|old| LARGER * old);
        one.size.unwrap_or(0.0) > sizes.fold(0.0, f64::max)
    }

    fn nearest(&self, kinds: &[Kind]) -> Option<Found> {
        let late = |said| days_since(self.put_in.at, said);
        let said = effects(&self.with).into_iter().filter_map(|one| {
            (kinds.contains(&one.effect) && self.is_new(one)).then_some(Found {
                kind: one.effect,
                as_fault: false,
                late_days: one.at.map(late),
                size: one.size,
            })
        });
        let faults = self.with.faults.iter().filter(|fault| {
            fault.channel.is_none()
                && fault.kind == FaultKind::Reset
                && kinds.contains(&Kind::OFFSET)
        });
        // What has to be added to all that follows is the jump's opposite.
        let faults = faults.map(|fault| Found {
            kind: Kind::OFFSET,
            as_fault: true,
            late_days: Some(late(fault.at)),
            size: fault.size.map(|size| -size),
        });
        let off = |found: &Found| found.late_days.unwrap_or(0.0).abs();
        said.chain(faults)
            .filter(|found| off(found) <= NEAR_INTERVALS * self.interval_days)
            .min_by(|one, other| off(one).total_cmp(&off(other)))
    }
}

/// Explained by itself and the channels beside it: the effect is put into one benchmark only.
pub(crate) fn alone(series: &Series, channels: &[Channel]) -> Explanation {
    explain(series, channels, &[], &Options::default(), &mut |_| ())
}

/// The verdict and what was accepted after it.
pub(crate) fn effects(explanation: &Explanation) -> Vec<&Effect> {
    let verdict = std::iter::once(&explanation.verdict);
    verdict.chain(&explanation.also).collect()
}

/// Every effect put in by itself, as it was drawn by its seed.
pub(crate) fn trials(series: &Series, channels: &[Channel], all: &[(What, u64)]) -> Vec<Trial> {
    let without = alone(series, channels);
    let each = all.iter();
    each.filter_map(|drawn| Trial::of(series, channels, &without, *drawn))
        .collect()
}

//! The values of one covariate, and what in them hardly means what was intended.

use super::view::CovariateView;
use crate::reading::{CovariateKind, RunningTotal, Sample, Timestamp, suspicion};
use jiff::civil::Time;
use jiff::tz::TimeZone;

/// Values that fall on so many days, and at one time of day alone, are totals of days.
const FEWEST_DAYS: usize = 3;

#[derive(Debug)]
pub(super) struct PreviewCovariate {
    view: CovariateView,
    values: Vec<(Timestamp, f64)>,
}

impl PreviewCovariate {
    pub(super) fn new(view: CovariateView) -> Self {
        Self {
            view,
            values: Vec::new(),
        }
    }

    pub(super) fn take(&mut self, Sample { time, value }: Sample) {
        let view = &mut self.view;
        view.values += 1;
        (view.first, view.last) = (view.first.min(time), view.last.max(time));
        self.values.push((time, value));
    }

    /// What there is to say of it.
    pub(super) fn finish(mut self) -> CovariateView {
        self.values.sort_by_key(|(time, _)| *time);
        // Of several values of one time the last one counts.
        self.values.reverse();
        self.values.dedup_by_key(|(time, _)| *time);
        self.values.reverse();
        while let Some((mark, text)) = suspicion::mark_in(&self.values) {
            self.view.suspicions.push(text);
            self.values
                .retain(|(_, value)| value.to_bits() != mark.to_bits());
        }
        if self.view.kind == CovariateKind::Rain {
            self.view.remarks.push(self.total());
        }
        self.view
    }

    /// What is said of rain that is taken as it falls.
    fn as_it_falls(&self) -> String {
        let taken = "rain as it falls: each value is taken for what fell since the one before it";
        match self.set_back_daily() {
            Some(time) => format!(
                "{taken}. But it falls at {time} UTC alone, as a total of each day does: let the logger write what falls between its values, or a \
                 total that is not set back each day"
            ),
            None => format!(
                "{taken}; a total of a day, or of the last 24 h, would be counted several times"
            ),
        }
    }

    /// The time of day at which the values fall, where they do so on several days and at no other time.
    fn set_back_daily(&self) -> Option<Time> {
        let pairs = self.values.windows(2);
        let falls = pairs.filter(|pair| pair[1].1 < pair[0].1);
        let mut times = falls.map(|pair| pair[1].0.to_zoned(TimeZone::UTC).time());
        let first = times.next()?;
        let others: Vec<Time> = times.collect();
        let rises = self.values.windows(2).filter(|pair| pair[1].1 > pair[0].1);
        (others.len() + 1 >= FEWEST_DAYS
            && others.iter().all(|time| *time == first)
            && rises.count() > others.len() + 1)
            .then_some(first)
    }

    fn total(&self) -> String {
        let values: Vec<f64> = self.values.iter().map(|(_, value)| *value).collect();
        let Some(total) = RunningTotal::of(&values) else {
            return self.as_it_falls();
        };
        let Some((first, _)) = total
            .set_back
            .first()
            .and_then(|place| self.values.get(*place))
        else {
            return "a running total of rain, which is never set back".to_owned();
        };
        let times = match total.set_back.len() {
            1 => "once".to_owned(),
            many => format!("{many} times"),
        };
        format!(
            "a running total of rain, set back {times}, first at {first}: explain and the monitor's searches go on from what it was"
        )
    }
}

//! The values of one covariate, and what in them hardly means what was intended.

use super::view::CovariateView;
use crate::reading::{CovariateKind, RunningTotal, Timestamp, suspicion};

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

    pub(super) fn take(&mut self, (time, value): (Timestamp, f64)) {
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
            self.view.remarks.extend(self.total());
        }
        self.view
    }

    fn total(&self) -> Option<String> {
        let values: Vec<f64> = self.values.iter().map(|(_, value)| *value).collect();
        let total = RunningTotal::of(&values)?;
        let Some((first, _)) = total
            .set_back
            .first()
            .and_then(|place| self.values.get(*place))
        else {
            return Some("a running total of rain, which is never set back".to_owned());
        };
        let times = match total.set_back.len() {
            1 => "once".to_owned(),
            many => format!("{many} times"),
        };
        Some(format!(
            "a running total of rain, set back {times}, first at {first}: explain and the monitor's searches go on from what it was"
        ))
    }
}

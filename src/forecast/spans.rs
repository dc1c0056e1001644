//! The spans of time within which the chance of a collapse is asked for, and what becomes of these chances.

use super::members::LONGEST_DAYS;
use super::scales::FEWEST_BLOCKS;
use super::{Passage, Scales};

/// Spans beyond the longest scale on which the network was trained, and how many more are asked for: without them nothing could come later than
/// one and a half to three times the record's length, and the chance within 30 days of ten days of readings was that within 16.
const BEYOND: usize = 3;
const FURTHER: usize = 2;
/// Steps of the distribution in one doubling of time.
const STEPS: u32 = 8;
/// Spans before the one whose chance also counts within them, the power of time with which it grows, and how far readings are apart, days,
/// where it does not count and where it does in full. Of 13,864 looks at drawn slopes read each week, the log score fell by a seventh.
pub(super) const FIRST_SPANS: usize = 2;
const TO_COME: f64 = 1.5;
pub(super) const FAR_APART_DAYS: (f64, f64) = (1.0, 7.0);

/// A span whose chance the network is asked for.
pub(super) struct AskedSpan {
    /// Doublings of the shortest scale.
    pub(super) power: usize,
    pub(super) days: f64,
    /// How much of the doubling since the span before counts: the longest span grows with the record, and none is there at once.
    pub(super) share: f64,
}

impl AskedSpan {
    /// Within how many days its chance counts.
    pub(super) fn counts_within(&self) -> f64 {
        self.days * (self.share - 1.0).exp2()
    }
}

pub(super) fn spans(scales: &Scales) -> impl Iterator<Item = AskedSpan> {
    let count = scales.each.len();
    let base = scales.base_days;
    let last = count + BEYOND + FURTHER - 1;
    let longest = scales.each.last().map_or(base, |scale| scale.days);
    let on_its_way = (scales.length_days / (FEWEST_BLOCKS as f64 * longest)).log2();
    let doubled = (0..=last).scan(base, move |days, power| {
        let this = *days;
        *days *= 2.0;
        let share = if power == last { on_its_way } else { 1.0 };
        Some(AskedSpan {
            power,
            days: this,
            share: share.clamp(0.0, 1.0),
        })
    });
    doubled.take_while(|span| span.days <= LONGEST_DAYS)
}

/// From (days, chance within them), counted from where the newest velocity is centred. Between two of them the chance grows
/// as the law has it, as far as the law puts the collapse there, and for the rest evenly with ln of time; before the first
/// it grows with time.
pub(super) fn passage(within: &[(f64, f64)], law: &Passage, centred_before_days: f64) -> Passage {
    let mut times = Vec::new();
    let mut add =
        |days: f64, share: f64| times.push(((days - centred_before_days).max(0.0), share));
    let steps = f64::from(STEPS);
    if let Some((days, chance)) = within.first() {
        for step in 0..STEPS {
            add(days * (f64::from(step) + 0.5) / steps, chance / steps);
        }
    }
    let law: Vec<(f64, f64)> = law
        .times()
        .iter()
        .map(|(days, share)| (days + centred_before_days, *share))
        .collect();
    for pair in within.windows(2) {
        let ((from, before), (to, chance)) = (pair[0], pair[1]);
        let first = law.partition_point(|(days, _)| *days <= from);
        let last = law.partition_point(|(days, _)| *days <= to);
        let laws = &law[first..last];
        let by_the_law: f64 = laws.iter().map(|(_, share)| share).sum();
        let grows = chance - before;
        for (days, share) in laws {
            add(*days, grows * share);
        }
        for step in 0..STEPS {
            let way = (f64::from(step) + 0.5) / steps;
            let even = grows * (1.0 - by_the_law).max(0.0) / steps;
            add(from * (to / from).powf(way), even);
        }
    }
    Passage::from_times(times)
}

/// The chances within the first spans no less than a hazard that grows as time to the power [`TO_COME`] has them, where readings are days
/// apart: the records it was trained on ended at least one interval after the last evaluation, and slopes do not wait for the next reading.
pub(super) fn between_far_readings(chances: &mut [(f64, f64)]) {
    let Some((days, chance)) = chances.get(FIRST_SPANS).copied() else {
        return;
    };
    let (near, far) = FAR_APART_DAYS;
    let counts = ((chances[0].0 - near) / (far - near)).clamp(0.0, 1.0);
    for own in &mut chances[..FIRST_SPANS] {
        let share = (own.0 / days).powf(TO_COME);
        own.1 = own.1.max(counts * (1.0 - (1.0 - chance).powf(share)));
    }
}

/// `chances` within each span no less than `others` of the same spans.
pub(super) fn at_least(chances: &mut [(f64, f64)], others: &[(f64, f64)]) {
    for (own, other) in chances.iter_mut().zip(others) {
        own.1 = own.1.max(other.1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{Observation, Observations};
    use crate::reading::Quantity;

    /// The longest time within which a chance is asked for, days, after so many hourly readings.
    fn longest(count: u32) -> f64 {
        let values = (0..count).map(|hour| Observation {
            t_days: f64::from(hour) / 24.0,
            value: 0.1 * f64::from(hour) + f64::from(hour % 3),
            sigma: None,
        });
        let observations = Observations {
            quantity: Quantity::Displacement,
            averaging_days: 0.0,
            values: values.collect(),
        };
        let scales = Scales::of(&observations).unwrap();
        spans(&scales).last().unwrap().counts_within()
    }

    #[test]
    fn the_longest_span_grows_with_the_record_and_never_at_once() {
        for count in 30..800 {
            let (before, after) = (longest(count), longest(count + 1));
            let grown = after / before;
            assert!((1.0..1.05).contains(&grown), "{count}: {before} to {after}");
        }
    }
}

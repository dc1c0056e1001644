//! A series as a row of marks.

use crate::alert::Level;
use crate::reading::{TimeSpan, Timestamp, days_since, figure};

/// From low to high.
const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// Marks, and what the lowest and the highest stand for.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MarkScale {
    pub(super) marks: String,
    span: Option<(f64, f64)>,
}

impl MarkScale {
    /// The largest positive value of each of `count` parts of the time, on a logarithmic scale; blank where a part
    /// has none.
    pub(super) fn of(points: Vec<(Timestamp, f64)>, span: TimeSpan, count: usize) -> Self {
        let mut parts: Vec<Option<f64>> = vec![None; count];
        for (time, value) in points {
            let part = &mut parts[part(time, span, count)];
            *part = Some(part.map_or(value, |other: f64| other.max(value)));
        }
        let known = || parts.iter().flatten().copied();
        let ends = known().reduce(f64::min).zip(known().reduce(f64::max));
        let bar = |value: f64, (low, high): (f64, f64)| {
            let height = if high > low {
                (value / low).ln() / (high / low).ln()
            } else {
                0.0
            };
            let step = BARS
                .iter()
                .enumerate()
                .take_while(|(step, _)| *step as f64 / 7.0 <= height + 1e-9);
            step.last().map_or(BARS[0], |(_, bar)| *bar)
        };
        let mark =
            |part: &Option<f64>| part.zip(ends).map_or(' ', |(value, ends)| bar(value, ends));
        Self {
            marks: parts.iter().map(mark).collect(),
            span: ends,
        }
    }

    /// The lowest and the highest value.
    pub(super) fn ends(&self) -> String {
        let decimals = |value: f64| match value {
            _ if value < 0.1 => 3,
            _ if value < 10.0 => 1,
            _ => 0,
        };
        let shown = |value: f64| figure(value, decimals(value));
        self.span.map_or_else(
            || "none".to_owned(),
            |(low, high)| format!("{}-{}", shown(low), shown(high)),
        )
    }
}

/// The highest level of each part of the time, and where a part has no reading the one before.
pub(super) fn levels(
    points: impl Iterator<Item = (Timestamp, Level)>,
    span: TimeSpan,
    count: usize,
) -> String {
    let mut parts: Vec<Option<Level>> = vec![None; count];
    for (time, level) in points {
        let part = &mut parts[part(time, span, count)];
        *part = (*part).max(Some(level));
    }
    let mut before = Level::Green;
    let letter = |part: Option<Level>| {
        before = part.unwrap_or(before);
        match before {
            Level::Green => '.',
            Level::Yellow => 'y',
            Level::Orange => 'o',
            Level::Red => 'r',
            Level::Unknown => '?',
        }
    };
    parts.into_iter().map(letter).collect()
}

fn part(time: Timestamp, span: TimeSpan, count: usize) -> usize {
    let share = days_since(span.from, time) / days_since(span.from, span.to);
    let place = (0..count).take_while(|place| *place as f64 <= share * (count as f64 - 1.0) + 1e-9);
    place.last().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hour(hour: i64) -> Timestamp {
        Timestamp::new(hour * 3600, 0).unwrap()
    }

    #[test]
    fn marks_rise_with_the_logarithm_and_are_blank_where_nothing_was_measured() {
        let points = vec![(hour(0), 1.0), (hour(1), 10.0), (hour(3), 100.0)];
        let scale = MarkScale::of(points, TimeSpan::new(hour(0), hour(3)), 4);
        assert_eq!(
            (scale.marks.as_str(), scale.ends().as_str()),
            ("▁▄ █", "1.0-100")
        );
        let none = MarkScale::of(Vec::new(), TimeSpan::new(hour(0), hour(3)), 4);
        assert_eq!(
            (none.marks.as_str(), none.ends().as_str()),
            ("    ", "none")
        );
    }

    #[test]
    fn a_level_holds_until_the_next_reading() {
        let points = [
            (hour(0), Level::Green),
            (hour(1), Level::Red),
            (hour(3), Level::Orange),
        ];
        assert_eq!(
            levels(points.into_iter(), TimeSpan::new(hour(0), hour(3)), 4),
            ".rro"
        );
    }
}

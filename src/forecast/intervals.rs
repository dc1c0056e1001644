//! How often a slope is read: usually, now, and from the newest reading on; and what fewer readings leave of noise.

use super::past_event::median;
use super::sessions::SPANS;

/// A slope is read more often now than it was where the median of so many of the newest spans between readings, or the longest of so
/// many, is under this share of the usual one; the next reading is as far away as the median of so many newest spans, where that is under
/// this share of the usual one or the usual one under this share of it.
const SPANS_NOW: usize = 24;
const SPANS_ALL_SHORT: usize = 4;
const SPANS_TO_NEXT: usize = 5;
const OFTENER: f64 = 0.25;
/// Blocks hold fewer readings than usual where the variance of a change that comes of it is over so many times the usual one.
const FEWER: f64 = 2.0;

/// Spans between readings, or between sessions of them, days.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Intervals {
    /// The median of many.
    usual: f64,
    /// As readings come now.
    pub(super) now: f64,
    /// From the newest one to the next, as the newest few have it.
    pub(super) to_next: f64,
}

impl Intervals {
    /// Of readings at these `days`, oldest first.
    pub(super) fn of(days: &[f64]) -> Self {
        let spans = days.windows(2).rev().map(|pair| pair[1] - pair[0]);
        let mut spans: Vec<f64> = spans.take(SPANS).collect();
        let newest = |count: usize| spans[..spans.len().min(count)].to_vec();
        let (mut now, mut to_next) = (newest(SPANS_NOW), newest(SPANS_TO_NEXT));
        let longest = newest(SPANS_ALL_SHORT).into_iter().fold(0.0, f64::max);
        let (now, to_next) = (longest.min(median(&mut now)), median(&mut to_next));
        let usual = median(&mut spans);
        let is_oftener = |one: f64, other: f64| one < OFTENER * other;
        let now = if is_oftener(now, usual) { now } else { usual };
        let is_other = is_oftener(to_next, now) || is_oftener(now, to_next);
        Self {
            usual,
            now,
            to_next: if is_other { to_next } else { now },
        }
    }

    /// The variance that the newest change of velocity over blocks of `block_days`, as a change of displacement from one block to the one so
    /// many before it, has beyond the usual one because these blocks hold fewer readings, at `days` up to 0: a multiple of the variance of one reading.
    pub(super) fn beyond_usual(&self, days: &[f64], block_days: f64, apart: u32) -> f64 {
        let squares = if apart == 1 {
            vec![(0, 1.0), (1, 4.0), (2, 1.0)]
        } else {
            vec![(0, 1.0), (1, 1.0), (apart, 1.0), (apart + 1, 1.0)]
        };
        let until = |block: u32| days.partition_point(|at| *at <= -f64::from(block) * block_days);
        let count = |block: u32| (until(block) - until(block + 1)).max(1) as f64;
        let usual_count = (block_days / self.usual).max(1.0);
        let usual: f64 = squares.iter().map(|(_, square)| square / usual_count).sum();
        let newest = squares.iter().map(|(block, square)| square / count(*block));
        let newest: f64 = newest.sum();
        if newest > FEWER * usual {
            newest - usual
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times of so many readings each so many days, one after the other, the newest at 0.
    fn read(parts: &[(u32, f64)]) -> Vec<f64> {
        let mut days = vec![0.0];
        for (count, span) in parts {
            days.extend((0..*count).map(|_| *span));
        }
        let mut at = 0.0;
        for day in &mut days {
            at += *day;
            *day = at;
        }
        days.iter().map(|day| day - at).collect()
    }

    #[test]
    fn a_slope_read_more_often_or_less_is_known_by_its_newest_readings() {
        let of = |parts: &[(u32, f64)]| {
            let Intervals { now, to_next, .. } = Intervals::of(&read(parts));
            (now, to_next)
        };
        assert_eq!(of(&[(30, 1.0)]), (1.0, 1.0));
        assert_eq!(of(&[(20, 30.0), (2, 1.0)]), (30.0, 30.0));
        assert_eq!(of(&[(20, 30.0), (3, 1.0)]), (30.0, 1.0));
        assert_eq!(of(&[(20, 30.0), (4, 1.0)]), (1.0, 1.0));
        assert_eq!(of(&[(200, 1.0), (2, 30.0)]), (1.0, 1.0));
        assert_eq!(of(&[(200, 1.0), (3, 30.0)]), (1.0, 30.0));
        // Half as often is no other sampling.
        assert_eq!(of(&[(200, 1.0), (3, 2.0)]), (1.0, 1.0));
    }

    #[test]
    fn blocks_with_fewer_readings_than_usual_have_more_noise() {
        let (as_usual, fewer) = (read(&[(90, 0.125)]), read(&[(90, 0.125), (6, 1.0)]));
        for block in [0.125, 0.5, 1.0, 4.0] {
            let usual = Intervals::of(&as_usual).beyond_usual(&as_usual, block, 1);
            assert!(usual.abs() < 1e-12, "{block}: {usual}");
        }
        // Where they are more than usual nothing is added, at no block.
        let more = read(&[(40, 1.0), (20, 0.125)]);
        for block in [0.125, 1.0, 4.0, 8.0] {
            let usual = Intervals::of(&more).beyond_usual(&more, block, 1);
            assert!(usual.abs() < 1e-12, "{block}: {usual}");
        }
        let few = Intervals::of(&fewer);
        let shortest = few.beyond_usual(&fewer, 0.125, 1);
        assert!(shortest.abs() < 1e-12, "{shortest}");
        for (apart, squares) in [(1, 6.0), (3, 4.0)] {
            let of_a_day = few.beyond_usual(&fewer, 1.0, apart);
            assert!(
                (of_a_day - squares * (1.0 - 0.125)).abs() < 1e-9,
                "{of_a_day}"
            );
        }
    }
}

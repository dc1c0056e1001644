//! Events in a record after which the slope slowed down by far more than it usually does: a slide that stopped, a reset, a few wrong
//! readings.

use crate::reading::{NORMAL_MEDIAN, upper_median};

/// A change is never known better than this, mm.
pub(super) const LEAST_CHANGE_MM: f64 = 1e-4;
/// Fewest changes among which one may stand out, how many standard deviations it does, taken from the median size, and the most
/// events that are not usual yet.
const FEWEST_CHANGES: usize = 32;
const OUTSTANDING: f64 = 10.0;
const MOST_EVENTS: usize = 2;
/// What lies within so many blocks, or this share of the record, is one event; and an event stands out that is so many times the
/// largest that is usual.
const ONE_EVENT: usize = 6;
const EVENTS: usize = 12;
const ABOVE_NEXT: f64 = 4.0;
/// An event is over when so much of its slow-down has passed.
const MOST_OF_IT: f64 = 0.8;

/// An event after which the slope slowed down by far more than it usually does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PastEvent {
    /// How long ago it was over, days.
    pub days: f64,
    /// How surely it stands out of all else, above 0 and at most 1: blocks move along with the newest reading, and a limit would be
    /// passed back and forth.
    pub share: f64,
    /// How fast the slope was, mm/day, in the fastest of the events, as the mean over blocks of [`PastEvent::block_days`].
    pub velocity: f64,
    /// Days.
    pub block_days: f64,
}

impl PastEvent {
    /// The newest of those that stand out nearly as surely as the one that does most, with the velocity of the fastest of these, where a share `usual` of
    /// all events is what often happens on the slope.
    pub(super) fn newest(found: &[Self], usual: f64) -> Option<Self> {
        let most = found.iter().map(|event| event.share).fold(0.0, f64::max);
        let sure = found.iter().filter(|event| event.share >= 0.5 * most);
        let newest = sure.clone().min_by(|a, b| a.days.total_cmp(&b.days))?;
        let fastest = sure
            .map(Self::over_a_day)
            .max_by(|a, b| a.velocity.total_cmp(&b.velocity))?;
        let share = most * (1.0 - usual);
        (share > 0.0).then_some(Self {
            days: newest.days,
            share,
            ..fastest
        })
    }

    /// With its velocity as the mean over a day at least: a jump is as large, however often the slope is read.
    fn over_a_day(&self) -> Self {
        let over = self.block_days.max(1.0);
        Self {
            velocity: self.velocity * self.block_days / over,
            block_days: over,
            ..*self
        }
    }
}

/// How much of a limit is passed: 0 at half of it, 1 at the whole.
fn nearly(ratio: f64) -> f64 {
    (1.0 + ratio.log2()).clamp(0.0, 1.0)
}

/// A slope that slows down.
#[derive(Debug, Clone, Copy)]
struct SlowDown {
    /// By which most of it was over.
    block: usize,
    /// Of the motion of a block, mm.
    by: f64,
    /// The motion of the fastest block before, mm.
    fastest: f64,
}

/// The sizes of the largest of these, largest first, each further than `apart` blocks from the larger ones.
fn largest_events(slow: &[SlowDown], apart: usize) -> [f64; MOST_EVENTS + 1] {
    let mut largest = [0.0; MOST_EVENTS + 1];
    let mut places: Vec<usize> = Vec::new();
    for event in &mut largest {
        let others = (slow.iter()).filter(|one| {
            places
                .iter()
                .all(|place| one.block.abs_diff(*place) > apart)
        });
        if let Some(one) = others.max_by(|a, b| a.by.total_cmp(&b.by)) {
            places.push(one.block);
            *event = one.by;
        }
    }
    largest
}

/// The upper one of the two middle ones of an even number; of no values no number.
pub(super) fn median(values: &mut [f64]) -> f64 {
    upper_median(values).unwrap_or(f64::NAN)
}

/// When, and by how much at most, mm, the slope slowed down within [`ONE_EVENT`] blocks up to `block`: a slope that is read often takes several of
/// them for it. The block is that by which most of it was over; `None` where it did not slow down.
fn slowed_down(
    means: &[f64],
    block: usize,
    is_read_over: impl Fn(usize) -> bool,
) -> Option<SlowDown> {
    let moved = |block: usize| Some(means.get(block)? - means.get(block + 1)?);
    let newest = moved(block)?;
    let over = (1..=ONE_EVENT).take_while(|over| is_read_over(*over));
    let faster = over.filter_map(|over| Some((block + over, moved(block + over)?)));
    let (top, fastest) = faster.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let by = fastest - newest;
    let is_over = |block: &usize| moved(*block).is_some_and(|now| fastest - now >= MOST_OF_IT * by);
    let end = (block..top).rev().find(is_over)?;
    (by > 0.0).then_some(SlowDown {
        block: end,
        by,
        fastest,
    })
}

/// The newest of one or two events after which the slope slowed down by far more than ever else: a slide that stopped, a reset, a
/// few readings that were wrong; and how surely more of them stand out, so that they are usual there. `None` with too few blocks.
pub(super) fn past_events(
    means: &[f64],
    is_read: &[bool],
    days: f64,
) -> Option<(Option<PastEvent>, f64)> {
    let count = means.len().checked_sub(2)?;
    if count < FEWEST_CHANGES {
        return None;
    }
    let moved = |block: usize| means[block] - means[block + 1];
    let is_read = |block: usize, over: usize| {
        let between = is_read.get(block..block + over + 2);
        between.is_some_and(|between| between.iter().all(|is| *is))
    };
    let read = (1..count).filter(|block| is_read(*block, 1));
    let mut sizes: Vec<f64> = read
        .map(|block| (moved(block) - moved(block + 1)).abs())
        .collect();
    if sizes.len() < FEWEST_CHANGES {
        return None;
    }
    let median = median(&mut sizes);
    if median < LEAST_CHANGE_MM {
        return None;
    }
    let slow: Vec<SlowDown> = (1..count)
        .filter_map(|block| slowed_down(means, block, |over| is_read(block, over)))
        .collect();
    let largest = largest_events(&slow, ONE_EVENT.max(count / EVENTS));
    let least = OUTSTANDING * median / NORMAL_MEDIAN;
    let next = largest[MOST_EVENTS];
    let share = |size: f64| nearly(size / least.max(ABOVE_NEXT * next));
    let events = slow.iter().map(|slow| PastEvent {
        days: (slow.block - 1) as f64 * days,
        share: share(slow.by),
        velocity: slow.fastest / days,
        block_days: days,
    });
    let events: Vec<PastEvent> = events.filter(|event| event.share > 0.0).collect();
    Some((PastEvent::newest(&events, 0.0), nearly(0.5 * next / least)))
}

//! A few readings far from their neighbours that come back: a mistake, not a motion.

use super::nature::Nature;
use super::trace::{Trace, resolution};
use crate::effects::quantiles::{median, robust_deviation};
use crate::reading::{DEVIATION_PER_MEDIAN, Quantity};
use std::ops::Range;

/// Fewer readings show no neighbourhood.
const FEWEST: usize = 20;
/// Neighbours looked at on either side.
const BESIDE: usize = 5;
/// So many displacements one after another may be wrong, as under snow, or while somebody works at the instrument; of velocities and covariates,
/// which rise and come back in earnest, fewer.
const TOGETHER: usize = 6;
const TOGETHER_WHERE_IT_COMES_BACK: usize = 2;
/// Readings that must follow: what the newest means nobody can know yet.
const AFTER: usize = 2;
/// Standard deviations about the line through the neighbours.
const FAR: f64 = 8.0;
/// The same for covariates, which have fast changes of their own.
const FAR_IN_CHANNEL: f64 = 15.0;
/// The nearest neighbours' share of the deviation, at most: what comes back in steps is a motion.
const COMES_BACK: f64 = 0.3;
/// Between gaps of more usual intervals than this on both sides a value may be a motion not seen.
const GAP: f64 = 3.0;
/// Fewest readings before the newest that show where it should stand.
const FEWEST_BEFORE: usize = 10;
/// So many times as large as any of the steps before it is the step to a newest reading that has come all at once.
const ALL_AT_ONCE: f64 = 5.0;
/// The same of the first reading, by which no collapse begins.
const FIRST_ALL_AT_ONCE: f64 = 3.0;
/// A slope that accelerates to failure leads up to it: the last step before it is the largest, and so many times the usual one.
const LEADS_UP: f64 = 2.0;
/// Of rain and of a river: fewest values above zero, and how many times the next largest a value is that cannot be.
const FEWEST_FALLS: usize = 20;
const BEYOND_ANY_PEAK: f64 = 300.0;
/// Outliers are few; where there are more, the noise has heavy tails and none is a mistake.
const FEW: f64 = 0.02;

/// Which readings of a benchmark are mistakes. Those that lie beside each other are one; there are at most 2 mistakes in 100 readings, rounded up.
///
/// The error of a velocity grows with it, so velocities must stand out by their logarithms too. The first reading is one of them where it
/// stands alone as [`newest_alone`] has it of the newest, time run backwards: the zero of a sensor that had not been installed yet.
pub(super) fn outlying_readings(trace: &Trace, quantity: Quantity) -> Vec<bool> {
    let together = match quantity {
        Quantity::Displacement => TOGETHER,
        Quantity::Velocity => TOGETHER_WHERE_IT_COMES_BACK,
    };
    let mut wrong = outlying(trace, FAR, together);
    if quantity == Quantity::Velocity && trace.values.iter().all(|value| *value > 0.0) {
        let mut logarithms = trace.clone();
        for value in &mut logarithms.values {
            *value = value.ln();
        }
        let by_factor = outlying(&logarithms, FAR, together);
        for (wrong, by_factor) in wrong.iter_mut().zip(by_factor) {
            *wrong &= by_factor;
        }
    }
    if trace.len() >= FEWEST && last_alone(&trace.backwards(), FIRST_ALL_AT_ONCE).is_some() {
        wrong[0] = true;
    }
    wrong
}

/// By how much the newest reading leaves the line of those before it, where it has left all at once: whether it is a mistake or the
/// beginning of a motion only what follows can show.
pub(super) fn newest_alone(trace: &Trace) -> Option<f64> {
    last_alone(trace, ALL_AT_ONCE)
}

fn last_alone(trace: &Trace, all_at_once: f64) -> Option<f64> {
    let newest = trace.len().checked_sub(1)?;
    let first = newest.checked_sub(FEWEST_BEFORE)?;
    let steps = trace.values[first..].windows(2).map(|two| two[1] - two[0]);
    let mut steps: Vec<f64> = absolute(&steps.collect::<Vec<f64>>());
    let last = steps.pop()?;
    let before: Vec<usize> = (first..newest).collect();
    let line = RobustLine::through(trace, &before);
    let off = trace.values[newest] - line.at(trace.days[newest]);
    let is_far = off.abs() > FAR * usual_deviation(trace);
    let largest = steps.iter().copied().fold(0.0, f64::max);
    let leads_up = steps.last()? >= &largest && largest > LEADS_UP * median(&steps);
    let gaps = trace.intervals();
    let is_seen = gaps.last().is_some_and(|gap| *gap <= GAP * median(&gaps));
    let is_alone = is_far && is_seen && !leads_up;
    (is_alone && last > all_at_once * largest).then_some(off)
}

/// Which values of a covariate are mistakes: dips out of the scatter, and peaks that
/// leave the range of all others by more than that range's width; smaller peaks may be weather, and
/// those of rain and of rivers always are.
pub(super) fn outlying_samples(trace: &Trace, nature: Nature) -> Vec<bool> {
    let mut wrong = outlying(trace, FAR_IN_CHANNEL, TOGETHER_WHERE_IT_COMES_BACK);
    if nature.has_peaks() {
        return beyond_any_peak(trace);
    }
    let rest = trace
        .values
        .iter()
        .zip(&wrong)
        .filter(|(_, wrong)| !**wrong);
    let (low, high) = rest.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (v, _)| {
        (low.min(*v), high.max(*v))
    });
    let width = high - low;
    for (index, wrong) in wrong.iter_mut().enumerate().skip(1) {
        let value = trace.values[index];
        let is_dip = value < trace.values[index - 1];
        *wrong &= is_dip || value > high + width;
    }
    wrong
}

/// Where one value is more than so many times the next largest of many it is no shower and no flood.
fn beyond_any_peak(trace: &Trace) -> Vec<bool> {
    let mut sorted: Vec<f64> = trace.values.clone();
    sorted.sort_by(f64::total_cmp);
    let falls = sorted.iter().filter(|value| **value > 0.0).count();
    let second = sorted.len().checked_sub(2).map_or(0.0, |at| sorted[at]);
    let is_beyond = |value: &f64| falls >= FEWEST_FALLS && *value > BEYOND_ANY_PEAK * second;
    trace.values.iter().map(is_beyond).collect()
}

fn outlying(trace: &Trace, far: f64, together: usize) -> Vec<bool> {
    let count = trace.len();
    let mut wrong = vec![false; count];
    if count < FEWEST {
        return wrong;
    }
    let usual = usual_deviation(trace);
    let gap = GAP * median(&trace.intervals());
    let most = (FEW * count as f64).ceil();
    for width in 1..=together {
        let narrower = wrong.clone();
        for start in 1..count.saturating_sub(width + AFTER - 1) {
            let end = start + width;
            let before = trace.days[start] - trace.days[start - 1];
            let after = trace.days[end] - trace.days[end - 1];
            let is_seen = before.min(after) <= gap && !wrong[start];
            if is_seen && stands_out(trace, start..end, far, usual) {
                wrong[start..end].fill(true);
            }
        }
        let stretches = wrong.chunk_by(|a, b| a == b);
        if stretches.filter(|stretch| stretch[0]).count() as f64 > most {
            return narrower;
        }
    }
    wrong
}

/// The scatter of readings about the line through their neighbours, over the whole series.
fn usual_deviation(trace: &Trace) -> f64 {
    let (days, values) = (&trace.days, &trace.values);
    let off = |at: usize| {
        let share = (days[at] - days[at - 1]) / (days[at + 1] - days[at - 1]);
        values[at] - values[at - 1] - share * (values[at + 1] - values[at - 1])
    };
    let offs: Vec<f64> = (1..trace.len() - 1).map(off).collect();
    // The middle of three adds half as much again to a reading's own variance.
    let own = (2.0_f64 / 3.0).sqrt();
    (own * robust_deviation(&offs)).max(0.5 * resolution(values))
}

/// Whether the readings `inside` leave the line of their neighbours, which hold it.
fn stands_out(trace: &Trace, inside: Range<usize>, far: f64, usual: f64) -> bool {
    let values = &trace.values;
    let (start, after) = (inside.start, inside.end);
    let before = start - 1;
    // Nothing monotone stands out: neither a step nor an acceleration.
    let sides = |index: usize| {
        (
            values[index] - values[before],
            values[index] - values[after],
        )
    };
    let is_peak = inside
        .clone()
        .all(|index| sides(index).0 * sides(index).1 > 0.0);
    let least = inside
        .clone()
        .map(|index| sides(index).0.abs().min(sides(index).1.abs()))
        .fold(f64::INFINITY, f64::min);
    if !is_peak || least <= far * usual {
        return false;
    }
    let low = start.saturating_sub(BESIDE);
    let high = (after + BESIDE).min(trace.len());
    let neighbours: Vec<usize> = (low..start).chain(after..high).collect();
    let line = RobustLine::through(trace, &neighbours);
    let off = |index: usize| values[index] - line.at(trace.days[index]);
    let offs: Vec<f64> = neighbours.iter().map(|&index| off(index)).collect();
    let deviation = usual.max(DEVIATION_PER_MEDIAN * median(&absolute(&offs)));
    inside.into_iter().all(|index| {
        let own = off(index).abs();
        let beside = off(before).abs().max(off(after).abs());
        own > far * deviation && beside < COMES_BACK * own
    })
}

fn absolute(values: &[f64]) -> Vec<f64> {
    values.iter().map(|value| value.abs()).collect()
}

/// A line that outliers do not turn: the median of all slopes (Theil and Sen).
struct RobustLine {
    day: f64,
    value: f64,
    slope: f64,
}

impl RobustLine {
    fn through(trace: &Trace, indices: &[usize]) -> Self {
        let day = indices.first().map_or(0.0, |&index| trace.days[index]);
        let mut slopes = Vec::with_capacity(indices.len() * indices.len() / 2);
        for (place, &a) in indices.iter().enumerate() {
            for &b in &indices[place + 1..] {
                let rise = trace.values[b] - trace.values[a];
                slopes.push(rise / (trace.days[b] - trace.days[a]));
            }
        }
        let slope = median(&slopes);
        let level = |&index: &usize| trace.values[index] - slope * (trace.days[index] - day);
        let levels: Vec<f64> = indices.iter().map(level).collect();
        Self {
            day,
            value: median(&levels),
            slope,
        }
    }

    fn at(&self, day: f64) -> f64 {
        self.value + self.slope * (day - self.day)
    }
}

#[cfg(test)]
mod tests {
    use crate::effects::faults::inspect;
    use crate::effects::fixture::{daily, generator, normals, series};
    use crate::reading::Quantity;

    #[test]
    fn up_to_six_readings_that_leave_and_come_back_are_mistakes_and_more_or_a_way_there_are_not() {
        let left = |off: &dyn Fn(usize) -> f64| {
            let days = daily(400);
            let noise = normals(&mut generator(5), days.len());
            let values = noise.iter().enumerate();
            let values = values.map(|(day, noise)| 0.3 * day as f64 + noise + off(day));
            let readings = series(Quantity::Displacement, &days, &values.collect::<Vec<f64>>());
            inspect(&readings, &[]).series.readings.len()
        };
        let within = |days: std::ops::Range<usize>| {
            move |day: usize| 30.0 * f64::from(u8::from(days.contains(&day)))
        };
        assert_eq!(left(&within(200..205)), 395);
        assert_eq!(left(&within(200..206)), 394);
        assert_eq!(left(&within(200..210)), 400);
        assert_eq!(left(&within(200..400)), 400);
        // A spike is one though a group of six is another, and the first reading by itself is one.
        assert_eq!(
            left(&|day| within(200..206)(day) - within(50..51)(day) + within(0..1)(day)),
            392
        );
        let wave = |day: usize| 30.0 * (-(day as f64 - 200.0).powi(2) / 18.0).exp();
        assert_eq!(left(&wave), 400);
    }

    #[test]
    fn velocities_that_rise_for_some_hours_and_come_back_are_a_surge() {
        let left = |hours: std::ops::Range<usize>| {
            let days = daily(400);
            let noise = normals(&mut generator(5), days.len());
            let values = noise.iter().enumerate();
            let values = values.map(|(hour, noise)| {
                (if hours.contains(&hour) { 40.0 } else { 2.0 }) + 0.2 * noise
            });
            let readings = series(Quantity::Velocity, &days, &values.collect::<Vec<f64>>());
            inspect(&readings, &[]).series.readings.len()
        };
        assert_eq!(left(200..206), 400);
        assert_eq!(left(200..201), 399);
    }

    #[test]
    fn two_of_eighty_readings_may_be_mistakes_and_three_are_heavy_tails() {
        let days = daily(80);
        for (wrong, left) in [(&[20, 50][..], 78), (&[20, 40, 60][..], 80)] {
            let noise = normals(&mut generator(5), days.len());
            let values = noise.iter().enumerate().map(|(day, noise)| {
                let mistake = if wrong.contains(&day) { 5.0 } else { 0.0 };
                0.3 * day as f64 + 0.1 * noise + mistake
            });
            let readings = series(Quantity::Displacement, &days, &values.collect::<Vec<f64>>());
            assert_eq!(inspect(&readings, &[]).series.readings.len(), left);
        }
    }
}

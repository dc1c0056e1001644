//! The motion of a slope over doubling spans of time, counted back from the newest reading.
//!
//! At scale k the record is cut into blocks of `base` times 2^k days and each block is reduced to its mean displacement.
//! A forecast rests on the newest velocity and the newest change of each scale, and on how large such changes were
//! before: a change that is usual for the instrument or for the slope is no evidence of anything.

use super::held_step::{self, BlockDisplacements};
use super::intervals::Intervals;
use super::past_event::{LEAST_CHANGE_MM, PastEvent, median, past_events};
use super::sessions::merged;
use crate::fit::{Observation, Observations, displacement_sigma, velocity_sigma};
use crate::reading::Quantity;
use std::cell::LazyCell;

/// No block is shorter, days: a quarter of an hour.
const FINEST_BLOCK_DAYS: f64 = 1.0 / 96.0;
/// Blocks of one scale, and scales, at most: they bound the work whatever the length of the record.
const MOST_BLOCKS: usize = 512;
const MOST_SCALES: usize = 24;
/// Fewest blocks of a scale.
pub(super) const FEWEST_BLOCKS: usize = 3;
/// Fewest readings.
const FEWEST_READINGS: usize = 6;
/// The usual change of the next shorter scale counts as much as so many observed ones.
const PRIOR_COUNT: f64 = 2.0;
/// Changes of neighbouring blocks overlap: so many of them are worth one that is independent.
const OVERLAP: f64 = 3.0;
/// Of the degrees of freedom at a scale, what is worth as much at the next longer one.
const CARRIED: f64 = 0.5;
/// The largest ratio of a single step to the motion of a span.
const MOST_JUMP: f64 = 3.0;

/// A change of velocity as a change of displacement over equal blocks, mm, with what is usual for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityChange {
    /// The newest one, mm; above 0 is faster.
    pub newest: f64,
    /// Standard deviation of such changes before, mm, from those that slow down: a noise slows down as often as it
    /// speeds up, a slope that fails only speeds up.
    pub usual: f64,
    /// Degrees of freedom of `usual`.
    pub freedom: f64,
    /// The largest one before, mm.
    pub largest: f64,
}

/// What one scale shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Length of a block, days.
    pub days: f64,
    /// Between the two newest blocks, mm/day.
    pub velocity: f64,
    /// The highest one before, of blocks other than the two newest, mm/day.
    pub highest_velocity: f64,
    /// The median of all before, mm/day.
    pub median_velocity: f64,
    /// From one block to the next.
    pub near: VelocityChange,
    /// From one block to the third before it.
    pub far: VelocityChange,
    /// Largest step between two readings over the motion of the two newest blocks.
    pub jump: f64,
    /// Standard error of a velocity as blocks are mostly read, mm/day: the newest ones may hold fewer readings.
    pub error: f64,
}

/// The scales of a record, shortest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Scales {
    /// Days of the shortest blocks: the sampling interval, or a quarter of an hour.
    pub base_days: f64,
    /// Median of the newest spans between readings, or between sessions of them, days.
    pub interval_days: f64,
    /// From the newest reading to the next one, as the newest few spans have it, days.
    pub to_next_days: f64,
    /// From the first reading to the newest, days.
    pub length_days: f64,
    /// Half of the span over which a velocity is the mean: so long before its time stamp it is centred, days.
    pub centred_before_days: f64,
    /// At least one.
    pub each: Vec<Scale>,
    /// The displacements that each is of.
    pub(super) courses: Vec<BlockDisplacements>,
    /// The newest of one or two events that stand out of all else in the record.
    pub disturbed: Option<PastEvent>,
}

/// Displacement over time as straight lines between readings; the newest reading is (0, 0).
struct Curve {
    days: Vec<f64>,
    mm: Vec<f64>,
    /// Integral from the first reading to each, mm days.
    area: Vec<f64>,
    /// The largest step between two readings from each on, mm.
    largest_step: Vec<f64>,
}

/// Block means of one scale, newest first, and which of the blocks hold a reading.
#[derive(Default)]
struct Blocks {
    days: f64,
    /// The integral of the curve to the end of each block and to the beginning of the last, where the means are of it.
    integrals: Vec<f64>,
    means: Vec<f64>,
    is_read: Vec<bool>,
}

/// Where one looks at a curve, from its newest reading backwards.
struct Backwards<'a> {
    curve: &'a Curve,
    /// Readings up to that time.
    before: usize,
}

impl Scales {
    /// The scales of all `observations`, with what stands out of them; `None` with too few of them.
    pub fn of(observations: &Observations) -> Option<Self> {
        Self::walk(observations, observations.values.len(), true)
    }

    /// The scales of the first `count` observations; no event is looked for.
    pub fn at(observations: &Observations, count: usize) -> Option<Self> {
        Self::walk(observations, count, false)
    }

    fn walk(observations: &Observations, count: usize, events: bool) -> Option<Self> {
        let values = observations.values.get(..count)?;
        if values.len() < FEWEST_READINGS {
            return None;
        }
        let values = &*merged(values);
        let curve = Curve::of(observations.quantity, observations.averaging_days, values);
        let intervals = Intervals::of(&curve.days);
        let interval_days = intervals.now;
        let base_days = interval_days.max(FINEST_BLOCK_DAYS);
        let noise = ReadingNoise::of(observations, values, interval_days);
        let (mut each, mut courses): (Vec<Scale>, Vec<BlockDisplacements>) =
            (Vec::new(), Vec::new());
        let mut blocks = Blocks::default();
        let (mut events_found, mut usual) = (Vec::new(), 0.0_f64);
        for power in 0..MOST_SCALES {
            blocks = curve.blocks(power, base_days, interval_days, &blocks);
            let Some(scale) = blocks.scale(each.last(), noise, &curve) else {
                break;
            };
            each.push(scale);
            courses.push(blocks.course(power, interval_days < 0.5 * base_days));
            if !events {
                continue;
            }
            if let Some((event, is_usual)) =
                past_events(&blocks.means, &blocks.is_read, blocks.days)
            {
                events_found.extend(event);
                usual = usual.max(is_usual);
            }
        }
        if observations.quantity == Quantity::Displacement {
            curve.count_fewer(intervals, values, &mut each);
        }
        (!each.is_empty()).then_some(Self {
            base_days,
            interval_days,
            to_next_days: intervals.to_next,
            length_days: -curve.days[0],
            centred_before_days: 0.5 * observations.averaging_days,
            each,
            courses,
            disturbed: PastEvent::newest(&events_found, usual),
        })
    }
}

/// What the errors of the readings make of a change of velocity over blocks.
#[derive(Debug, Clone, Copy)]
struct ReadingNoise {
    /// Of displacements of the stated standard error, mm; 0 where none is stated.
    change_mm: f64,
    /// Of velocities, whose errors add up: over blocks of a day, mm. It grows with the root of their length.
    of_a_day_mm: f64,
}

impl ReadingNoise {
    fn of(observations: &Observations, values: &[Observation], interval_days: f64) -> Self {
        let mut stated: Vec<f64> = values.iter().filter_map(|value| value.sigma).collect();
        let stated = (!stated.is_empty()).then(|| median(&mut stated));
        match observations.quantity {
            Quantity::Displacement => Self {
                // x0 - 2 x1 + x2.
                change_mm: stated.unwrap_or(0.0) * 6.0_f64.sqrt(),
                of_a_day_mm: 0.0,
            },
            Quantity::Velocity => {
                let apart = observations.averaging_days.max(interval_days);
                let sigma = stated.unwrap_or_else(|| velocity_sigma(values));
                Self {
                    change_mm: 0.0,
                    of_a_day_mm: sigma * apart.sqrt(),
                }
            }
        }
    }
}

impl Curve {
    fn of(quantity: Quantity, averaging_days: f64, values: &[Observation]) -> Self {
        let now = values[values.len() - 1].t_days;
        let days: Vec<f64> = values.iter().map(|value| value.t_days - now).collect();
        let mut mm: Vec<f64> = match quantity {
            Quantity::Displacement => values.iter().map(|value| value.value).collect(),
            Quantity::Velocity => integrated(averaging_days, values),
        };
        let newest = mm[mm.len() - 1];
        for value in &mut mm {
            *value -= newest;
        }
        let mut area = vec![0.0; mm.len()];
        for index in 1..mm.len() {
            let mean = f64::midpoint(mm[index - 1], mm[index]);
            area[index] = area[index - 1] + mean * (days[index] - days[index - 1]);
        }
        let mut largest_step = vec![0.0_f64; mm.len()];
        for index in (1..mm.len()).rev() {
            let step = (mm[index] - mm[index - 1]).abs();
            largest_step[index - 1] = largest_step[index].max(step);
        }
        Self {
            days,
            mm,
            area,
            largest_step,
        }
    }

    /// The usual changes of displacements with what the newest blocks have of noise because they hold fewer readings than those before.
    fn count_fewer(&self, intervals: Intervals, values: &[Observation], each: &mut [Scale]) {
        let sigma = LazyCell::new(|| {
            let mut stated: Vec<f64> = values.iter().filter_map(|value| value.sigma).collect();
            let stated = if stated.is_empty() {
                0.0
            } else {
                median(&mut stated)
            };
            stated.max(displacement_sigma(values))
        });
        for scale in each {
            for (change, apart) in [(&mut scale.near, 1), (&mut scale.far, 3)] {
                let beyond = intervals.beyond_usual(&self.days, scale.days, apart);
                if beyond > 0.0 {
                    change.usual = change.usual.hypot(beyond.sqrt() * *sigma);
                }
            }
        }
    }

    /// To be asked about ever earlier times, from `days` on.
    fn backwards(&self, days: f64) -> Backwards<'_> {
        Backwards {
            curve: self,
            before: self.days.partition_point(|at| *at <= days),
        }
    }

    /// The blocks of one scale, of which `shorter` are half as long. Sparse readings are taken as points at the two shortest
    /// scales: a mean over the line between two of them would blur the newest motion.
    fn blocks(&self, power: usize, base_days: f64, interval_days: f64, shorter: &Blocks) -> Blocks {
        let days = base_days * f64::powi(2.0, i32::try_from(power).unwrap_or(i32::MAX));
        let length = -self.days[0];
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a positive number, cut off at the most blocks"
        )]
        let count = ((length / days + 1e-6) as usize).min(MOST_BLOCKS);
        let end = |block: usize| -(block as f64) * days;
        let is_dense = interval_days < 0.5 * base_days;
        let (mut integrals, mut means) = (Vec::new(), Vec::with_capacity(count));
        let mut back = self.backwards(0.0);
        match power {
            0 if !is_dense => means.extend((0..count).map(|block| back.value(end(block)))),
            1 if !is_dense => means.extend((0..count).map(|block| {
                let newer = back.value(end(block));
                f64::midpoint(newer, back.value(end(block) - base_days))
            })),
            _ => {
                let known = shorter.integrals.iter().step_by(2).take(count + 1);
                integrals.extend(known);
                let mut back = self.backwards(end(integrals.len()));
                let others = integrals.len()..=count;
                integrals.extend(others.map(|block| back.integral(end(block))));
                means.extend(integrals.windows(2).map(|pair| (pair[0] - pair[1]) / days));
            }
        }
        Blocks {
            days,
            is_read: self.are_read(days, count, &shorter.is_read),
            integrals,
            means,
        }
    }

    /// Which of so many blocks hold a reading, of which `shorter` says the same for blocks half as long.
    fn are_read(&self, days: f64, count: usize, shorter: &[bool]) -> Vec<bool> {
        const ROUNDING: f64 = 1e-9;
        let known = shorter.chunks_exact(2).take(count);
        let mut are_read: Vec<bool> = known.map(|halves| halves[0] || halves[1]).collect();
        let mut before = self.days.len();
        for block in are_read.len()..count {
            let to = -(block as f64) * days;
            let oldest = to - days - ROUNDING;
            if before == self.days.len() {
                before = self.days.partition_point(|at| *at < oldest);
            }
            while before > 0 && self.days[before - 1] >= oldest {
                before -= 1;
            }
            are_read.push(self.days.get(before).is_some_and(|at| *at <= to + ROUNDING));
        }
        are_read
    }

    fn jump(&self, days: f64, usual: f64) -> f64 {
        let from = self.days.partition_point(|at| *at < -2.0 * days);
        let motion = self.mm.get(from).map_or(0.0, |first| first.abs());
        let largest = self.largest_step.get(from).copied().unwrap_or(0.0);
        (largest / motion.max(usual)).min(MOST_JUMP)
    }
}

impl Backwards<'_> {
    /// The reading before `days`, and how far on the way to the next one that is; `days` is no later than the last one
    /// that was asked about.
    fn place(&mut self, days: f64) -> (usize, f64) {
        let at = &self.curve.days;
        while self.before > 0 && at[self.before - 1] > days {
            self.before -= 1;
        }
        let after = self.before.clamp(1, at.len() - 1);
        let (from, to) = (at[after - 1], at[after]);
        (after - 1, ((days - from) / (to - from)).clamp(0.0, 1.0))
    }

    /// Displacement, mm.
    fn value(&mut self, days: f64) -> f64 {
        let (index, share) = self.place(days);
        let mm = &self.curve.mm;
        mm[index] + share * (mm[index + 1] - mm[index])
    }

    /// Integral of the displacement from the first reading, mm days.
    fn integral(&mut self, days: f64) -> f64 {
        let (index, share) = self.place(days);
        let Curve { days, mm, area, .. } = self.curve;
        let value = mm[index] + share * (mm[index + 1] - mm[index]);
        let span = share * (days[index + 1] - days[index]);
        area[index] + f64::midpoint(mm[index], value) * span
    }
}

/// Velocities added up to displacements, mm from the first: each holds for its span, or, as a point value, half
/// way to its neighbours.
fn integrated(averaging_days: f64, values: &[Observation]) -> Vec<f64> {
    let mut mm = vec![0.0];
    let mut reached = 0.0;
    for pair in values.windows(2) {
        let span = pair[1].t_days - pair[0].t_days;
        let is_mean = averaging_days > 0.0 && span <= 1.5 * averaging_days;
        let velocity = if is_mean {
            pair[1].value
        } else {
            f64::midpoint(pair[0].value, pair[1].value)
        };
        reached += velocity * span;
        mm.push(reached);
    }
    mm
}

impl Blocks {
    /// The newest of them; where readings are sparse (not `is_dense`) those of the two shortest scales are points.
    fn course(&self, power: usize, is_dense: bool) -> BlockDisplacements {
        let count = self.means.len().min(held_step::MOST_BLOCKS);
        let newest_days = match power {
            0 if !is_dense => 0.0,
            1 if !is_dense => 0.25 * self.days,
            _ => 0.5 * self.days,
        };
        BlockDisplacements {
            days: self.days,
            newest_days,
            displacements: self.means[..count].to_vec(),
            is_read: self.is_read[..count].to_vec(),
        }
    }

    /// What the blocks show; `None` where there are fewer than three. `shorter` is the scale below.
    fn scale(&self, shorter: Option<&Scale>, noise: ReadingNoise, curve: &Curve) -> Option<Scale> {
        let means = &self.means;
        if means.len() < FEWEST_BLOCKS {
            return None;
        }
        let prior = shorter.map(|scale| scale.near);
        let near = self.change(1, noise, prior);
        let first = VelocityChange {
            freedom: PRIOR_COUNT,
            ..near
        };
        let far = self.change(3, noise, Some(shorter.map_or(first, |scale| scale.far)));
        let mut before: Vec<f64> = means[1..]
            .windows(2)
            .map(|pair| (pair[0] - pair[1]) / self.days)
            .collect();
        // The one next to the newest shares a block with it.
        let highest = before.iter().skip(1).copied().fold(0.0, f64::max);
        let velocity = (means[0] - means[1]) / self.days;
        Some(Scale {
            days: self.days,
            velocity,
            highest_velocity: highest,
            median_velocity: median(&mut before),
            near,
            far,
            jump: curve.jump(self.days, near.usual),
            error: near.usual / self.days,
        })
    }

    /// The change of velocity over `apart` blocks.
    fn change(
        &self,
        apart: usize,
        noise: ReadingNoise,
        prior: Option<VelocityChange>,
    ) -> VelocityChange {
        let means = &self.means;
        let last = apart + 1;
        let at = |block: usize| {
            let ends = [block, block + 1, block + apart, block + last];
            let [a, b, c, d] = ends.map(|index| means[index]);
            (a - b) - (c - d)
        };
        let is_read = |block: usize| {
            let ends = [block, block + 1, block + apart, block + last];
            ends.iter().all(|index| self.is_read[*index])
        };
        // The first of those before that shares at most a block with the newest.
        let first = apart.div_ceil(2);
        let before = (first..means.len().saturating_sub(last)).filter(|block| is_read(*block));
        let (mut squares, mut count, mut largest) = (0.0, 0.0, 0.0_f64);
        for change in before.map(at) {
            squares += 2.0 * change.min(0.0).powi(2);
            count += 1.0;
            largest = largest.max(change);
        }
        let least = LEAST_CHANGE_MM.max(noise.change_mm);
        let known = prior.map_or(least, |prior| prior.usual);
        let known = known.max(noise.of_a_day_mm * self.days.sqrt());
        let square = (squares + PRIOR_COUNT * known * known) / (count + PRIOR_COUNT);
        let carried = prior.map_or(0.0, |prior| prior.freedom - PRIOR_COUNT);
        VelocityChange {
            newest: if means.len() > last { at(0) } else { 0.0 },
            usual: square.sqrt().max(LEAST_CHANGE_MM),
            freedom: PRIOR_COUNT + count / OVERLAP + CARRIED * carried,
            largest,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn readings(interval: f64, count: u32, at: impl Fn(f64) -> f64) -> Observations {
        let values = (0..count).map(|index| {
            let t_days = interval * f64::from(index);
            Observation {
                t_days,
                value: at(t_days),
                sigma: None,
            }
        });
        Observations {
            quantity: Quantity::Displacement,
            averaging_days: 0.0,
            values: values.collect(),
        }
    }

    #[test]
    fn readings_in_sessions_are_looked_at_as_their_means_are() {
        let round = |index: u32| {
            let (session, round) = (index / 3, index % 3);
            let t_days = f64::from(session) + f64::from(round) / 480.0;
            let scatter = [0.4, -0.7, 0.2][(index * 7 % 3) as usize];
            Observation {
                t_days,
                value: 2.0 * t_days + scatter,
                sigma: None,
            }
        };
        let of = |values: Vec<Observation>| Observations {
            quantity: Quantity::Displacement,
            averaging_days: 0.0,
            values,
        };
        let rounds: Vec<Observation> = (0..120).map(round).collect();
        let means = rounds.chunks(3).map(|session| Observation {
            t_days: session.iter().map(|one| one.t_days).sum::<f64>() / 3.0,
            value: session.iter().map(|one| one.value).sum::<f64>() / 3.0,
            sigma: None,
        });
        let means = Scales::of(&of(means.collect())).unwrap();
        assert_eq!(Scales::of(&of(rounds)).unwrap(), means);
        assert!((means.interval_days - 1.0).abs() < 1e-9);
    }

    #[test]
    fn steady_motion_has_one_velocity_and_no_change_at_any_scale() {
        let scales = Scales::of(&readings(0.25, 900, |t| 3.0 * t - 4e6)).unwrap();
        assert!(scales.each.len() >= 7);
        for scale in &scales.each {
            assert!((scale.velocity - 3.0).abs() < 1e-6, "{scale:?}");
            assert!((scale.median_velocity - 3.0).abs() < 1e-6, "{scale:?}");
            assert!(scale.near.newest.abs() < 1e-5 && scale.far.newest.abs() < 1e-5);
        }
    }

    #[test]
    fn a_wave_is_its_own_usual_change_and_an_acceleration_is_not() {
        let wave = |t: f64| 5.0 * (std::f64::consts::TAU * t).sin();
        let daily = Scales::of(&readings(1.0 / 24.0, 480, wave)).unwrap();
        for scale in &daily.each {
            assert!(scale.near.newest < 3.0 * scale.near.usual, "{scale:?}");
        }
        let clean = Scales::of(&readings(1.0 / 24.0, 480, |t| {
            -20.0 * (1.0 - t / 21.0).ln()
        }));
        let clean = clean.unwrap();
        let most = clean
            .each
            .iter()
            .map(|scale| scale.near.newest / scale.near.usual)
            .fold(0.0, f64::max);
        assert!(most > 100.0, "{most}");
    }

    #[test]
    fn one_event_disturbs_a_record_and_what_happens_often_does_not() {
        // A rough slope: not every step is the same.
        let rough = |t: f64| t + 0.3 * (7.3 * t).sin();
        let jumps = |times: &'static [f64]| {
            move |t: f64| rough(t) + 50.0 * times.iter().filter(|at| t >= **at).count() as f64
        };
        let over = |times| {
            let scales = Scales::of(&readings(1.0, 120, jumps(times)));
            scales.unwrap().disturbed.map(|event| event.days)
        };
        assert_eq!(over(&[]), None);
        assert_eq!(over(&[20.0, 40.0, 60.0, 80.0, 100.0]), None);
        for times in [&[60.0][..], &[30.0, 60.0]] {
            let ago = over(times).unwrap();
            assert!((50.0..=59.0).contains(&ago), "{times:?}: {ago}");
        }
    }

    #[test]
    fn a_past_event_counts_less_by_degrees_as_more_of_its_kind_are_seen() {
        let rough = |t: f64| t + 0.3 * (7.3 * t).sin();
        let share = |others: f64| {
            let jumps = move |t: f64| {
                let of = |at: f64, by: f64| if t >= at { by } else { 0.0 };
                rough(t) + of(60.0, 50.0) + of(20.0, others) + of(40.0, others) + of(90.0, others)
            };
            let scales = Scales::of(&readings(1.0, 120, jumps)).unwrap();
            scales.disturbed.map_or(0.0, |event| event.share)
        };
        let shares = [0.0, 4.0, 6.0, 8.0, 10.0, 14.0, 20.0, 40.0].map(share);
        assert!(shares[0] > 0.99 && shares[7] < 0.01, "{shares:?}");
        let gradual = shares.iter().filter(|share| (0.05..=0.95).contains(*share));
        assert!(gradual.count() >= 1, "{shares:?}");
    }

    #[test]
    fn velocities_add_up_to_the_motion_that_they_are_of() {
        let mut velocities = readings(0.5, 200, |_| 7.0);
        velocities.quantity = Quantity::Velocity;
        let scales = Scales::of(&velocities).unwrap();
        assert!((scales.each[2].velocity - 7.0).abs() < 1e-9);
    }
}

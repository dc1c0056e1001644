//! Whether the readings of one benchmark are spoilt: whether they jump back and forth by more than any slope does.

use super::history::History;
use crate::fit::Observation;
use crate::reading::Quantity;
use std::ops::RangeInclusive;

/// The readings that are examined.
const INSPECTED: RangeInclusive<usize> = 18..=36;
/// A spike stands out by so many times what its neighbours differ by,
const SPIKE: f64 = 20.0;
/// and by so many steps of the sensor's resolution.
const STEPS: f64 = 20.0;
/// The share of spikes from which on the readings are spoilt, and the least number of them. Of noise alone 3 % are.
const SPOILT: f64 = 0.26;
/// The share of turns, where a jump follows one the other way. Of noise alone no step is so large.
const TURNING: f64 = 0.25;
const FEWEST_FOUND: usize = 5;
/// Once they were spoilt by so much, spikes and jumps count from this share of it, and half as many are enough.
const STILL: f64 = 1.0 / 3.0;
const FEWER: f64 = 0.5;

/// Steps between readings that show what is usual, at most.
const USUAL: usize = 200;
/// A jump is so many times as large as the quarter of the inspected steps that is smallest,
const QUARTER: (f64, f64) = (0.25, 20.0);
/// or as half of the steps before them, of which there are so many, and as nearly all of these,
const HALF: (f64, f64) = (0.5, 20.0);
const NEARLY_ALL: (f64, f64) = (0.98, 10.0);
const FEWEST_BEFORE: usize = 36;
/// or, where many were spoilt from the beginning, as half of all steps, half the size of these. Some steps are tiny then, under so
/// large a share of a step in the middle: of so many in all so many, and a share of them more than of noise.
const MIDDLE: f64 = 0.5;
const TINY: f64 = 0.03;
const FEWEST_IN_ALL: usize = 100;
const FEWEST_TINY: (f64, f64) = (4.0, 0.06);
/// Velocities are noisier the faster the slope: a jump is at least this share of them.
const OF_VELOCITY: f64 = 0.5;
/// Noise hides a velocity where half of the steps are this share of what that velocity is and more, and this share of them go the
/// other way than the one before: of a noise without memory two thirds do.
const HIDES: f64 = 0.5;
const TURNS_OF_NOISE: f64 = 0.5;

impl History {
    /// Whether many of the newest readings lie far off both neighbours, which agree, or whether many of the steps between them are
    /// jumps that go back and forth: by how much, in the middle.
    ///
    /// `before` is by how much they were spoilt. Where they were, the neighbours need not agree: on a slope that grows fast they
    /// differ as well.
    pub(super) fn spoilt(&self, before: Option<f64>) -> Option<f64> {
        let Some(latest) = self.inspected() else {
            return before;
        };
        let factor = if before.is_some() { FEWER } else { 1.0 };
        let is_many = |count: usize, share: f64| count as f64 >= factor * many(latest, share);
        let still = before.map(|before| STILL * before);
        let spikes = spikes(latest, still);
        if is_many(spikes.len(), SPOILT) {
            return before.or_else(|| of_all(spikes, 0.5));
        }
        if before.is_none() && !self.may_jump(latest) {
            return None;
        }
        let (turns, jumps) = jumps(latest, still.unwrap_or_else(|| self.jump_size(latest)));
        is_many(turns, TURNING).then(|| before.or_else(|| of_all(jumps, 0.5)))?
    }

    /// Whether the newest readings go back and forth by so much that a slope could pass `critical` mm/day and move so for
    /// `days`, or from one reading to the next, without its showing: the size of their steps.
    pub(super) fn noise_that_hides(&self, critical: f64, days: f64) -> Option<f64> {
        let latest = self.inspected()?;
        let (first, last) = (latest.first()?, latest.last()?);
        let interval = (last.t_days - first.t_days) / (latest.len() - 1) as f64;
        let would_move = match self.observations.quantity {
            Quantity::Displacement => critical * days.max(interval),
            Quantity::Velocity => {
                let sizes = latest.iter().map(|one| one.value.abs()).collect();
                critical.max(of_all(sizes, 0.5)?)
            }
        };
        let (turns, each) = jumps(latest, 0.0);
        let share = turns as f64 / (latest.len() - 2) as f64;
        let are_large = each
            .iter()
            .filter(|step| **step >= HIDES * would_move)
            .count();
        // Half of the steps: hardly any noise has so many.
        if share < TURNS_OF_NOISE || are_large < each.len() / 2 {
            return None;
        }
        of_all(each, 0.5).filter(|usual| *usual >= HIDES * would_move)
    }

    /// The newest readings, where there are enough to be examined.
    fn inspected(&self) -> Option<&[Observation]> {
        let values = &self.observations.values;
        let latest = &values[values.len().saturating_sub(*INSPECTED.end())..];
        (latest.len() >= *INSPECTED.start()).then_some(latest)
    }

    /// Whether so many steps between the `latest` readings as there must be may be jumps: each reading is asked, and hardly any has
    /// to go by [`History::jump_size`] then.
    fn may_jump(&self, latest: &[Observation]) -> bool {
        let inspected = steps(latest);
        let least = many(latest, TURNING);
        // As many turns have one step more.
        let fewest = (0..inspected.len()).find(|count| *count as f64 >= least);
        let Some(size) = fewest.and_then(|count| nth_largest(&inspected, count)) else {
            return false;
        };
        let is_less = |usual: f64| usual < size;
        if is_less(times(&inspected, QUARTER)) {
            return true;
        }
        let values = &self.observations.values;
        let earlier = self.steps_before(latest);
        let lies_under = |(share, factor): (f64, f64)| {
            let under = earlier.iter().filter(|step| is_less(factor * **step));
            index_of(share, earlier.len()).is_some_and(|at| under.count() > at)
        };
        if earlier.len() >= FEWEST_BEFORE && lies_under(HALF) && lies_under(NEARLY_ALL) {
            return true;
        }
        let all = steps(&values[values.len().saturating_sub(USUAL)..]);
        has_tiny_steps(&all, &inspected)
    }

    /// Of the readings before the `latest`, the newest of them.
    fn steps_before(&self, latest: &[Observation]) -> Vec<f64> {
        let values = &self.observations.values;
        let (earlier, _) = values.split_at(values.len() - latest.len());
        steps(&earlier[earlier.len().saturating_sub(USUAL)..])
    }

    /// From what size on a step between two of the `latest` readings is a jump.
    fn jump_size(&self, latest: &[Observation]) -> f64 {
        let earlier = self.steps_before(latest);
        let step = resolution(latest);
        let usual = if earlier.len() >= FEWEST_BEFORE {
            times(&earlier, HALF).max(times(&earlier, NEARLY_ALL))
        } else {
            f64::INFINITY
        };
        let usual = usual.min(times(&steps(latest), QUARTER));
        let all = self.steps_before(&[]);
        let usual = usual.min(spoilt_from_the_beginning(&all, step));
        let least = match self.observations.quantity {
            Quantity::Displacement => 0.0,
            Quantity::Velocity => {
                let sizes = latest.iter().map(|one| one.value.abs()).collect();
                of_all(sizes, 0.5).map_or(0.0, |usual| OF_VELOCITY * usual)
            }
        };
        usual.max(STEPS * step).max(least)
    }
}

/// So many times the one of `steps` that this share of them lies under.
fn times(steps: &[f64], (share, factor): (f64, f64)) -> f64 {
    of_all(steps.to_vec(), share).map_or(f64::INFINITY, |usual| factor * usual)
}

/// Whether [`spoilt_from_the_beginning`] may find so many tiny ones among `steps`, of which these are the `latest`: where a limit
/// that is larger than the step in the middle has too few below its share, that one has too few too.
fn has_tiny_steps(steps: &[f64], latest: &[f64]) -> bool {
    let Some(at) = index_of(MIDDLE, steps.len()).filter(|_| steps.len() >= FEWEST_IN_ALL) else {
        return false;
    };
    let limit = 2.0 * times(latest, (MIDDLE, 1.0));
    let holds = steps.iter().filter(|step| **step <= limit).count() > at;
    let tiny = steps.iter().filter(|step| **step <= TINY * limit).count();
    !holds || are_many_tiny(tiny, steps.len())
}

fn are_many_tiny(tiny: usize, of: usize) -> bool {
    let (fewest, share) = FEWEST_TINY;
    tiny as f64 >= fewest + share * of as f64
}

/// From what size on one of these steps is a jump where there are more tiny ones than noise has: its steps are tiny by chance.
fn spoilt_from_the_beginning(steps: &[f64], resolution: f64) -> f64 {
    let middle = times(steps, (MIDDLE, 1.0));
    let tiny = steps.iter().filter(|step| **step <= TINY * middle).count();
    let are_many = are_many_tiny(tiny, steps.len());
    let can_be_seen = steps.len() >= FEWEST_IN_ALL && TINY * middle > 2.0 * resolution;
    if are_many && can_be_seen {
        MIDDLE * middle
    } else {
        f64::INFINITY
    }
}

/// The sizes of the readings that lie off both neighbours by more than `still`, or where there is none stand out.
fn spikes(latest: &[Observation], still: Option<f64>) -> Vec<f64> {
    let step = resolution(latest);
    let size_of = |three: &[Observation]| {
        let (rise, fall) = (
            three[1].value - three[0].value,
            three[2].value - three[1].value,
        );
        let size = rise.abs().min(fall.abs());
        let stands_out = match still {
            Some(still) => size > still,
            None => size > SPIKE * (rise + fall).abs() && size > STEPS * step,
        };
        (rise * fall < 0.0 && stands_out).then_some(size)
    };
    latest.windows(3).filter_map(size_of).collect()
}

/// How many of the steps larger than `least` go the other way than the one before them that is so large, and the sizes of all that
/// are.
fn jumps(latest: &[Observation], least: f64) -> (usize, Vec<f64>) {
    let each = latest.windows(2).map(|pair| pair[1].value - pair[0].value);
    let large: Vec<f64> = each.filter(|step| step.abs() > least).collect();
    let turns = large.windows(2).filter(|pair| pair[0] * pair[1] < 0.0);
    (turns.count(), large.iter().map(|step| step.abs()).collect())
}

/// The sizes of the steps from each of `values` to the next.
fn steps(values: &[Observation]) -> Vec<f64> {
    let each = values.windows(2);
    each.map(|pair| (pair[1].value - pair[0].value).abs())
        .collect()
}

/// The one of `sizes` that this share of them lies under.
fn of_all(mut sizes: Vec<f64>, share: f64) -> Option<f64> {
    let at = index_of(share, sizes.len())?;
    let (_, size, _) = sizes.select_nth_unstable_by(at, f64::total_cmp);
    Some(*size)
}

/// Which of so many, by size, this share of them lies under.
fn index_of(share: f64, count: usize) -> Option<usize> {
    let last = count.checked_sub(1)?;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a count"
    )]
    let at = (share * count as f64) as usize;
    Some(at.min(last))
}

/// The one of `sizes` of which so many are larger, or as large.
fn nth_largest(sizes: &[f64], before: usize) -> Option<f64> {
    let at = sizes.len().checked_sub(before + 1)?;
    let mut sizes = sizes.to_vec();
    let (_, size, _) = sizes.select_nth_unstable_by(at, f64::total_cmp);
    Some(*size)
}

/// From how many spikes or turns on this share of them among the `latest` readings is many.
fn many(latest: &[Observation], share: f64) -> f64 {
    (share * (latest.len() - 2) as f64).max(FEWEST_FOUND as f64)
}

/// The least that a reading differs by from one of the next two, where it does.
fn resolution(values: &[Observation]) -> f64 {
    let next = values.windows(2).map(|pair| pair[1].value - pair[0].value);
    let after = values
        .windows(3)
        .map(|three| three[2].value - three[0].value);
    let steps = next.chain(after).map(f64::abs).filter(|step| *step > 0.0);
    steps.fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{history, history_of, noise};
    use crate::reading::Unit;

    fn slope(hour: u32) -> f64 {
        200.0 * (120.0 / (120.0 - f64::from(hour))).ln() + noise(hour)
    }

    #[test]
    fn spikes_and_signs_that_alternate_are_spoilt_and_noise_and_acceleration_are_not() {
        let third = |hour: u32| if hour.is_multiple_of(3) { 300.0 } else { 0.0 };
        let sign = |hour: u32| if hour.is_multiple_of(2) { 1.0 } else { -1.0 };
        assert!(
            history((0..80).map(|hour| slope(hour) + third(hour)))
                .spoilt(None)
                .is_some()
        );
        assert!(
            history((40..80).map(|hour| slope(hour) * sign(hour)))
                .spoilt(None)
                .is_some()
        );
        // Near its end the slope itself moves as much from one reading to the next.
        let late = history((0..119).map(|hour| slope(hour) + third(hour)));
        assert!(late.spoilt(Some(300.0)).is_some());
        assert!(history((0..119).map(slope)).spoilt(Some(300.0)).is_none());
        for end in 18..119 {
            assert_eq!(history((0..end).map(slope)).spoilt(None), None, "{end}");
        }
        for end in 18..2000 {
            let latest = (end - 18..end).map(noise);
            assert_eq!(history(latest).spoilt(None), None, "{end}");
            let coarse = (end - 18..end).map(|hour| noise(hour).round());
            assert_eq!(history(coarse).spoilt(None), None, "{end}");
        }
    }

    #[test]
    fn whether_there_may_be_jumps_is_answered_yes_wherever_there_are() {
        let wild = |hour: u32| {
            let by = 600.0 * (noise(hour + 7001) - 0.5);
            slope(hour) + if noise(hour + 3001) < 0.6 { by } else { 0.0 }
        };
        let later = |hour: u32| if hour < 60 { slope(hour) } else { wild(hour) };
        let block = |hour: u32| 300.0 * f64::from(u8::from((hour / 3).is_multiple_of(2)));
        let tiny = |hour: u32| {
            let by = 600.0 * (noise(hour + 7001) - 0.5);
            noise(hour) / 1000.0 + if hour.is_multiple_of(5) { 0.0 } else { by }
        };
        let kinds: [&dyn Fn(u32) -> f64; 6] = [
            &slope,
            &wild,
            &later,
            &|hour| slope(hour) + block(hour),
            &tiny,
            &noise,
        ];
        let (mut jumping, mut still) = (0, 0);
        for kind in kinds {
            for end in 18..119 {
                let history = history((0..end).map(kind));
                let latest = history.inspected().unwrap();
                let turns = super::jumps(latest, history.jump_size(latest)).0;
                let has_jumps = turns as f64 >= super::many(latest, super::TURNING);
                assert!(history.may_jump(latest) || !has_jumps, "{end}: {turns}");
                jumping += u32::from(has_jumps);
                still += u32::from(!history.may_jump(latest));
            }
        }
        assert!(jumping > 100 && still > 100, "{jumping}, {still}");
    }

    #[test]
    fn readings_that_are_wild_without_any_pattern_are_spoilt_from_the_beginning_and_from_later_on()
    {
        for (share, since) in [(0.5, 0), (0.5, 60), (0.7, 60), (0.9, 60)] {
            let is_found = |seed: u32| {
                let wild = |hour: u32| {
                    let is_wild = hour >= since && noise(hour + seed + 3001) < share;
                    let by = 600.0 * (noise(hour + seed + 7001) - 0.5);
                    slope(hour) + if is_wild { by } else { 0.0 }
                };
                let ends = (18..119).step_by(3);
                let spoilt = ends.fold(None, |before, end| {
                    history((0..end).map(wild)).spoilt(before)
                });
                spoilt.is_some()
            };
            let found = (0..20).filter(|seed| is_found(seed * 10_007)).count();
            assert!(found >= 18, "{share}, {since}: {found} of 20");
        }
    }

    #[test]
    fn noise_that_hides_the_critical_velocity_is_found_and_a_slope_past_it_hides_nothing() {
        let wild = |hour: u32| {
            let by = 600.0 * (noise(hour + 7001) - 0.5);
            slope(hour) + if noise(hour + 3001) < 0.7 { by } else { 0.0 }
        };
        let found = (18..119).filter(|end| {
            let history = history((0..*end).map(wild));
            history.noise_that_hides(1000.0, 0.125).is_some()
        });
        assert!(found.count() > 90);
        for end in 18..120 {
            let history = history((0..end).map(slope));
            assert_eq!(history.noise_that_hides(1000.0, 0.125), None, "{end}");
        }
        // Surveys once a month within a centimetre: a slope at the critical velocity would be 30 m further.
        let surveys = history((0..60).map(|hour| 10.0 * noise(hour)));
        assert_eq!(surveys.noise_that_hides(1000.0, 30.0), None);
    }

    #[test]
    fn blocks_of_readings_that_are_off_together_are_spoilt() {
        let off = |hour: u32| f64::from(u8::from((hour / 3).is_multiple_of(2)));
        let blocks = |end: u32| history((0..end).map(|hour| slope(hour) + 300.0 * off(hour)));
        let by = blocks(60).spoilt(None);
        assert!(by.is_some_and(|by| (290.0..310.0).contains(&by)), "{by:?}");
        assert!(blocks(80).spoilt(by).is_some());
        assert!(history((0..100).map(slope)).spoilt(by).is_none());
    }

    #[test]
    fn noise_that_grows_with_a_velocity_and_a_wave_that_begins_are_not_spoilt() {
        let normal = |seed: u32| (0..12).map(|part| noise(12 * seed + part)).sum::<f64>() - 6.0;
        for end in (18..600).step_by(3) {
            let faster = |hour: u32| {
                let velocity = (f64::from(hour) / 60.0).exp();
                velocity * (1.0 + 0.3 * normal(hour)) + 0.05 * normal(hour + 999)
            };
            let latest = (end - 18).min(400)..end;
            let velocities = history_of(Unit::MM_PER_DAY, latest.clone().map(faster));
            assert_eq!(velocities.spoilt(None), None, "{end}");
            // Read twice a day, in a spring after a winter under snow.
            let wave = |half: u32| {
                let amplitude = 0.01 * (f64::from(half.saturating_sub(200)) / 20.0).exp().min(60.0);
                let sign = if half.is_multiple_of(2) { 1.0 } else { -1.0 };
                amplitude * sign * (0.5 + noise(half)) + 0.01 * normal(half)
            };
            assert_eq!(history((0..end).map(wave)).spoilt(None), None, "{end}");
            assert_eq!(history(latest.map(normal)).spoilt(None), None, "{end}");
        }
    }
}

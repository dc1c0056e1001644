//! A unit that changes within a series, as from millimetres to metres under the same header: the readings lie far from those
//! before, and go on from them when they are multiplied by the ratio of two units.

use super::resolution::is_whole;
use super::suspicion::{DatedSuspicion, Suspicion, scatter_of};
use super::{Quantity, Timestamp, whole_figure};
use serde::{Deserialize, Serialize};

/// The ratios of units of length that loggers and survey programs write, mm, cm, m, inches and feet,
const OF_LENGTHS: [f64; 5] = [10.0, 25.4, 100.0, 304.8, 1000.0];
/// and of velocities, by the hour and the day.
const OF_VELOCITIES: [f64; 4] = [10.0, 24.0, 100.0, 1000.0];
/// Neighbours that differ by less than this ratio are in one unit, whatever their scatter.
const LEAST_RATIO: f64 = 4.0;
/// The readings before the change from which their usual step is learnt; fewer than the least show nothing.
const INSPECTED: usize = 48;
const FEWEST_READINGS: usize = 16;
/// Displacements that far from zero, in their scatter, show a change of the unit by their values.
const FAR: f64 = 12.0;
/// What goes on from the readings before lies within so many times their scatter. Of normal noise nearly all does,
const GOES_ON: f64 = 4.0;
/// and multiplied by no more than ten within so many times, as what was reset may come near there.
const GOES_ON_TENFOLD: f64 = 3.0;
const TENFOLD: f64 = 10.5;
/// and what was rounded in the larger unit within half a unit of its last digit, but no more than so many times the scatter.
const ROUNDED: f64 = 5.0;
/// Multiplied by less than one, readings scatter by this share of the former scatter at least: those of a slope that has jumped
/// scatter far less. One change in fifty is missed for it, of those to a smaller unit.
const SCATTERS: f64 = 0.5;
/// So many readings back in the former unit, in a row, end it,
pub const BACK: u32 = 4;
/// which are those within this share of what the last one in the other unit was in the former.
const NEAR_SHARE: f64 = 0.5;
/// So many readings that range over a hundredth, say, of what the former ones did show it too, where these lie too near to zero for their
/// values to: the quietest so many of the [`INSPECTED`] are compared with them.
const QUIET: usize = 16;
/// Their ranges are in the ratio of the units within this factor.
const RANGES_ALIKE: f64 = 3.0;
/// A smaller ratio than this is that of quiet days too, and shows only where the former readings stand so many times their scatter from zero.
const MUCH_QUIETER: f64 = 100.0;
const CLEAR_OF_ZERO: f64 = 3.0;
/// What they are multiplied goes on within so many times the scatter.
const GOES_ON_QUIETLY: f64 = 6.0;
/// No value has more digits behind its point.
const MOST_DECIMALS: i32 = 9;

/// From where on the readings of a series are those of another unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OtherUnit {
    /// What they are to be multiplied by to go on from those before.
    factor: f64,
    /// The last reading in the former unit,
    before: (Timestamp, f64),
    /// and the first in the other one.
    first: (Timestamp, f64),
    /// The newest in the other one, in the unit that [`OtherUnit::goes_on`] is given.
    newest: f64,
    /// How many have come since that are in the former unit again.
    back: u32,
    /// Whether as many readings show it as it takes: until then the next one may contradict it.
    is_confirmed: bool,
    /// Whether how little the readings scatter shows it, which no reset of the instrument changes.
    #[serde(default)]
    is_by_scatter: bool,
}

/// So many readings in the other unit show it. A velocity may fall by such a ratio too, but hardly with all of its scatter.
fn confirming(quantity: Quantity) -> usize {
    match quantity {
        Quantity::Displacement => 4,
        Quantity::Velocity => 12,
    }
}

/// How many of the newest readings can show a change by their values: where `may_have_changed` is false for them, none does.
fn looked_at(quantity: Quantity) -> usize {
    confirming(quantity) + 1
}

/// How many of the newest readings [`OtherUnit::newly`] goes by.
pub fn gone_by(quantity: Quantity) -> usize {
    INSPECTED + confirming(quantity).max(QUIET)
}

/// Whether two of these readings in a row may be in different units, as far as it can be known without sorting any.
fn may_have_changed(newest: &[(Timestamp, f64)]) -> bool {
    newest.windows(2).any(|pair| {
        let (one, other) = (pair[0].1.abs(), pair[1].1.abs());
        let (low, high) = if one < other {
            (one, other)
        } else {
            (other, one)
        };
        low > 0.0 && high >= LEAST_RATIO * low
    })
}

impl OtherUnit {
    /// The change that the newest [`gone_by`] of `readings`, in order of time, show, by their values or by how little they scatter.
    pub fn newly(readings: &[(Timestamp, f64)], quantity: Quantity) -> Option<Self> {
        let newest = |count: usize| &readings[readings.len().saturating_sub(count)..];
        let all = newest(gone_by(quantity));
        let may_have = may_have_changed(newest(looked_at(quantity)));
        let jumped = may_have.then(|| Self::at_end(all, quantity)).flatten();
        jumped.or_else(|| Self::quiet_since(all, quantity))
    }

    /// The change that the newest of `readings`, in order of time, show: those after it are no more than it takes to confirm it.
    fn at_end(readings: &[(Timestamp, f64)], quantity: Quantity) -> Option<Self> {
        (1..=confirming(quantity)).find_map(|count| {
            let at = readings.len().checked_sub(count)?;
            Self::between(&readings[..at], &readings[at..], quantity)
        })
    }

    /// The change to a larger unit that the newest of `readings`, in order of time, show by how little they scatter: displacements near zero.
    fn quiet_since(readings: &[(Timestamp, f64)], quantity: Quantity) -> Option<Self> {
        let at = readings.len().checked_sub(QUIET)?;
        let (before, after) = readings.split_at(at);
        let before = &before[before.len().saturating_sub(INSPECTED)..];
        if before.len() < INSPECTED || quantity == Quantity::Velocity {
            return None;
        }
        let quietest = before
            .chunks_exact(QUIET)
            .map(span)
            .fold(f64::INFINITY, f64::min);
        let ratio = quietest / span(after);
        if !ratio.is_finite() || ratio < OF_LENGTHS[0] / RANGES_ALIKE {
            return None;
        }
        let steps: Vec<f64> = before.windows(2).map(|two| two[1].1 - two[0].1).collect();
        let (_, scatter) = scatter_of(&steps)?;
        let (last, first) = (*before.last()?, *after.first()?);
        let mean = after.iter().map(|one| one.1).sum::<f64>() / QUIET as f64;
        let is_clear = last.1.abs() >= CLEAR_OF_ZERO * scatter;
        if last.1.abs() >= FAR * scatter {
            return None;
        }
        let is_it = |factor: &f64| {
            (factor / RANGES_ALIKE..factor * RANGES_ALIKE).contains(&ratio)
                && (*factor >= MUCH_QUIETER || is_clear)
                && (factor * mean - last.1).abs() <= GOES_ON_QUIETLY * scatter
        };
        let apart = |factor: &f64| (factor / ratio).ln().abs();
        let factor = OF_LENGTHS
            .into_iter()
            .filter(is_it)
            .min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
        Some(Self {
            factor,
            before: last,
            first,
            newest: after.last()?.1,
            back: 0,
            is_confirmed: true,
            is_by_scatter: true,
        })
    }

    fn between(
        before: &[(Timestamp, f64)],
        after: &[(Timestamp, f64)],
        quantity: Quantity,
    ) -> Option<Self> {
        let before = &before[before.len().saturating_sub(INSPECTED)..];
        let (last, first) = (before.last()?, after.first()?);
        if before.len() < FEWEST_READINGS || !may_have_changed(&[*last, *first]) {
            return None;
        }
        let steps: Vec<f64> = before
            .windows(2)
            .map(|pair| pair[1].1 - pair[0].1)
            .collect();
        let (usual, scatter) = scatter_of(&steps).unwrap_or((0.0, 0.0));
        let scatter = scatter.max(last_digit(before));
        // Nearer to zero than this, any reading goes on from them, whatever it is multiplied by.
        let (far, ratios): (f64, &[f64]) = match quantity {
            Quantity::Displacement => (FAR * scatter, &OF_LENGTHS),
            Quantity::Velocity => (6.0 * scatter, &OF_VELOCITIES),
        };
        let lies_far = |value: f64| (value - last.1).abs() >= far;
        if last.1.abs() < far || !after.iter().all(|one| lies_far(one.1)) {
            return None;
        }
        let is_confirmed = after.len() >= confirming(quantity);
        // A velocity rises by a hundred when a slope fails.
        let may_rise = is_confirmed && quantity == Quantity::Displacement;
        let up = ratios.iter().filter(|_| may_rise).map(|ratio| 1.0 / ratio);
        let interval = (last.0.duration_since(before[0].0)).as_secs_f64() / steps.len() as f64;
        let off = |factor: f64| {
            let is_tenfold = (1.0 / TENFOLD..TENFOLD).contains(&factor);
            let goes_on = if is_tenfold { GOES_ON_TENFOLD } else { GOES_ON };
            let rounded = (last_digit(after) * factor / 2.0).min(ROUNDED * scatter);
            let off = |one: &(Timestamp, f64)| {
                let moved = usual * one.0.duration_since(last.0).as_secs_f64() / interval;
                let off = (factor * one.1 - last.1 - moved).abs();
                (off <= goes_on * scatter + rounded + moved.abs()).then_some(off)
            };
            after.iter().map(off).sum::<Option<f64>>()
        };
        let scatters = |factor: f64| factor > 1.0 || factor * span(after) >= SCATTERS * scatter;
        let (factor, _) = (ratios.iter().copied().chain(up))
            .filter(|factor| scatters(*factor))
            .filter_map(|factor| Some((factor, off(factor)?)))
            .min_by(|one, other| one.1.total_cmp(&other.1))?;
        Some(Self {
            factor,
            before: *last,
            first: *first,
            newest: after.last()?.1,
            back: 0,
            is_confirmed,
            is_by_scatter: false,
        })
    }

    /// The same, to which readings are given in a unit of which there are so many in theirs.
    #[must_use]
    pub fn given_in(self, factor: f64) -> Self {
        let newest = self.newest * factor;
        Self { newest, ..self }
    }

    /// Whether it holds until readings in the former unit come.
    pub fn is_confirmed(&self) -> bool {
        self.is_confirmed
    }

    /// Whether a reset of the instrument explains it as well.
    pub fn may_be_a_reset(&self) -> bool {
        !self.is_by_scatter
    }

    /// When the last reading in the former unit was taken,
    pub fn before(&self) -> Timestamp {
        self.before.0
    }

    /// and when the first in the other one was.
    pub fn at(&self) -> Timestamp {
        self.first.0
    }

    /// After one more reading: whether the readings are still in the other unit.
    pub fn goes_on(&mut self, value: f64) -> bool {
        let as_before = self.factor * self.newest;
        let off = (value - as_before).abs();
        if off < NEAR_SHARE * as_before.abs() && off < (value - self.newest).abs() {
            self.back += 1;
        } else {
            (self.back, self.newest) = (0, value);
        }
        self.back < BACK
    }

    /// What it is for a person; `at` is the newest reading.
    pub fn suspicion(&self, at: Timestamp, unit: &str) -> DatedSuspicion {
        let [before, first] = [self.before, self.first].map(|(_, value)| whole_figure(value));
        let text = format!(
            "at {} its readings go from {before} to {first} {unit}, and {} they go on from those before: is it another unit from \
             there on? Then mend the logger, or write the header again where the unit changes, with its name; until then what \
             the slope does is not known. If it is none, set accept = [\"scale\"]",
            self.first.0,
            self.multiplied()
        );
        DatedSuspicion {
            kind: Suspicion::Scale,
            at,
            text,
        }
    }

    fn multiplied(&self) -> String {
        if self.factor < 1.0 {
            let by = (10.0 / self.factor).round() / 10.0;
            return format!("divided by {by}");
        }
        format!("multiplied by {}", self.factor)
    }
}

/// The change that stands at the end of all `readings` of a series, in order of time.
pub fn standing(readings: &[(Timestamp, f64)], quantity: Quantity) -> Option<OtherUnit> {
    let mut change: Option<OtherUnit> = None;
    for end in 1..=readings.len() {
        let so_far = &readings[..end];
        change = if let Some(mut stands) = change.filter(OtherUnit::is_confirmed) {
            stands.goes_on(readings[end - 1].1).then_some(stands)
        } else {
            OtherUnit::newly(so_far, quantity)
        };
    }
    change
}

/// A unit of the last digit that any of these values has.
fn last_digit(values: &[(Timestamp, f64)]) -> f64 {
    let decimals = |value: f64| {
        let mut all = 0..MOST_DECIMALS;
        all.find(|decimals| is_whole(value * 10_f64.powi(*decimals)))
            .unwrap_or(MOST_DECIMALS)
    };
    let most = values.iter().map(|(_, value)| decimals(*value)).max();
    10_f64.powi(-most.unwrap_or(0))
}

/// The largest less the least value.
fn span(of: &[(Timestamp, f64)]) -> f64 {
    let values = || of.iter().map(|(_, value)| *value);
    values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::SignedDuration;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    /// Readings of these values, one an hour.
    fn hourly(values: impl IntoIterator<Item = f64>) -> Vec<(Timestamp, f64)> {
        let time = |hour: i64| Timestamp::UNIX_EPOCH + SignedDuration::from_hours(hour);
        (0..).map(time).zip(values).collect()
    }

    fn normal(rng: &mut Pcg64) -> f64 {
        (0..12).map(|_| rng.random_range(0.0..1.0)).sum::<f64>() - 6.0
    }

    fn rounded(value: f64, decimals: i32) -> f64 {
        let by = 10_f64.powi(decimals);
        (value * by).round() / by
    }

    /// A slope of 1.2 mm/day that is read to a tenth of a millimetre, each hour.
    fn slope(rng: &mut Pcg64, hours: usize) -> Vec<f64> {
        let value = |hour: usize| rounded(0.05 * hour as f64 + 0.1 * normal(rng), 2);
        (0..hours).map(value).collect()
    }

    #[test]
    fn a_unit_that_changes_is_found_in_either_direction_and_holds_until_it_changes_back() {
        let mut rng = Pcg64::seed_from_u64(8);
        let cases = OF_LENGTHS
            .into_iter()
            .flat_map(|ratio| [(ratio, 5), (1.0 / ratio, 5), (ratio, 6)])
            .chain([(1000.0, 3), (100.0, 3)]);
        for (factor, decimals) in cases {
            let mut values = slope(&mut rng, 700);
            for value in &mut values[480..640] {
                *value = rounded(*value / factor, decimals);
            }
            let readings = hourly(values);
            let at_end = |end: usize| standing(&readings[..end], Quantity::Displacement);
            for end in [470, 480, 644, 700] {
                assert_eq!(at_end(end), None, "{factor}, {decimals}, {end}");
            }
            for end in [484, 485, 520, 639, 640] {
                let found = at_end(end).unwrap_or_else(|| panic!("{factor}, {decimals}, {end}"));
                assert!(found.is_confirmed && found.at() == readings[480].0);
                assert!((found.factor / factor - 1.0).abs() < 1e-9, "{found:?}");
            }
        }
    }

    #[test]
    fn a_larger_unit_near_zero_is_found_by_how_little_the_readings_scatter() {
        let mut rng = Pcg64::seed_from_u64(3);
        let mut found = 0;
        for (factor, level) in [(1000.0, 1.0), (1000.0, 6.0), (100.0, 3.0), (10.0, 8.0)] {
            let values = (0..120).map(|hour| {
                let value = level + 0.01 * f64::from(hour) + 0.8 * normal(&mut rng);
                let by = if hour < 80 { 1.0 } else { factor };
                rounded(value / by, 5)
            });
            let readings = hourly(values);
            let at_end = |end: usize| standing(&readings[..end], Quantity::Displacement);
            assert_eq!(at_end(80), None, "{factor}");
            let all = at_end(120).unwrap_or_else(|| panic!("{factor}, {level}"));
            found += usize::from((all.factor / factor - 1.0).abs() < 1e-9);
            assert!(all.is_confirmed && !all.may_be_a_reset(), "{all:?}");
        }
        assert!(found >= 3, "{found}");
        // A reset, and a night on which the air is quiet.
        let quiet = |hour: i32| if (80..100).contains(&hour) { 0.12 } else { 0.8 };
        let night = (0..120).map(|hour| 6.0 + quiet(hour) * normal(&mut rng));
        let readings = hourly(night);
        for end in 60..=120 {
            assert_eq!(standing(&readings[..end], Quantity::Displacement), None);
        }
    }

    #[test]
    fn a_velocity_in_a_larger_unit_is_found_and_one_that_rises_or_falls_is_not() {
        let mut rng = Pcg64::seed_from_u64(4);
        let steady = |rng: &mut Pcg64| 8.0 + 0.4 * normal(rng);
        for factor in [24.0, 1000.0] {
            let other = |hour: usize, value: f64| if hour < 100 { value } else { value / factor };
            let values: Vec<f64> = (0..140).map(|hour| other(hour, steady(&mut rng))).collect();
            let found = standing(&hourly(values.clone()), Quantity::Velocity).unwrap();
            assert!((found.factor - factor).abs() < 1e-9 && found.is_confirmed);
            let rising = values.iter().map(|value| 1000.0 * value).rev();
            assert_eq!(standing(&hourly(rising), Quantity::Velocity), None);
        }
        for _ in 0..300 {
            let slower = 8.0 * 10_f64.powf(rng.random_range(-4.0..-0.5));
            let stops = (0..140).map(|hour| {
                let pace = if hour < 100 { 8.0 } else { slower };
                pace + 0.4 * normal(&mut rng)
            });
            let found = standing(&hourly(stops.collect::<Vec<f64>>()), Quantity::Velocity);
            assert!(found.is_none_or(|found| !found.is_confirmed));
        }
    }

    #[test]
    fn a_true_reset_a_slope_that_jumps_and_a_series_near_zero_are_no_other_unit() {
        let mut rng = Pcg64::seed_from_u64(5);
        for round in 0..2000 {
            let fine = 10_f64.powi(-rng.random_range(0..3));
            let decimals = rng.random_range(1..5);
            let mut values = slope(&mut rng, 160);
            let at = rng.random_range(30..150);
            let to = match round % 3 {
                // To zero, or near it, or forwards by any ratio.
                0 => 0.2 * fine * normal(&mut rng),
                1 => rng.random_range(-3.0..3.0),
                _ => values[at] * 10_f64.powf(rng.random_range(0.0..3.5)),
            };
            let by = to - values[at];
            for value in &mut values[at..] {
                *value += by;
            }
            values.truncate(at + rng.random_range(1..20));
            let noise = 0.1 * fine;
            let values =
                (values.iter()).map(|value| rounded(value + noise * normal(&mut rng), decimals));
            let readings = hourly(values.collect::<Vec<f64>>());
            let found = standing(&readings, Quantity::Displacement);
            assert!(
                found.as_ref().is_none_or(|found| !found.is_confirmed),
                "{round}: {found:?}"
            );
        }
        for _ in 0..300 {
            let still = (0..300).map(|_| rounded(0.1 * normal(&mut rng), 2));
            let readings = hourly(still.collect::<Vec<f64>>());
            assert_eq!(standing(&readings, Quantity::Displacement), None);
        }
    }

    #[test]
    fn what_it_says_names_the_readings_and_the_ratio_and_declares_no_reset() {
        let mut rng = Pcg64::seed_from_u64(6);
        let mut values = slope(&mut rng, 490);
        for value in &mut values[480..] {
            *value = rounded(*value / 1000.0, 5);
        }
        let readings = hourly(values);
        let found = standing(&readings, Quantity::Displacement).unwrap();
        let said = found.suspicion(readings[489].0, "mm");
        assert_eq!((said.kind, said.at), (Suspicion::Scale, readings[489].0));
        assert!(said.text.contains("multiplied by 1000"), "{}", said.text);
        assert!(!said.text.contains("reset"), "{}", said.text);
    }
}

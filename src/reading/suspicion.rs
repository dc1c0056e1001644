//! What in a benchmark's readings hardly means what was intended: a wrong unit, a wrong zone, a mark for no value, a
//! reset that nobody declared.

use super::normal::DEVIATION_PER_MEDIAN;
use super::resolution::is_whole;
use super::{Quantity, Timestamp, counted, figure, upper_median, whole_figure};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// Numbers that loggers write where they have no value, as far as their digits go; the least first.
const MARKS: [f64; 12] = [
    99.0, 999.0, 999.9, 999.99, 6999.0, 7999.0, 8888.0, 9999.0, 9999.9, 32_768.0, 99_999.0,
    999_999.0,
];
/// No mark is as small as this.
const UNDER_MARKS: f64 = 98.0;
/// What a mark has behind its point is nothing, or this at least.
const LEAST_REST: f64 = 0.9;
/// Two values are the same within this.
const ROUNDING: f64 = 1e-9;
/// So many times the span of the others a mark is away from them.
const AWAY: f64 = 5.0;
/// A step of so many times the usual scatter of a step.
const LEAP: f64 = 50.0;
/// Fewer readings show nothing.
const FEWEST_READINGS: usize = 10;
/// Fewer readings show nothing of their unit.
const FEWEST_OF_SCALE: usize = 24;
/// A slope of which all readings lie within so many mm, and are given to a thousandth of one, may be in m,
const SMALL_MM: f64 = 2.0;
/// where two readings in a row differ by no more than this, as a total station's do in m.
const SMALL_STEP_MM: f64 = 0.02;
/// Given to more decimals than that, they may be in m where two in a row differ by no more than this: no instrument on a slope
/// resolves it from hour to hour.
const UNRESOLVED_MM: f64 = 5e-4;
/// Of the values so many may be wrong on either side.
const WRONG: usize = 8;
/// A slope that moved by more m than this may be in mm.
const LARGE_M: f64 = 100.0;
/// A suspicion of another unit goes on until a figure is so many times beyond where it begins: readings about there would raise and
/// end it again and again.
const BEYOND: f64 = 2.0;
/// A reading that is further ahead of the clock was given a wrong time; a logger's clock is off by minutes.
pub const AHEAD: SignedDuration = SignedDuration::from_mins(10);

/// Time zones differ by whole hours, a few by half an hour, seconds, and by 14 h at most.
const HALF_HOUR_S: f64 = 1800.0;
const MOST_HALF_HOURS: u32 = 28;
/// The newest reading is some minutes old, seconds; of a half hour less, as it is rare. Clocks differ by two minutes.
const UNDER_S: f64 = 900.0;
const UNDER_HALF_S: f64 = 300.0;
const OVER_S: f64 = 120.0;

/// The kinds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Suspicion {
    /// Times that lie ahead of the clock.
    Ahead,
    /// A number that elsewhere means that there is no value.
    Mark,
    /// A displacement that falls at once by far more than it ever does.
    Fall,
    /// A movement that is the size of another unit.
    Scale,
}

impl Suspicion {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Ahead, Self::Mark, Self::Fall, Self::Scale];

    /// The word in a config.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ahead => "ahead",
            Self::Mark => "mark",
            Self::Fall => "fall",
            Self::Scale => "scale",
        }
    }
}

/// One suspicion and what it rests on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DatedSuspicion {
    /// Which.
    pub kind: Suspicion,
    /// The latest reading that shows it.
    pub at: Timestamp,
    /// One line for a person.
    pub text: String,
}

/// The newest reading, of `newest`, came while the clock said `now`.
pub fn ahead(newest: Timestamp, now: Timestamp) -> Option<DatedSuspicion> {
    let ahead = SignedDuration::from_secs(newest.duration_since(now).as_secs());
    (ahead > AHEAD).then(|| DatedSuspicion {
        kind: Suspicion::Ahead,
        at: newest,
        text: format!(
            "the last reading, {newest}, is {ahead:#} ahead of this machine's clock: is the time_zone of the source right, and dst, and the clock itself?{}",
            like_a_zone(ahead).map_or_else(String::new, |hint| format!(" {hint}"))
        ),
    })
}

/// What to do where readings are ahead of the clock by about as much as one time zone is of another.
pub fn like_a_zone(ahead: SignedDuration) -> Option<String> {
    let ahead_s = ahead.as_secs_f64();
    let is_near = |half_hours: &u32| {
        let zone_s = f64::from(*half_hours) * HALF_HOUR_S;
        let under_s = if half_hours.is_multiple_of(2) {
            UNDER_S
        } else {
            UNDER_HALF_S
        };
        (-under_s..=OVER_S).contains(&(ahead_s - zone_s))
    };
    let half_hours = (1..=MOST_HALF_HOURS).find(is_near)?;
    let hours = f64::from(half_hours) / 2.0;
    Some(format!(
        "About {hours} h ahead is what a logger gives that writes local time: set time_zone in its [[source]] to the zone of \
         the logger's clock; where its times state an offset, or Z, correct the logger"
    ))
}

/// Whether readings of these values give no rise to any suspicion, as far as it can be known without sorting them; what
/// comes with each new reading is to cost little.
pub fn is_plain(values: &[f64], quantity: Quantity, unit: &str) -> bool {
    if values.len() < FEWEST_READINGS {
        return true;
    }
    let (low, high) = ends(values);
    if low.abs().max(high.abs()) > UNDER_MARKS && values.iter().any(|value| is_mark(*value)) {
        return false;
    }
    quantity != Quantity::Displacement
        || !may_have_fallen(values) && !may_have_another_scale(values, high - low, unit)
}

/// The least and the greatest of these values.
fn ends(values: &[f64]) -> (f64, f64) {
    let low = values
        .iter()
        .fold(f64::INFINITY, |a, b| if *b < a { *b } else { a });
    let high = values
        .iter()
        .fold(f64::NEG_INFINITY, |a, b| if *b > a { *b } else { a });
    (low, high)
}

/// A fall is more than [`LEAP`] times the median size of a step below the usual one, which is not larger than that median: so
/// the median size is less than the deepest fall over [`LEAP`] less one.
fn may_have_fallen(values: &[f64]) -> bool {
    let steps = || values.windows(2).map(|pair| pair[1] - pair[0]);
    let deepest = steps().fold(0.0_f64, |a, b| if b < a { b } else { a });
    let least = -deepest / (LEAP - 1.0);
    let large: usize = steps().map(|step| usize::from(step.abs() >= least)).sum();
    let count = values.len().saturating_sub(1);
    large < count - count / 2
}

fn may_have_another_scale(values: &[f64], moved: f64, unit: &str) -> bool {
    match unit {
        "m" => moved > LARGE_M,
        "mm" if moved < SMALL_MM => {
            let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
            let small = steps.filter(|step| *step <= SMALL_STEP_MM).count();
            small > (values.len() - 1) / 2
        }
        _ => false,
    }
}

/// Whether readings of these values, which gave rise to the suspicion of another unit before, do not clearly contradict it. What is
/// a mark for no value says nothing of that.
pub fn may_still_have_another_scale(values: &[f64], unit: &str) -> bool {
    let values: Vec<f64> = values
        .iter()
        .copied()
        .filter(|value| !is_mark(*value))
        .collect();
    let (low, high) = ends(&values);
    let moved = high - low;
    match unit {
        "m" => moved > LARGE_M / BEYOND,
        "mm" => {
            let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
            let usual = median(steps);
            let small = if are_in_thousandths(&values) {
                SMALL_STEP_MM
            } else {
                UNRESOLVED_MM
            };
            moved < BEYOND * SMALL_MM && usual.is_none_or(|usual| usual <= BEYOND * small)
        }
        _ => false,
    }
}

/// Whether these values span more than readings in metres that are taken for `unit` would, several of them on either side: a few wrong
/// ones are no motion.
pub fn have_moved(values: impl IntoIterator<Item = f64>, unit: &str) -> bool {
    if unit != "mm" {
        return false;
    }
    let values = values.into_iter().filter(|value| !is_mark(*value));
    let mut values: Vec<f64> = values.collect();
    if values.len() <= 2 * WRONG {
        return false;
    }
    let last = values.len() - 1 - WRONG;
    let (_, low, _) = values.select_nth_unstable_by(WRONG, f64::total_cmp);
    let low = *low;
    let (_, high, _) = values.select_nth_unstable_by(last, f64::total_cmp);
    *high - low >= SMALL_MM
}

fn are_in_thousandths<'a>(values: impl IntoIterator<Item = &'a f64>) -> bool {
    values.into_iter().all(|value| is_whole(value * 1e3))
}

/// What the values of readings in `unit`, in order of time, give rise to.
pub fn of_values(
    readings: &[(Timestamp, f64)],
    quantity: Quantity,
    unit: &str,
) -> Vec<DatedSuspicion> {
    let mut readings = readings.to_vec();
    let mut found = Vec::new();
    if readings.len() < FEWEST_READINGS {
        return found;
    }
    if let Some((value, evidence)) = mark(&readings) {
        readings.retain(|(_, other)| !same(*other, value));
        found.push(evidence);
    }
    if quantity == Quantity::Displacement {
        found.extend(fall(&readings, unit));
        found.extend(scale(&readings, unit));
    }
    found
}

fn is_mark(value: f64) -> bool {
    let size = value.abs();
    if size <= UNDER_MARKS {
        return false;
    }
    // Most values are no mark by their digits alone, and each reading asks about hundreds.
    let rest = size - size.floor();
    let may_be = !(ROUNDING..LEAST_REST - ROUNDING).contains(&rest);
    may_be && MARKS.iter().any(|mark| same(size, *mark))
}

fn same(one: f64, other: f64) -> bool {
    (one - other).abs() < ROUNDING
}

/// A number that marks no value elsewhere, far from all others, or from the one before it.
fn mark(readings: &[(Timestamp, f64)]) -> Option<(f64, DatedSuspicion)> {
    let index = readings.iter().position(|(_, value)| is_mark(*value))?;
    let (first, value) = readings[index];
    let others: Vec<(Timestamp, f64)> = readings
        .iter()
        .filter(|(_, other)| !same(*other, value))
        .copied()
        .collect();
    let (low, high) = span(&others)?;
    let away = (value - high).max(low - value);
    let before = readings[..index].last().or(others.first())?.1;
    let is_leap = scatter(&others)
        .is_some_and(|(usual, scatter)| (value - before - usual).abs() > LEAP * scatter);
    let mut marked = readings.iter().filter(|(_, other)| same(*other, value));
    let count = counted(marked.clone().count() as u64, "time", "times");
    let at = marked.next_back()?.0;
    (away > AWAY * (high - low) || is_leap).then(|| {
        let text = format!(
            "{value} stands {count}, first at {first}, and all other readings lie between {} and {}: \
             if it means that there is no value, add missing = [{value}] to the source",
            whole_figure(low),
            whole_figure(high)
        );
        let kind = Suspicion::Mark;
        (value, DatedSuspicion { kind, at, text })
    })
}

/// The number in the values of a covariate, in order of time, that marks no value elsewhere, and the evidence for that.
pub fn mark_in(values: &[(Timestamp, f64)]) -> Option<(f64, String)> {
    if values.len() < FEWEST_READINGS {
        return None;
    }
    let (value, evidence) = mark(values)?;
    Some((value, evidence.text))
}

fn span(readings: &[(Timestamp, f64)]) -> Option<(f64, f64)> {
    readings.iter().fold(None, |span, (_, value)| {
        let (low, high) = span.unwrap_or((*value, *value));
        Some((value.min(low), value.max(high)))
    })
}

fn scatter(readings: &[(Timestamp, f64)]) -> Option<(f64, f64)> {
    let steps: Vec<f64> = steps(readings).map(|(.., step)| step).collect();
    scatter_of(&steps)
}

/// The median step from one reading to the next, and the scatter of the steps about it, both in the unit of the steps. The scatter is 1.4826 times
/// their median distance from the median step, and no less than their median size; `None` where it is 0. Values that are given twice, or are
/// rounded, have steps of 0 between them: these do not count in the scatter where enough others are there.
pub fn scatter_of(steps: &[f64]) -> Option<(f64, f64)> {
    let moved: Vec<f64> = steps.iter().copied().filter(|step| *step != 0.0).collect();
    let usual = median(steps.iter().copied())?;
    let steps = if moved.len() < FEWEST_READINGS {
        steps
    } else {
        &moved
    };
    let scatter = DEVIATION_PER_MEDIAN * median(steps.iter().map(|step| (step - usual).abs()))?;
    let scatter = scatter.max(median(steps.iter().map(|step| step.abs()))?);
    (scatter > 0.0).then_some((usual, scatter))
}

fn steps(readings: &[(Timestamp, f64)]) -> impl Iterator<Item = (Timestamp, Timestamp, f64)> {
    let pairs = readings.iter().zip(readings.iter().skip(1));
    pairs.map(|(before, after)| (before.0, after.0, after.1 - before.1))
}

fn fall(readings: &[(Timestamp, f64)], unit: &str) -> Option<DatedSuspicion> {
    let (usual, scatter) = scatter(readings)?;
    let (before, at, step) = steps(readings).min_by(|one, other| one.2.total_cmp(&other.2))?;
    (usual - step > LEAP * scatter).then(|| DatedSuspicion {
        kind: Suspicion::Fall,
        at,
        text: format!(
            "between {before} and {at} it fell by {} {unit}, {} times the usual scatter of a step: \
             if the sensor was reset, declare it with [[event]] kind = \"reset\"",
            figure(-step, 3),
            figure((usual - step) / scatter, 0)
        ),
    })
}

fn scale(readings: &[(Timestamp, f64)], unit: &str) -> Option<DatedSuspicion> {
    let (low, high) = span(readings)?;
    let moved = high - low;
    let evidence = |text: String| DatedSuspicion {
        kind: Suspicion::Scale,
        at: readings.last().map_or(Timestamp::UNIX_EPOCH, |last| last.0),
        text,
    };
    if readings.len() < FEWEST_OF_SCALE {
        return None;
    }
    if unit == "m" && moved > LARGE_M {
        return Some(evidence(format!(
            "the readings span {} m: if they are millimetres, say unit = \"mm\"",
            figure(moved, 0)
        )));
    }
    if unit != "mm" || moved <= 0.0 || moved >= SMALL_MM {
        return None;
    }
    let step = median(steps(readings).map(|step| step.2.abs()))?;
    let lies = format!("all readings lie within {moved:.3} mm");
    if are_in_thousandths(readings.iter().map(|(_, value)| value)) {
        let is_finer = readings.iter().any(|(_, value)| !is_whole(value * 1e2));
        return (is_finer && step <= SMALL_STEP_MM).then(|| {
            evidence(format!(
                "{lies} and are given to 0.001 mm: if they are metres, say unit = \"m\""
            ))
        });
    }
    (step > 0.0 && step <= UNRESOLVED_MM).then(|| {
        evidence(format!(
            "{lies}, and half of the steps from one to the next are at most {step:.6} mm, finer than instruments on slopes \
             resolve: if they are metres, say unit = \"m\""
        ))
    })
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    upper_median(&mut values.collect::<Vec<f64>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    /// Creep with noise of its own size, and now and then a fall, a mark or readings of another unit.
    fn drawn(rng: &mut Pcg64) -> Vec<f64> {
        let length = rng.random_range(5..220);
        let scale = 10_f64.powf(rng.random_range(-4.0..2.0));
        let (pace, noise) = (rng.random_range(0.0..1.0), rng.random_range(0.0..2.0));
        let fall = scale * 10_f64.powf(rng.random_range(0.0..3.0));
        let at = rng.random_range(0..2 * length);
        let marked = rng.random_range(0..3 * length);
        let value = |index: usize, rng: &mut Pcg64| {
            let creep = scale * (index as f64 * pace + noise * rng.random_range(-1.0..1.0));
            let value = if index >= at { creep - fall } else { creep };
            let value = (value * 1e3).round() / 1e3;
            if index == marked { -9999.0 } else { value }
        };
        (0..length).map(|index| value(index, rng)).collect()
    }

    #[test]
    fn what_is_ahead_by_whole_hours_may_be_in_local_time_and_what_is_not_is_not() {
        let hint = |seconds: i64| like_a_zone(SignedDuration::from_secs(seconds));
        for (seconds, hours) in [
            (8 * 3600, "8 h"),
            (28_171, "8 h"),
            (19_790, "5.5 h"),
            (50_460, "14 h"),
        ] {
            let hint = hint(seconds).unwrap();
            assert!(hint.contains(&format!("About {hours} ahead")), "{hint}");
            assert!(hint.contains("time_zone in its [[source]]"), "{hint}");
        }
        for seconds in [0, 660, 7 * 3600 + 1200, 40 * 86_400, -28_800] {
            assert_eq!(hint(seconds), None, "{seconds}");
        }
    }

    #[test]
    fn metres_that_are_called_millimetres_are_known_however_many_decimals_they_have() {
        // Creep of 4 mm a day, and noise; in mm.
        let mut rng = Pcg64::seed_from_u64(5);
        let mut readings = |noise: f64, unit_mm: f64, decimals: i32| {
            let value = |hour: i64, rng: &mut Pcg64| {
                let mm = 4.0 / 24.0 * hour as f64 + noise * rng.random_range(-1.0..1.0);
                let by = 10_f64.powi(decimals);
                (mm / unit_mm * by).round() / by
            };
            let time = |hour: i64| Timestamp::UNIX_EPOCH + SignedDuration::from_hours(hour);
            let all = (0..100).map(|hour| (time(hour), value(hour, &mut rng)));
            all.collect::<Vec<(Timestamp, f64)>>()
        };
        let is_suspect = |readings: &[(Timestamp, f64)]| {
            let values: Vec<f64> = readings.iter().map(|(_, value)| *value).collect();
            let found = of_values(readings, Quantity::Displacement, "mm");
            let found = found.iter().any(|one| one.kind == Suspicion::Scale);
            assert!(!found || may_still_have_another_scale(&values, "mm"));
            assert!(!found || !is_plain(&values, Quantity::Displacement, "mm"));
            found
        };
        for decimals in 3..7 {
            assert!(is_suspect(&readings(0.2, 1000.0, decimals)), "{decimals}");
            assert!(!is_suspect(&readings(0.2, 1.0, decimals)), "{decimals}");
            // A slope that creeps by a hundredth of that, as a crackmeter reads it.
            let crackmeter = readings(0.4, 100.0, decimals);
            assert!(decimals == 3 || !is_suspect(&crackmeter), "{decimals}");
        }
    }

    #[test]
    fn a_mark_is_known_with_either_sign_and_within_rounding() {
        for mark in MARKS {
            for value in [mark, -mark, mark + 5e-10, mark - 5e-10] {
                assert!(is_mark(value), "{value}");
            }
            for value in [mark + 0.05, mark - 0.05, mark - 2.0] {
                assert!(!is_mark(value), "{value}");
            }
        }
    }

    #[test]
    fn what_gives_rise_to_a_suspicion_is_never_plain() {
        let mut rng = Pcg64::seed_from_u64(1);
        let mut found = [0; 3];
        let (mut plain, count) = (0, 20_000);
        for _ in 0..count {
            let values = drawn(&mut rng);
            let unit = ["mm", "m", "cm"][rng.random_range(0..3)];
            let time = |index: usize| {
                let hours = i64::try_from(index).unwrap();
                Timestamp::UNIX_EPOCH + SignedDuration::from_hours(hours)
            };
            let readings: Vec<(Timestamp, f64)> = (values.iter().enumerate())
                .map(|(index, value)| (time(index), *value))
                .collect();
            let quantity = Quantity::Displacement;
            let suspicions = of_values(&readings, quantity, unit);
            let is_plain = is_plain(&values, quantity, unit);
            assert!(
                suspicions.is_empty() || !is_plain,
                "{suspicions:?} of {values:?}"
            );
            plain += usize::from(is_plain);
            for one in suspicions {
                found[one.kind as usize - 1] += 1;
            }
        }
        assert!(found.iter().all(|count| *count > 100), "{found:?}");
        assert!(plain > count / 4, "{plain}");
    }
}

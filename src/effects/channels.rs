//! Which covariates count as evidence: each once, and only those that cover the record.

use super::calendar::{is_of_the_calendar, on_one_line};
use super::kind::Form;
use super::problem::Problem;
use super::response::{Driver, Response};
use crate::reading::{Channel, CovariateKind, Unit, after_days, counted};

/// A covariate must cover this share of the record.
const LEAST_COVERAGE: f64 = 0.8;
/// So many gaps of a covariate are named.
const NAMED_GAPS: usize = 3;
/// Two channels are one where what a straight line leaves of the one by the other is less than this share of its variance.
const SAME: f64 = 1e-4;
/// A channel of which nothing says what it measures moves as the readings do where a straight line leaves less than this share of its
/// variance: another point of the slope, or another component of this one. Of a correlation of .98 on.
const MOVES_ALIKE: f64 = 0.04;

/// A channel that counts for nothing, because another holds its values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ChannelCopy {
    pub(super) copy: String,
    pub(super) of: String,
}

impl ChannelCopy {
    /// For people.
    pub(super) fn remark(&self) -> String {
        let Self { copy, of } = self;
        format!(
            "{copy} holds the same values as {of}, but for a constant or a factor: they count once, and what is said of {of} holds for {copy} as well."
        )
    }
}

/// The channels, each once, and those that were left out for another: of two that hold the same values the one without faults stays.
pub(super) fn distinct(
    channels: Vec<Channel>,
    faulty: &[String],
) -> (Vec<Channel>, Vec<ChannelCopy>) {
    let (mut kept, mut copies): (Vec<Channel>, Vec<ChannelCopy>) = (Vec::new(), Vec::new());
    let (second, first): (Vec<Channel>, Vec<Channel>) = channels
        .into_iter()
        .partition(|channel| faulty.contains(&channel.name));
    for channel in first.into_iter().chain(second) {
        let is_date = is_of_the_calendar(&channel);
        let mut others = kept.iter().filter(|_| !is_date);
        match others.find(|known| same_values(known, &channel)) {
            Some(known) => copies.push(ChannelCopy {
                of: known.name.clone(),
                copy: channel.name,
            }),
            None => kept.push(channel),
        }
    }
    kept.sort_by(|a, b| a.name.cmp(&b.name));
    (kept, copies)
}

/// Whether two channels differ by a constant and a factor only, within a hundredth of their deviation, where both have values.
fn same_values(one: &Channel, other: &Channel) -> bool {
    let mut theirs = other.samples.iter().peekable();
    let mut pairs = Vec::new();
    for sample in &one.samples {
        while theirs.next_if(|their| their.time < sample.time).is_some() {}
        if let Some(their) = theirs.next_if(|their| their.time == sample.time) {
            pairs.push((sample.value, their.value));
        }
    }
    let n = pairs.len() as f64;
    if n < 0.5 * one.samples.len() as f64 || n < 10.0 {
        return false;
    }
    on_one_line(&pairs, SAME)
}

/// The covariates that cover the record; the others are reported to the reader.
pub(super) fn drivers(
    problem: &Problem,
    channels: &[Channel],
    remarks: &mut Vec<String>,
) -> Vec<Driver> {
    let mut drivers = Vec::new();
    for (index, channel) in channels.iter().enumerate() {
        if is_of_the_calendar(channel) {
            remarks.push(format!(
                "{} was left out: it says when the readings were made, and is no covariate.",
                channel.name
            ));
            continue;
        }
        let Some(driver) = Driver::new(index, channel, problem.epoch) else {
            continue;
        };
        let share = driver.coverage(&problem.nodes);
        if share < LEAST_COVERAGE {
            remarks.push(format!(
                "{} was left out: it covers {:.0} % of the readings' time.",
                channel.name,
                100.0 * share
            ));
            continue;
        }
        if moves_as_the_readings_do(problem, channel, &driver) {
            remarks.push(format!(
                "{0} was left out: it moves as the readings do, as another point or another component of the slope does, and would explain \
                 motion by motion. If it is a cause, say what it measures: --covariate {0:?}=level, or [[covariate]] in the config.",
                channel.name
            ));
            continue;
        }
        remarks.extend(of_gaps(problem, &driver));
        drivers.push(driver);
    }
    drivers
}

/// Whether a channel of unknown kind, in a unit of motion or in none that is known, moves as the readings do: a length as displacements do,
/// a velocity as velocities do.
fn moves_as_the_readings_do(problem: &Problem, channel: &Channel, driver: &Driver) -> bool {
    let unit = channel.unit.as_deref().map(Unit::parse);
    let is_like = match unit {
        None => true,
        Some(Ok(unit)) => unit.quantity() == problem.quantity,
        Some(Err(_)) => false,
    };
    if channel.stated.is_some() || channel.kind() != CovariateKind::Other || !is_like {
        return false;
    }
    let at_once = Response {
        form: Form::Level,
        stages: 1,
        mean_days: 0.0,
        before: 0.0,
    };
    let values = driver.respond_in_unit(at_once, &problem.t);
    let pairs: Vec<(f64, f64)> = values.into_iter().zip(problem.y.iter().copied()).collect();
    on_one_line(&pairs, MOVES_ALIKE)
}

/// What is said of a covariate's gaps within the record.
fn of_gaps(problem: &Problem, driver: &Driver) -> Option<String> {
    let date = |day: f64| after_days(problem.epoch, day).map(|at| at.strftime("%Y-%m-%d"));
    let (first, last) = (problem.t[0], problem.t[problem.t.len() - 1]);
    let mut each = Vec::new();
    for (from, until) in driver.gaps_within(first, last) {
        each.push(format!("from {} to {}", date(from)?, date(until)?));
    }
    let more = each.len().saturating_sub(NAMED_GAPS);
    each.truncate(NAMED_GAPS);
    let rest = (more > 0).then(|| format!("and in {}", counted(more, "more gap", "more gaps")));
    each.extend(rest);
    (!each.is_empty()).then(|| {
        format!(
            "{} has no values {}: where it acts, no event is judged there.",
            driver.name,
            each.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::super::explain::explain;
    use super::super::fixture::{channel, daily, driven_by_the_lake, lake};
    use super::super::options::Options;
    use super::super::problem::Problem;
    use super::drivers;
    use crate::reading::{Channel, CovariateKind};

    #[test]
    fn a_channel_that_holds_the_values_of_another_is_named_with_it() {
        let (series, mut channels) = driven_by_the_lake();
        let days = daily(series.readings.len());
        let levels = lake(&days);
        for (name, zero, unit) in [("lake b", 0.0, 1.0), ("lake over the sea", 312.5, 1.0)] {
            let values: Vec<f64> = levels.iter().map(|one| zero + unit * one).collect();
            channels.push(channel(name, &days, &values));
        }
        let in_feet: Vec<f64> = levels.iter().map(|one| one / 0.3048 + 3.0).collect();
        channels.push(channel("level in feet", &days, &in_feet));
        let options = Options {
            surrogates: 99,
            ..Options::default()
        };
        let said = explain(&series, &channels, &[], &options, &mut |_| ());
        for copy in ["lake b", "lake over the sea", "level in feet"] {
            let named = format!("{copy} holds the same values as lake,");
            let is_named = said.remarks.iter().any(|one| one.starts_with(&named));
            assert!(is_named, "{copy}: {:?}", said.remarks);
        }
    }

    #[test]
    fn another_point_of_the_slope_is_no_covariate_unless_somebody_says_so() {
        let (series, mut channels) = driven_by_the_lake();
        let days = daily(series.readings.len());
        let moved = series.readings.iter().enumerate();
        let moved = moved.map(|(i, one)| 310.0 + 1e-3 * (0.7 * one.value + (i % 3) as f64));
        channels.push(channel("P2 [m]", &days, &moved.collect::<Vec<f64>>()));
        let place = channels.len() - 1;
        channels[place].unit = Some("m".to_owned());
        let problem = Problem::new(&series, &channels).unwrap();
        let mut remarks = Vec::new();
        let known = |channels: &[Channel], remarks: &mut Vec<String>| {
            let all = drivers(&problem, channels, remarks).into_iter();
            all.map(|one| one.name).collect::<Vec<String>>()
        };
        let names = known(&channels, &mut remarks);
        assert!(names.iter().all(|name| name != "P2 [m]") && names.len() == place);
        assert!(
            remarks[0].starts_with("P2 [m] was left out: it moves as the readings do"),
            "{remarks:?}"
        );
        channels[place].stated = Some(CovariateKind::Level);
        assert_eq!(known(&channels, &mut remarks).len(), place + 1);
    }

    #[test]
    fn a_gap_in_a_channel_is_named() {
        let (series, mut channels) = driven_by_the_lake();
        let from = channels[0].samples[100].time;
        let until = channels[0].samples[131].time;
        channels[0]
            .samples
            .retain(|sample| sample.time <= from || sample.time >= until);
        let problem = Problem::new(&series, &channels).unwrap();
        let mut remarks = Vec::new();
        assert_eq!(drivers(&problem, &channels, &mut remarks).len(), 2);
        assert_eq!(remarks.len(), 1, "{remarks:?}");
        let named = "lake has no values from 2001-04-11 to 2001-05-12";
        assert!(remarks[0].starts_with(named), "{remarks:?}");
    }
}

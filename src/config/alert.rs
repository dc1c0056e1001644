//! `[alert]`: the figures in the level rules, the site's and a benchmark's own.

use super::rule;
use super::table::{Placed, Section};
use super::value;
use crate::alert::{Level, Policy, Threshold};
use jiff::SignedDuration;

/// From a chance that is higher than this hardly a collapse is called in time (docs/false-alarms.md).
const HIGHEST_CHANCE_OF_RED: f64 = 0.5;
/// Nor is orange, which is to come before red, with one that is higher than this.
const HIGHEST_CHANCE_OF_ORANGE: f64 = 0.95;
/// Slopes creep faster than this for years, and few are ever read as fast as that before they collapse, mm/day.
const USUAL_CRITICAL_VELOCITIES: std::ops::RangeInclusive<f64> = 1.0..=100_000.0;

/// Reads the table over `base`, whose figures stand where the table gives none.
pub(super) fn policy(mut section: Section<'_>, base: &Policy) -> Policy {
    let evacuation_time = section.parsed("evacuation_time", value::duration);
    let outlook = section.parsed("outlook", value::duration);
    let red_within = section.parsed("red_within", value::duration);
    let velocity = section.parsed("critical_velocity", value::speed);
    let steady_for = section.parsed("steady_for", value::duration);
    let policy = Policy {
        evacuation_time: given(evacuation_time.as_ref(), base.evacuation_time),
        outlook: given(outlook.as_ref(), base.outlook),
        red_within: red_within
            .as_ref()
            .map(|given| given.value)
            // The site's goes with the site's evacuation time.
            .or(base.red_within.filter(|_| evacuation_time.is_none())),
        critical_velocity_mm_per_day: velocity
            .map_or(base.critical_velocity_mm_per_day, |given| given.value),
        red_chance: section
            .chance("red_chance", base.red_chance)
            .unwrap_or(base.red_chance),
        orange_chance: section
            .chance("orange_chance", base.orange_chance)
            .unwrap_or(base.orange_chance),
        yellow_chance: section
            .chance("yellow_chance", base.yellow_chance)
            .unwrap_or(base.yellow_chance),
        steady_for: given(steady_for.as_ref(), base.steady_for),
        thresholds: thresholds(&mut section, base),
        rules: rule::rules(&mut section, &base.rules),
    };
    warn(&section, &policy, evacuation_time.as_ref());
    warn_of_unusual(&section, &policy);
    section.finish();
    policy
}

fn given(value: Option<&Placed<SignedDuration>>, otherwise: SignedDuration) -> SignedDuration {
    value.map_or(otherwise, |given| given.value)
}

fn thresholds(section: &mut Section<'_>, base: &Policy) -> Vec<Threshold> {
    let tables = section.tables("threshold", "alert.threshold");
    if tables.is_empty() {
        return base.thresholds.clone();
    }
    tables.into_iter().filter_map(threshold).collect()
}

fn threshold(mut section: Section<'_>) -> Option<Threshold> {
    section.required("level", "\"orange\"")?;
    let level = section.parsed("level", value::raised_level);
    let velocity = section.parsed("velocity", value::speed);
    let displacement = section.parsed("displacement", value::length);
    let acceleration = section.parsed("acceleration", value::acceleration);
    let keys = ["velocity", "displacement", "acceleration"];
    if !keys.iter().any(|key| section.has(key)) {
        section.error(
            section.at(),
            "alert.threshold has nothing to compare".to_owned(),
            "add velocity = \"50 mm/day\", displacement = \"500 mm\" or acceleration = \"5 mm/day/day\"",
        );
    }
    section.finish();
    Some(Threshold {
        level: level?.value,
        velocity_mm_per_day: velocity.map(|given| given.value),
        displacement_mm: displacement.map(|given| given.value),
        acceleration_mm_per_day2: acceleration.map(|given| given.value),
    })
}

/// Figures that are each allowed and together cannot mean what was intended.
fn warn(section: &Section<'_>, policy: &Policy, evacuation_time: Option<&Placed<SignedDuration>>) {
    let at = evacuation_time.map_or(section.at(), |given| &given.at);
    if policy.red_within() > policy.outlook {
        section.warning(
            at,
            format!(
                "red looks {:#} ahead, further than outlook {:#}: red would be called before orange",
                policy.red_within(),
                policy.outlook
            ),
            "make outlook several times evacuation_time",
        );
    }
    if policy.red_within() < policy.evacuation_time {
        section.warning(
            at,
            format!(
                "red_within {:#} is shorter than evacuation_time {:#}: red would be called too late",
                policy.red_within(),
                policy.evacuation_time
            ),
            "leave red_within out: it is twice evacuation_time then",
        );
    }
    if policy.yellow_chance > policy.orange_chance {
        section.warning(
            section.at(),
            format!(
                "yellow_chance {} is above orange_chance {}: yellow would never be called first",
                policy.yellow_chance, policy.orange_chance
            ),
            "make yellow_chance the smaller one",
        );
    }
    for (name, quantity) in [
        ("velocity", (|t| t.velocity_mm_per_day) as ThresholdField),
        ("displacement", |t| t.displacement_mm),
        ("acceleration", |t| t.acceleration_mm_per_day2),
    ] {
        if let Some((low, high)) = inverted(&policy.thresholds, quantity) {
            section.warning(
                section.at(),
                format!("the {name} threshold of {high} is below the one of {low}"),
                "let a higher level begin at a larger figure",
            );
        }
    }
}

/// Figures of this table with which a level says little, or nothing.
fn warn_of_unusual(section: &Section<'_>, policy: &Policy) {
    let usual = Policy::default();
    let chances = [
        (
            "red_chance",
            policy.red_chance,
            usual.red_chance,
            HIGHEST_CHANCE_OF_RED,
        ),
        (
            "orange_chance",
            policy.orange_chance,
            usual.orange_chance,
            HIGHEST_CHANCE_OF_ORANGE,
        ),
    ];
    for (key, chance, usual, highest) in chances {
        if section.has(key) && chance > highest {
            section.warning(
                section.at(),
                format!("{key} {chance} is so high that few collapses are called in time"),
                format!("leave it out: it is {usual} then"),
            );
        }
    }
    let critical = policy.critical_velocity_mm_per_day;
    if section.has("critical_velocity") && !USUAL_CRITICAL_VELOCITIES.contains(&critical) {
        let why = if critical < *USUAL_CRITICAL_VELOCITIES.start() {
            "slopes creep faster than that for years"
        } else {
            "few slopes are ever read at such a velocity before they collapse"
        };
        section.warning(
            section.at(),
            format!("critical_velocity {critical} mm/day: {why}"),
            "write the velocity from which this site counts as failed, such as \"1 m/day\"",
        );
    }
}

type ThresholdField = fn(&Threshold) -> Option<f64>;

/// A level and a higher one that begins below it.
fn inverted(thresholds: &[Threshold], figure: ThresholdField) -> Option<(Level, Level)> {
    let mut pairs = thresholds
        .iter()
        .flat_map(|low| thresholds.iter().map(move |high| (low, high)));
    pairs.find_map(|(low, high)| {
        let (at_low, at_high) = (figure(low)?, figure(high)?);
        (low.level < high.level && at_high < at_low).then_some((low.level, high.level))
    })
}

//! `[[alert.rule]]`: rules of the site's own, each a name, a level and conditions in words.

use super::table::{Placed, Section};
use super::value;
use crate::alert::{AlertCause, Combination, Condition, DeclaredRule};
use jiff::SignedDuration;
use std::collections::BTreeSet;

/// What a condition looks like.
const EXAMPLES: &str = "write \"velocity 20 mm/day\", \"acceleration 5 mm/day/day\", \"displacement 500 mm\", \
                        \"chance 0.2 within 12h\", \"early-quantile within 7d\" or \"tangent-angle 80 deg for 5 mm/day\" (the velocity of uniform creep)";
/// Longest name.
const LONGEST_NAME: usize = 60;

/// Reads the rules; where the table has none, those of `base` stand.
pub(super) fn rules(section: &mut Section<'_>, base: &[DeclaredRule]) -> Vec<DeclaredRule> {
    let tables = section.tables("rule", "alert.rule");
    if tables.is_empty() {
        return base.to_vec();
    }
    let mut taken = BTreeSet::new();
    let rules = tables.into_iter();
    rules.filter_map(|table| rule(table, &mut taken)).collect()
}

fn rule(mut section: Section<'_>, taken: &mut BTreeSet<String>) -> Option<DeclaredRule> {
    let name = section.required("name", "\"fast-and-near\"");
    section.required("level", "\"orange\"")?;
    let level = section.parsed("level", value::raised_level);
    let lasting = section.parsed("for", value::duration_or_none);
    let all = section.texts("all").map(|texts| (Combination::All, texts));
    let any = section.texts("any").map(|texts| (Combination::Any, texts));
    let given = match (all, any) {
        (Some(one), None) | (None, Some(one)) if !one.1.value.is_empty() => Some(one),
        _ => {
            section.error(
                section.at(),
                "alert.rule needs conditions, under either all or any".to_owned(),
                "add all = [\"velocity 20 mm/day\", \"chance 0.2 within 12h\"]",
            );
            None
        }
    };
    let name = checked_name(&section, name, taken);
    let (combination, texts) = given?;
    let conditions = (texts.value.iter()).filter_map(|text| condition(&section, text));
    let conditions: Vec<Condition> = conditions.collect();
    section.finish();
    Some(DeclaredRule {
        name: name?,
        level: level?.value,
        combination,
        conditions,
        lasting: lasting.map_or(SignedDuration::ZERO, |given| given.value),
    })
}

fn checked_name(
    section: &Section<'_>,
    name: Option<Placed<String>>,
    taken: &mut BTreeSet<String>,
) -> Option<String> {
    let name = name?;
    let is_plain = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    if name.value.chars().count() > LONGEST_NAME || !name.value.chars().all(is_plain) {
        section.error(
            &name.at,
            format!(
                "alert.rule.name = {:?} cannot stand in an alert",
                name.value
            ),
            "use up to 60 letters, digits, - and _",
        );
    } else if !taken.insert(name.value.clone()) {
        section.error(
            &name.at,
            format!("alert.rule.name = {:?} is there twice", name.value),
            "give each rule its own name",
        );
    }
    Some(name.value)
}

fn condition(section: &Section<'_>, text: &Placed<String>) -> Option<Condition> {
    match parsed(&text.value) {
        Ok(condition) => Some(condition),
        Err(fix) => {
            let what = format!("{:?} is no condition of an alert.rule", text.value);
            section.error(&text.at, what, fix);
            None
        }
    }
}

/// One condition; `Err` says what to write instead.
fn parsed(text: &str) -> Result<Condition, String> {
    let (name, figure) = text.trim().split_once(' ').unwrap_or((text.trim(), ""));
    match name {
        "velocity" => value::speed(figure).map(Condition::Velocity),
        "acceleration" => value::acceleration(figure).map(Condition::Acceleration),
        "displacement" => value::length(figure).map(Condition::Displacement),
        "chance" => chance(figure),
        "early-quantile" => early_quantile(figure),
        "tangent-angle" => tangent_angle(figure),
        "effect-found" if figure.is_empty() => Ok(Condition::EffectFound),
        cause if figure.is_empty() => match AlertCause::named(cause) {
            Some(cause) => Ok(Condition::Happened(cause)),
            None => Err(choices()),
        },
        _ => Err(choices()),
    }
}

fn choices() -> String {
    let causes = AlertCause::ALL.map(AlertCause::name).join("\", \"");
    format!("{EXAMPLES}, or one of \"{causes}\", \"effect-found\"")
}

fn chance(figure: &str) -> Result<Condition, String> {
    let fix =
        || "write a number over 0 and up to 1 and a time: \"chance 0.2 within 12h\"".to_owned();
    let (chance, within) = figure.split_once(" within ").ok_or_else(fix)?;
    let at_least: f64 = chance.trim().parse().map_err(|_| fix())?;
    let within = value::duration(within.trim()).map_err(|_| fix())?;
    if at_least > 0.0 && at_least <= 1.0 {
        Ok(Condition::Chance { at_least, within })
    } else {
        Err(fix())
    }
}

fn early_quantile(figure: &str) -> Result<Condition, String> {
    let fix = || {
        "write a time within which the 5 % quantile of the time of collapse comes: \"early-quantile within 7d\"".to_owned()
    };
    let within = figure.strip_prefix("within ").ok_or_else(fix)?;
    let within = value::duration(within.trim()).map_err(|_| fix())?;
    Ok(Condition::EarlyQuantile { within })
}

fn tangent_angle(figure: &str) -> Result<Condition, String> {
    let fix = || {
        "write an angle between 0 and 90 degrees and the velocity of uniform creep: \
         \"tangent-angle 80 deg for 5 mm/day\""
            .to_owned()
    };
    let (angle, steady) = figure.split_once(" deg for ").ok_or_else(fix)?;
    let degrees: f64 = angle.trim().parse().map_err(|_| fix())?;
    let steady_mm_per_day = value::speed(steady).map_err(|_| fix())?;
    if degrees > 0.0 && degrees < 90.0 {
        Ok(Condition::TangentAngle {
            degrees,
            steady_mm_per_day,
        })
    } else {
        Err(fix())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_are_read_with_their_units_and_what_is_none_says_what_to_write() {
        let hours = SignedDuration::from_hours;
        for (text, condition) in [
            ("velocity 1 m/day", Condition::Velocity(1000.0)),
            ("acceleration 5 mm/day/day", Condition::Acceleration(5.0)),
            ("displacement 2 m", Condition::Displacement(2000.0)),
            (
                "chance 0.2 within 12h",
                Condition::Chance {
                    at_least: 0.2,
                    within: hours(12),
                },
            ),
            (
                "tangent-angle 80 deg for 5 mm/day",
                Condition::TangentAngle {
                    degrees: 80.0,
                    steady_mm_per_day: 5.0,
                },
            ),
            (
                "early-quantile within 7d",
                Condition::EarlyQuantile {
                    within: hours(7 * 24),
                },
            ),
            ("regime-flip", Condition::Happened(AlertCause::RegimeFlip)),
            ("effect-found", Condition::EffectFound),
        ] {
            assert_eq!(parsed(text), Ok(condition), "{text}");
        }
        for (text, fix) in [
            ("velocity", "50 mm/day"),
            ("velocity 20", "50 mm/day"),
            ("speed 20 mm/day", "velocity 20 mm/day"),
            ("chance 1.2 within 12h", "up to 1"),
            ("chance 0.2", "within 12h"),
            ("early-quantile 7d", "within 7d"),
            ("tangent-angle 90 deg for 5 mm/day", "between 0 and 90"),
            ("tangent-angle 80 deg", "uniform creep"),
            ("rain", "unexplained-residual"),
            ("effect-found rain", "effect-found"),
            ("", "velocity 20 mm/day"),
        ] {
            let said = parsed(text).unwrap_err();
            assert!(said.contains(fix), "{text:?}: {said}");
        }
    }
}

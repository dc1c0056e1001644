//! What each level asks people to do, in words; the site's own emergency plan says how.

use super::chance::span_in_words;
use super::evidence::AlertCause;
use super::level::Level;
use super::policy::Policy;
use super::rules::{RED_CHANCE, REPORTED_CHANCE};

impl Level {
    /// What is recommended while it is in force.
    pub fn recommended(self) -> &'static str {
        match self {
            Self::Green => "Nothing beyond the usual watch.",
            Self::Yellow => {
                "Look at the readings and at the slope, and find out what has changed. \
                 Check that those who would have to act can be reached."
            }
            Self::Orange => {
                "Prepare an evacuation: inform those who decide, measure more often, \
                 and close what cannot be cleared quickly."
            }
            Self::Red => {
                "Evacuate the area that the slope can reach, as the site's plan says, and close it. \
                 Nobody goes back in before the alert has ended and people have looked at the slope."
            }
            Self::Unknown => {
                "Nothing can be said of the slope: treat it as not watched. \
                 Watch it by other means until readings come again."
            }
        }
    }

    /// The same where the level `beside` it is in force at the benchmark: what is `unknown` ends none.
    pub fn recommended_beside(self, beside: Option<Self>) -> &'static str {
        match (self, beside) {
            (Self::Unknown, Some(Self::Red)) => {
                "RED STAYS IN FORCE: everyone stays out. The sensor may have gone with the slope: watch it by other means, from \
                 outside the area that it can reach."
            }
            (Self::Unknown, Some(Self::Orange)) => {
                "ORANGE STAYS IN FORCE, and the slope is not watched: the sensor may have gone with it. Keep the evacuation prepared, and \
                 watch the slope by other means, from outside the area that it can reach."
            }
            _ => self.recommended(),
        }
    }
}

fn rounded(chance: f64) -> f64 {
    (1000.0 * chance).round() / 1000.0
}

impl Policy {
    /// What a red that is pending waits for.
    pub fn pending_red_in_words(&self) -> String {
        format!(
            ", which calls red once it is {} on average over about the last {}",
            rounded(self.red_mean_chance()),
            span_in_words(self.red_course())
        )
    }

    fn chance_for_red_in_words(&self) -> String {
        format!(
            "chance of collapse of {} or more within {} ({}) and until the next reading",
            self.red_chance,
            self.red_within_in_words(),
            span_in_words(self.red_within())
        )
    }

    /// What ends a level that is in force, in words; `None` of what no motion ends.
    pub fn end_in_words(&self, level: Level) -> Option<String> {
        let pauses = match level {
            Level::Red => ", and no chance calls orange",
            Level::Orange | Level::Yellow => "",
            Level::Green | Level::Unknown => return None,
        };
        Some(format!(
            "less is called{pauses}, and the slope has slowed to half of its highest velocity for {}, or has moved no faster than when the level was \
             called, under the critical velocity and without gaining, for {}; a lower forecast alone does not end it",
            span_in_words(self.evacuation_time),
            span_in_words(self.steady_for)
        ))
    }

    /// The condition of a rule with its figures, as words; `None` for a rule that the policy has no figure for.
    pub fn condition(&self, rule: &str, level: Level) -> Option<String> {
        let threshold = |figure: &dyn Fn(&super::Threshold) -> Option<f64>| {
            let own = self.thresholds.iter().filter(|one| one.level == level);
            own.filter_map(figure).reduce(f64::min)
        };
        Some(match (rule, level) {
            ("critical-velocity", _) => format!(
                "settled velocity of {} mm/day or more",
                self.critical_velocity_mm_per_day
            ),
            (RED_CHANCE, Level::Orange) => format!(
                "{}, which calls red, and of {} or more, but not yet of {}, on average over about the last {}",
                self.chance_for_red_in_words(),
                rounded(self.red_near_chance()),
                rounded(self.red_mean_chance()),
                span_in_words(self.red_course())
            ),
            (RED_CHANCE, _) => format!(
                "{}, and of {} or more on average over about the last {}, or of {} at one reading",
                self.chance_for_red_in_words(),
                rounded(self.red_mean_chance()),
                span_in_words(self.red_course()),
                rounded(self.red_at_once())
            ),
            ("chance-within-outlook", level) => {
                let chance = if level == Level::Yellow {
                    self.yellow_chance
                } else {
                    self.orange_chance
                };
                format!(
                    "chance of collapse of {chance} or more within the outlook of {}",
                    span_in_words(self.outlook)
                )
            }
            (REPORTED_CHANCE, _) => format!(
                "chance of collapse of {} or more within the outlook of {}, of which levels count less because the motion is slow or does not \
                 surely accelerate",
                self.orange_chance,
                span_in_words(self.outlook)
            ),
            ("velocity-threshold", _) => format!(
                "velocity of {} mm/day or more",
                threshold(&|one| one.velocity_mm_per_day)?
            ),
            ("displacement-threshold", _) => format!(
                "displacement since the first reading of {} mm or more",
                threshold(&|one| one.displacement_mm)?
            ),
            ("acceleration-threshold", _) => format!(
                "acceleration of {} mm/day per day or more",
                threshold(&|one| one.acceleration_mm_per_day2)?
            ),
            (rule, _) => match (self.declared_rule(rule), AlertCause::named(rule)) {
                (Some(declared), _) => declared.words(None),
                (None, Some(cause)) => cause.words().to_owned(),
                (None, None) => return None,
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_condition_has_the_figures_of_the_policy() {
        let policy = Policy::default();
        let condition = |rule, level| policy.condition(rule, level).unwrap();
        assert_eq!(
            condition("chance-within-evacuation-time", Level::Red),
            "chance of collapse of 0.27 or more within twice the evacuation time (48 h) and until the next reading, and of \
             0.198 or more on average over about the last 12 h, or of 0.597 at one reading"
        );
        let outlook = |level| condition("chance-within-outlook", level);
        assert!(outlook(Level::Orange).contains("of 0.7 or more within the outlook of 30 days"));
        assert!(outlook(Level::Yellow).contains("of 0.3 or more"));
        assert_eq!(policy.condition("velocity-threshold", Level::Red), None);
        assert_eq!(policy.condition("no-data", Level::Unknown), None);
        let ends = |level| policy.end_in_words(level);
        let red = ends(Level::Red).unwrap();
        assert!(
            red.contains("no chance calls orange")
                && red.contains("for 24 h")
                && red.contains("for 7 days"),
            "{red}"
        );
        assert!(!ends(Level::Yellow).unwrap().contains("orange"));
        assert_eq!(ends(Level::Unknown), None);
    }
}

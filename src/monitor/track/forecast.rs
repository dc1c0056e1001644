//! What one benchmark is forecast to do: by the law without a known load, and by that under the known load beside it.

use crate::alert::{AlertEvidence, Policy, to_the_next_reading};
use crate::forecast::{Outlook, Passage};
use crate::reading::{SECONDS_PER_DAY, days_of};
use jiff::SignedDuration;

/// A forecast is the slope's for so many lengths of its record; further ahead it is the prior's, and calls no level.
const REACH: f64 = 5.0;
/// The early quantile of the time of collapse that rules may ask for, as reported.
pub(super) const EARLY: f64 = 0.05;

/// The forecasts after one reading.
#[derive(Debug)]
pub(super) struct Forecast {
    pub(super) plain: Outlook,
    /// Where an effect is adopted.
    pub(super) known_load: Option<UnderKnownLoad>,
}

/// The law under the known load's forecast.
#[derive(Debug)]
pub(super) struct UnderKnownLoad {
    pub(super) outlook: Outlook,
    /// Whether it explains how fast the slope is now.
    pub(super) is_explained: bool,
}

impl Forecast {
    /// How far ahead orange and yellow look: as the policy says, if the record is long enough for that; as far as red in any case.
    pub(super) fn reach(&self, policy: &Policy) -> SignedDuration {
        let plain = &self.plain;
        let first = plain.rates.first();
        let length = first.map_or(0.0, |rate| plain.now_days - rate.from);
        if REACH * length >= days_of(policy.outlook) {
            return policy.outlook;
        }
        let reach = SignedDuration::try_from_secs_f64(REACH * length * SECONDS_PER_DAY);
        let reach = reach.unwrap_or(policy.outlook);
        reach.max(policy.red_within()).min(policy.outlook)
    }

    /// The forecast that people are given: the known load's where it explains the present, else that of whichever
    /// gives failure the larger chance within `days`.
    pub(super) fn in_force(&self, days: f64) -> &Outlook {
        match &self.known_load {
            Some(known_load) if known_load.is_explained => &known_load.outlook,
            Some(known_load) => {
                let chance = |passage: &Passage| passage.chance_within(days);
                if chance(&self.plain.chances) > chance(&known_load.outlook.chances) {
                    &self.plain
                } else {
                    &known_load.outlook
                }
            }
            None => &self.plain,
        }
    }

    fn to_the_next_reading(&self, span: SignedDuration) -> SignedDuration {
        to_the_next_reading(span, self.plain.to_next_days)
    }

    /// Chance of a collapse within `days`, as the level takes it: what the law under the known load does not explain, it cannot
    /// talk away either.
    pub(super) fn chance_within(&self, days: f64) -> f64 {
        let plain = self.plain.chances.chance_within(days);
        match &self.known_load {
            Some(known_load) => {
                let chance = known_load.outlook.chances.chance_within(days);
                if known_load.is_explained {
                    chance
                } else {
                    chance.max(plain)
                }
            }
            None => plain,
        }
    }

    /// How unexpected the newest reading was to the law that knows most, ln.
    pub(super) fn surprise_nats(&self) -> Option<f64> {
        self.known_load
            .as_ref()
            .map_or(self.plain.surprise_nats, |known_load| {
                known_load.outlook.surprise_nats
            })
    }
}

/// How far ahead red, and orange and yellow, look from the newest reading.
#[derive(Debug, Clone, Copy)]
pub(super) struct LookAhead {
    pub(super) red: SignedDuration,
    pub(super) orange: SignedDuration,
}

impl LookAhead {
    pub(super) fn of(policy: &Policy, forecast: Option<&Forecast>) -> Self {
        forecast.map_or(
            Self {
                red: policy.red_within(),
                orange: policy.outlook,
            },
            |forecast| Self {
                red: forecast.to_the_next_reading(policy.red_within()),
                orange: forecast.reach(policy),
            },
        )
    }

    /// `observed` with the chances that the rules ask for; without a forecast none.
    pub(super) fn evidence(
        self,
        policy: &Policy,
        forecast: Option<&Forecast>,
        observed: AlertEvidence,
    ) -> AlertEvidence {
        let within = |span| forecast.map(|forecast| forecast.chance_within(days_of(span)));
        let chances = policy.spans().filter_map(|span| {
            let forecast = forecast?;
            Some((span, within(forecast.to_the_next_reading(span))?))
        });
        AlertEvidence {
            chance_for_red: within(self.red),
            chance_within_outlook: within(self.orange),
            reported_within_outlook: forecast.map(|forecast| {
                let days = days_of(self.orange);
                forecast.in_force(days).expected.chance_within(days)
            }),
            chances: chances.collect(),
            ..observed
        }
    }
}

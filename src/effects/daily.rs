//! The sun's day beside the tide. Heat and melt come and go with 24 and 12 hours; of the tide's own periods one is 12 hours, and another
//! cannot be distinguished from 24 in less than a year. A tide is known by the moon's periods.

use super::candidates;
use super::definition::Support;
use super::explanation::Effect;
use super::judge::coefficients;
use super::kind::Kind;
use super::problem::Problem;
use super::refit::Fitted;
use super::rival::Rival;
use super::search::{Accepted, Refitted, Search};
use crate::reading::{Channel, CovariateKind};

/// Of heat and melt, days.
const DAILY: [f64; 2] = [1.0, 0.5];

/// The share of what a tide explains beyond a daily cycle that waves which are no tide's explain as well.
const UNEVEN: f64 = 0.5;

/// Said where the day may be what comes and goes.
pub(super) const REMARK: &str = "A tide explains these readings, and a cycle of the day of 24 hours explains them about as well: warmth, melt water and \
    the sun's own tides all have one. A record of the temperature, or a longer one, can show which it is.";

/// Said of a tide of which a part may be the day's.
const OF_BOTH: &str = "The strongest wave of the tide has a period of the sun's day, which warmth and melt water have too: how much of it is the tide's \
    is open.";
const WHAT_SHOWS_IT: &str = " A record of the temperature, or a longer one, can show it.";

/// What is said of a tide whose strongest wave may be a daily one, beside these channels.
pub(super) fn of_both(channels: &[Channel]) -> String {
    let has_temperature = channels
        .iter()
        .any(|channel| channel.kind() == CovariateKind::Temperature);
    let more = if has_temperature { "" } else { WHAT_SHOWS_IT };
    format!("{OF_BOTH}{more}")
}

/// What else comes and goes with the day: melt water in the ground, and warmth in the instrument.
pub(super) fn rivals() -> [Rival; 2] {
    [Kind::HYDROLOGICAL, Kind::THERMAL].map(Rival::from)
}

/// Whether a wave of this period, days, cannot be distinguished from a daily one in a record so long.
fn is_daily(period: f64, span_days: f64) -> bool {
    let mut apart = DAILY.iter().map(|own| (1.0 / own - 1.0 / period).abs());
    apart.any(|cycles_a_day| cycles_a_day * span_days < 1.0)
}

fn is_astronomical(kind: Kind) -> bool {
    kind.definition().support == Support::Astronomy
}

/// Whether one of the effects is a tide whose strongest wave may be a daily one.
pub(super) fn has_daily_tide(effects: &[Effect], problem: &Problem) -> bool {
    let mut tides = effects.iter().filter(|one| is_astronomical(one.effect));
    tides.any(|one| {
        one.period_days
            .is_some_and(|period| is_daily(period, problem.span()))
    })
}

impl Search<'_> {
    /// Why a tide is not concluded: a daily cycle explains the readings as well, within the margin.
    pub(super) fn daily_instead(&mut self, base: &Fitted, one: &Refitted) -> Option<String> {
        let (problem, kind) = (self.problem, one.term.kind);
        let mut periods = kind.definition().wave_periods.iter();
        let may_be = periods.any(|period| is_daily(*period, problem.span()));
        let is_alone = one.fitted.terms.len() == base.terms.len() + 1;
        if !is_astronomical(kind) || !may_be || !is_alone {
            return None;
        }
        let daily = self.refitted(base, &candidates::waves(problem, kind, &DAILY))?;
        let less = daily.gain - one.gain;
        let of_the_moon = kind.definition().wave_periods.first();
        let is_apart = of_the_moon.is_none_or(|period| !is_daily(*period, problem.span()));
        // Warmth and melt water come once a day: a wave of half a day by itself is theirs only where it is none of the moon's.
        let is_half = strongest(&daily, problem).is_some_and(|wave| wave > 0);
        if -less >= self.options.bic_margin || (is_half && !is_apart) {
            return self.uneven_days_instead(base, one, &daily);
        }
        self.is_daily = true;
        let by = if less >= 1.0 {
            format!(" by {less:.0} more of the BIC")
        } else {
            String::new()
        };
        Some(format!(
            "a daily cycle of 24 and 12 hours, as of warmth or melt water, explains the same{by}"
        ))
    }

    /// Why a tide is not concluded though it explains more than a `daily` cycle: one that is stronger on some days than on others has waves
    /// on either side of 24 and 12 hours, and those that mirror the moon's explain a good part of it too.
    fn uneven_days_instead(
        &mut self,
        base: &Fitted,
        one: &Refitted,
        daily: &Refitted,
    ) -> Option<String> {
        let (problem, kind) = (self.problem, one.term.kind);
        let more = one.gain - daily.gain;
        let lunar = kind.definition().wave_periods.iter();
        let lunar = lunar.filter(|period| !is_daily(**period, problem.span()));
        let mirrored: Vec<f64> = DAILY
            .into_iter()
            .chain(lunar.map(|period| mirror(*period)))
            .collect();
        let uneven = self.refitted(base, &candidates::waves(problem, kind, &mirrored))?;
        let is_uneven = more > 0.0 && uneven.gain - daily.gain >= UNEVEN * more;
        is_uneven.then(|| {
            self.is_daily = true;
            "a daily cycle that is stronger on some days than on others looks the same".to_owned()
        })
    }
}

/// The period as far on the other side of the nearest of [`DAILY`] in cycles a day.
fn mirror(period: f64) -> f64 {
    let cycles = 1.0 / period;
    let solar = DAILY.map(|own| 1.0 / own);
    let nearest = if (cycles - solar[0]).abs() < (cycles - solar[1]).abs() {
        solar[0]
    } else {
        solar[1]
    };
    1.0 / (2.0 * nearest - cycles)
}

/// Which of the waves of the newest term is the strongest.
fn strongest(one: &Refitted, problem: &Problem) -> Option<usize> {
    let newest = one.fitted.terms.len() - 1;
    let waves = coefficients(problem, &one.fitted, newest).chunks(2);
    let sizes = waves.map(|wave| wave.iter().map(|part| part * part).sum::<f64>());
    let largest = sizes.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    largest.map(|(wave, _)| wave)
}

impl Refitted {
    /// A tide whose strongest wave is the sun's cannot be distinguished from what else comes and goes with the day.
    pub(super) fn with_day(&self, mut how: Accepted, problem: &Problem) -> Accepted {
        let periods = self.term.kind.definition().wave_periods;
        let period = strongest(self, problem).and_then(|wave| periods.get(wave));
        let is_solar = period.is_some_and(|period| is_daily(*period, problem.span()));
        if is_astronomical(self.term.kind) && is_solar {
            how.ties.extend(rivals());
        }
        how
    }
}

#[cfg(test)]
mod tests;

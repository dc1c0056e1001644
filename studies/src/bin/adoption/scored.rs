//! One record replayed with and without the effects that are adopted.

use anyhow::Result;
use slipwatch::alert::Level;
use slipwatch::monitor::{AlertState, Event, EventKind, Explain, FailureTime, Settings};
use slipwatch::reading::{Recording, Timestamp, days_since};
use slipwatch::runtime::replay::{ReplayPace, ReplayPlan, replay};
use slipwatch::runtime::shutdown;
use std::collections::BTreeMap;

/// Forecasts look so many days ahead.
const HORIZON_DAYS: f64 = 400.0;
/// The chance that is scored is that within the outlook.
const OUTLOOK_DAYS: f64 = 30.0;

/// What one way of forecasting comes to.
#[derive(Debug, Default)]
pub(crate) struct Score {
    /// Days.
    pub(crate) loss: f64,
    pub(crate) brier: f64,
    /// Of a collapse within the horizon.
    pub(crate) largest_chance: f64,
    pub(crate) oranges: usize,
    pub(crate) reds: usize,
}

/// Both ways, at the refits at which an effect is adopted.
#[derive(Debug, Default)]
pub(crate) struct Comparison {
    pub(crate) looks: usize,
    pub(crate) plain: Score,
    pub(crate) adopted: Score,
    /// What was adopted, in the order in which it was found.
    pub(crate) effects: Vec<String>,
}

/// One refit.
struct ForecastLook {
    failure_time: FailureTime,
    chance: f64,
    is_adopted: bool,
}

/// A replay: its refits by time, what it adopted, and how often it called orange and red.
#[derive(Default)]
struct Replayed {
    looks: BTreeMap<Timestamp, ForecastLook>,
    effects: Vec<String>,
    oranges: usize,
    reds: usize,
}

/// Replays the recording both ways; `failure` is when the slope fails.
pub(crate) fn compared(recording: &Recording, failure: Option<Timestamp>) -> Result<Comparison> {
    let with = replayed(recording, Explain::Adopt)?;
    let without = replayed(recording, Explain::Report)?;
    let mut both = Comparison {
        effects: with.effects.clone(),
        ..Comparison::default()
    };
    for (time, look) in with.looks.iter().filter(|(_, look)| look.is_adopted) {
        let Some(plain) = without.looks.get(time) else {
            continue;
        };
        both.looks += 1;
        both.adopted.add(look, *time, failure);
        both.plain.add(plain, *time, failure);
    }
    both.adopted.finish(both.looks, &with);
    both.plain.finish(both.looks, &without);
    Ok(both)
}

impl Score {
    fn add(&mut self, look: &ForecastLook, now: Timestamp, failure: Option<Timestamp>) {
        let remains = failure.map(|failure| days_since(now, failure));
        self.loss += loss(&look.failure_time, now, remains);
        let comes = remains.is_some_and(|days| days <= OUTLOOK_DAYS);
        self.brier += (look.chance - f64::from(u8::from(comes))).powi(2);
        self.largest_chance = self.largest_chance.max(look.failure_time.probability);
    }

    fn finish(&mut self, looks: usize, of: &Replayed) {
        let n = looks.max(1) as f64;
        self.loss /= n;
        self.brier /= n;
        (self.oranges, self.reds) = (of.oranges, of.reds);
    }
}

/// Mean of twice the quantile loss of the three quantiles, days; `remains` until the failure.
fn loss(forecast: &FailureTime, now: Timestamp, remains: Option<f64>) -> f64 {
    let truth = remains.unwrap_or(HORIZON_DAYS).min(HORIZON_DAYS);
    let quantiles = [
        (0.05, forecast.low),
        (0.5, forecast.median),
        (0.95, forecast.high),
    ];
    let each = quantiles.map(|(share, time)| {
        let days = time.map_or(HORIZON_DAYS, |time| days_since(now, time));
        let off = truth - days.min(HORIZON_DAYS);
        2.0 * if off >= 0.0 {
            share * off
        } else {
            (share - 1.0) * off
        }
    });
    each.iter().sum::<f64>() / each.len() as f64
}

fn replayed(recording: &Recording, explain: Explain) -> Result<Replayed> {
    let settings = Settings {
        explain,
        ..Settings::default()
    };
    let plan = ReplayPlan {
        site: "adoption",
        settings: &settings,
        hooks: &[],
        pace: ReplayPace::Max,
        until: None,
    };
    let (_trigger, shutdown) = shutdown::pair();
    let mut seen = Replayed::default();
    let mut each = |event: &Event| {
        seen.note(event);
        Ok(())
    };
    let runtime = tokio::runtime::Runtime::new()?;
    runtime.block_on(replay(recording, &plan, shutdown, &mut each))?;
    Ok(seen)
}

impl Replayed {
    fn note(&mut self, event: &Event) {
        if let EventKind::Refit {
            t_max,
            failure_time,
            chance_within_outlook,
            plain,
            ..
        } = &event.kind
        {
            let look = ForecastLook {
                failure_time: *failure_time,
                chance: *chance_within_outlook,
                is_adopted: plain.is_some(),
            };
            self.looks.insert(*t_max, look);
        }
        if let EventKind::EffectFound {
            effect,
            channel,
            adopted: true,
            ..
        } = &event.kind
        {
            let channel = channel
                .as_ref()
                .map_or(String::new(), |name| format!(" `{name}`"));
            let name = format!("{effect}{channel}");
            if !self.effects.contains(&name) {
                self.effects.push(name);
            }
        }
        if let EventKind::Alert {
            level,
            state: AlertState::Firing,
            ..
        } = &event.kind
        {
            self.oranges += usize::from(*level == Level::Orange);
            self.reds += usize::from(*level == Level::Red);
        }
    }
}

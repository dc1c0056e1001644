//! How a network does on slopes of a family on which it was not trained.

use crate::looks::{about_the_end, first, in_two};
use jiff::SignedDuration;
use slipwatch::alert::{AlertEvidence, Held, Level, Policy, to_the_next_reading};
use slipwatch::fit::Observations;
use slipwatch::forecast::{Indicators, Members, Network};
use slipwatch::reading::{SECONDS_PER_DAY, Timestamp, after_days};
use slipwatch::score::{Known, METHODS, Outcome, crps_days, is_covered, scored_days};
use std::collections::BTreeMap;
use studies::{Family, GaugeKind, Simulated};

/// Seeds that judge.
const FIRST_SEED: u64 = 1_000_000;
/// Failing slopes of a family whose leads are scored, and slopes that fail and that stand whose lives are followed.
const SCORED: u64 = 60;
const REPLAYED: (u64, u64) = (40, 100);
/// The program's own methods, in [`METHODS`].
const OURS: [&str; 2] = ["panel", "slider-block"];
/// Passing this velocity is failure for the rivals that ask, mm/day.
const CRITICAL: f64 = 1000.0;
/// Evacuation times, days.
pub(crate) const EVACUATIONS: [f64; 3] = [0.5, 1.0, 3.0];
/// A slope is to be read so often in an evacuation time.
const READ: f64 = 4.0;
/// Chances from which red could be called instead of the policy's, and the evacuation time for which that is tried, in
/// [`EVACUATIONS`].
pub(crate) const CHANCES: [f64; 6] = [0.15, 0.2, 0.27, 0.35, 0.45, 0.6];
const A_DAY: usize = 1;
/// Levels stay: another entry within so many days is the same alarm.
const SAME_ALARM_DAYS: f64 = 3.0;
pub(crate) const FEWEST_READINGS: usize = 12;
/// Readings of a life that are looked at, at most.
const MOST_ASKED: usize = 1500;

/// What came of one family.
#[derive(Debug)]
pub(crate) struct Judged {
    pub(crate) family: Family,
    pub(crate) leads: Vec<Lead>,
    pub(crate) replays: Vec<Replay>,
}

/// A forecast before a collapse.
#[derive(Debug)]
pub(crate) struct Lead {
    pub(crate) left_days: f64,
    pub(crate) is_covered: bool,
    pub(crate) median_days: f64,
    pub(crate) crps_days: f64,
    /// Of each rival, days.
    pub(crate) rivals: BTreeMap<&'static str, f64>,
}

/// Every reading of one life.
#[derive(Debug)]
pub(crate) struct Replay {
    pub(crate) gauge: GaugeKind,
    pub(crate) interval_days: f64,
    pub(crate) years: f64,
    pub(crate) red: Alarms,
    pub(crate) orange: Alarms,
    /// For each evacuation time that the sampling serves, whether red came so long before the collapse.
    pub(crate) in_time: [Option<bool>; EVACUATIONS.len()],
    /// Red from each of [`CHANCES`] on, where an evacuation takes a day.
    pub(crate) by_chance: [Alarms; CHANCES.len()],
    pub(crate) in_time_by_chance: [Option<bool>; CHANCES.len()],
}

/// Alarms of one level.
#[derive(Debug, Default)]
pub(crate) struct Alarms {
    /// Those that begin within [`SAME_ALARM_DAYS`] of another are that one.
    pub(crate) count: u32,
    /// How long they lasted.
    pub(crate) years: f64,
    /// When the slope was looked at during them, days.
    times: Vec<f64>,
}

impl Alarms {
    fn add(&mut self, now_days: f64, years: f64) {
        let is_new = |last: &f64| now_days - last > SAME_ALARM_DAYS;
        self.count += u32::from(self.times.last().is_none_or(is_new));
        self.years += years;
        self.times.push(now_days);
    }

    /// Whether the first of them since the acceleration could be seen came an evacuation time before the collapse; `None`
    /// where the slope does not collapse, or is read too seldom or seen too late for that.
    fn in_time(&self, slope: &Simulated, evacuation: f64) -> Option<bool> {
        let collapse = slope.collapse_days?;
        let is_read = slope.interval_days <= evacuation / READ;
        let can_be = collapse - slope.visible_days >= evacuation;
        let since = self.times.iter().find(|at| **at >= slope.visible_days);
        let in_time = since.is_some_and(|at| collapse - at >= evacuation);
        (is_read && can_be).then_some(in_time)
    }
}

pub(crate) fn family(family: Family, network: &Network) -> Judged {
    let seeds: Vec<u64> = (0..SCORED).map(|index| FIRST_SEED + index).collect();
    let leads = if family.fails() {
        in_two(&seeds, |seed| {
            leads(&Simulated::draw(family, *seed), *seed, network)
        })
    } else {
        Vec::new()
    };
    let lives = if family.fails() {
        REPLAYED.0
    } else {
        REPLAYED.1
    };
    let seeds: Vec<u64> = (0..lives).map(|index| 2 * FIRST_SEED + index).collect();
    Judged {
        family,
        leads,
        replays: in_two(&seeds, |seed| {
            vec![replay(&Simulated::draw(family, *seed), network, MOST_ASKED)]
        }),
    }
}

/// Samplings of years, with the years of each family, and how often a year is looked at, at most.
pub(crate) const YEARS: [(f64, &str, u64); 3] = [
    (1.0 / 144.0, "10 min", 2),
    (1.0 / 24.0, "1 h", 6),
    (1.0, "1 d", 60),
];
const LOOKS_A_YEAR: usize = 4384;

/// Years of slopes of a family that stands, for each of [`YEARS`].
pub(crate) fn years(family: Family, network: &Network) -> Vec<Vec<Replay>> {
    let each = YEARS.iter().map(|(interval, _, years)| {
        let seeds: Vec<u64> = (0..*years).map(|index| 3 * FIRST_SEED + index).collect();
        in_two(&seeds, |seed| {
            let slope = Simulated::year(family, *interval, *seed);
            vec![replay(&slope, network, LOOKS_A_YEAR)]
        })
    });
    each.collect()
}

/// Lives of slopes of a family that fails.
pub(crate) fn failing_lives(family: Family, network: &Network) -> Vec<Replay> {
    let seeds: Vec<u64> = (0..REPLAYED.0)
        .map(|index| 3 * FIRST_SEED + index)
        .collect();
    in_two(&seeds, |seed| {
        vec![replay(&Simulated::draw(family, *seed), network, MOST_ASKED)]
    })
}

fn leads(slope: &Simulated, seed: u64, network: &Network) -> Vec<Lead> {
    let Some(collapse) = slope.collapse_days else {
        return Vec::new();
    };
    let counts = about_the_end(slope, collapse, seed).into_iter();
    let judged = counts.filter_map(|count| {
        let observations = first(&slope.observations, count);
        let now_days = observations.values.last()?.t_days;
        let left_days = collapse - now_days;
        let indicators = Indicators::of(&observations)?;
        let found = indicators.collapse_by(network, &Members::of(&observations));
        let scored = scored_days(now_days - observations.values[0].t_days);
        let outcome = Outcome::Failed(left_days);
        let known = Known {
            now_days,
            observations,
            flow: Vec::new(),
            critical_mm_per_day: CRITICAL,
        };
        let rivals = METHODS.iter().filter(|method| !OURS.contains(&method.name));
        let rivals = rivals.map(|method| {
            let forecast = (method.forecast)(&known).unwrap_or_default();
            (method.name, crps_days(&forecast, outcome, scored))
        });
        let median = found.passage.quantile(0.5, f64::INFINITY);
        Some(Lead {
            left_days,
            is_covered: is_covered(&found.passage, left_days),
            median_days: median.unwrap_or(f64::INFINITY),
            crps_days: crps_days(&found.passage, outcome, scored),
            rivals: rivals.collect(),
        })
    });
    judged.collect()
}

/// The chances by which levels go after a reading.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Chances {
    /// By which red is called, for each of [`EVACUATIONS`].
    red: [f64; EVACUATIONS.len()],
    /// Within the outlook.
    pub(crate) outlook: f64,
}

impl Chances {
    /// By `network`; none where the evidence leaves none that could call a level.
    pub(crate) fn of(observations: &Observations, network: &Network) -> Option<Self> {
        let indicators = Indicators::of(observations)?;
        let policy = Policy::default();
        let outlook = in_days(policy.outlook);
        let spans = EVACUATIONS.map(|days| ahead(days, &indicators));
        let may_be_red = |days: &f64| indicators.may_reach(*days, CHANCES[0]);
        if !spans.iter().any(may_be_red) && !indicators.may_reach(outlook, policy.orange_chance) {
            return Some(Self::default());
        }
        let found = indicators.collapse_by(network, &Members::of(observations));
        Some(Self {
            red: spans.map(|days| found.sure.chance_within(days)),
            outlook: found.sure.chance_within(outlook),
        })
    }
}

/// The levels of a life by one policy, without its latch.
#[derive(Debug)]
pub(crate) struct Calls {
    policy: Policy,
    /// In [`EVACUATIONS`].
    evacuation: usize,
    held: Held,
}

impl Calls {
    /// By the default policy where an evacuation takes a day.
    pub(crate) fn of_a_day() -> Self {
        Self::with(A_DAY, Policy::default().red_chance)
    }

    fn with(evacuation: usize, red_chance: f64) -> Self {
        Self {
            policy: Policy {
                red_chance,
                ..policy(EVACUATIONS[evacuation])
            },
            evacuation,
            held: Held::default(),
        }
    }

    /// What the chances after the reading of a day call.
    pub(crate) fn level(&mut self, now_days: f64, chances: &Chances) -> Level {
        let mut evidence = AlertEvidence {
            now: after_days(Timestamp::UNIX_EPOCH, now_days).unwrap_or_default(),
            chance_for_red: Some(chances.red[self.evacuation]),
            chance_within_outlook: Some(chances.outlook),
            ..AlertEvidence::default()
        };
        self.held.update(&self.policy, &mut evidence);
        self.policy.call(&evidence).level
    }
}

/// The default one but for the evacuation time, days.
fn policy(evacuation: f64) -> Policy {
    Policy {
        evacuation_time: SignedDuration::from_secs_f64(evacuation * SECONDS_PER_DAY),
        ..Policy::default()
    }
}

/// How far ahead red looks from a reading where an evacuation takes so many days: days.
fn ahead(evacuation: f64, indicators: &Indicators) -> f64 {
    in_days(to_the_next_reading(
        policy(evacuation).red_within(),
        indicators.to_next_days(),
    ))
}

fn in_days(span: SignedDuration) -> f64 {
    span.as_secs_f64() / SECONDS_PER_DAY
}

/// One life, asked at each reading, or at so many of them evenly.
fn replay(slope: &Simulated, network: &Network, most_asked: usize) -> Replay {
    let values = &slope.observations.values;
    let red_chance = Policy::default().red_chance;
    let mut reds: [(Calls, Alarms); EVACUATIONS.len()] =
        std::array::from_fn(|index| (Calls::with(index, red_chance), Alarms::default()));
    let mut by_chance =
        CHANCES.map(|red_chance| (Calls::with(A_DAY, red_chance), Alarms::default()));
    let (mut orange, mut all_years) = (Alarms::default(), 0.0);
    let step = values.len().div_ceil(most_asked);
    for count in (FEWEST_READINGS..=values.len()).step_by(step) {
        let Some(chances) = Chances::of(&first(&slope.observations, count), network) else {
            continue;
        };
        let now = values[count - 1].t_days;
        let next = values.get(count - 1 + step);
        let years = next.map_or(0.0, |next| next.t_days - now) / 365.25;
        all_years += years;
        let mut add = |(calls, alarms): &mut (Calls, Alarms)| {
            let level = calls.level(now, &chances);
            if level == Level::Red {
                alarms.add(now, years);
            }
            level
        };
        let levels = reds.each_mut().map(&mut add);
        for one in &mut by_chance {
            add(one);
        }
        if levels[A_DAY] >= Level::Orange {
            orange.add(now, years);
        }
    }
    let (reds, by_chance) = (
        reds.map(|(_, alarms)| alarms),
        by_chance.map(|(_, alarms)| alarms),
    );
    let in_time = std::array::from_fn(|index| reds[index].in_time(slope, EVACUATIONS[index]));
    let in_time_by_chance =
        std::array::from_fn(|index| by_chance[index].in_time(slope, EVACUATIONS[A_DAY]));
    let [_, red, _] = reds;
    Replay {
        gauge: slope.gauge,
        interval_days: slope.interval_days,
        years: all_years,
        red,
        orange,
        in_time,
        by_chance,
        in_time_by_chance,
    }
}

//! How joint forecasts do on simulated masses of four benchmarks whose end is known: `neighbours [MASSES]`.
//!
//! The four share their onset, their time to failure and the whole of their load, and each has its own m,
//! slip and readings. The truth is the median of the times at which they pass the critical velocity, which
//! lie apart. Of pairs: how often benchmarks of one mass are distinguished, and others taken together.

#![expect(clippy::print_stdout, reason = "a table is what it is for")]

use slipwatch::fit::Rate;
use slipwatch::forecast::{
    Dependence, FailureTimeLikelihood, Group, HORIZON_DAYS, LawForecaster, Passage, Snapshot,
    groups,
};
use studies::{Fate, Life};

const LEADS: [f64; 5] = [40.0, 20.0, 10.0, 5.0, 2.0];
const MEMBERS: usize = 4;

fn main() -> anyhow::Result<()> {
    let masses = std::env::args()
        .nth(1)
        .map_or(Ok(150), |text| text.parse())?;
    println!(
        "lead d  masses  joint: |error|  in 90 %  ln width  single: |error|  in 90 %  ln width"
    );
    for lead in LEADS {
        at_lead(masses, lead);
    }
    println!(
        "\nlead d  of one mass, distinguished  fails in 5 times that, taken together  stands, taken together"
    );
    for lead in LEADS {
        pairs(masses, lead);
    }
    Ok(())
}

/// What the readings up to a time predict from then.
struct Seen {
    passage: Passage,
    rates: Vec<Rate>,
    now: f64,
}

/// What the readings up to `now` days predict, from then.
fn passage(life: &Life, now: f64) -> Option<Seen> {
    let outlook = LawForecaster::default().update(&life.known(now), Life::CRITICAL_MM_PER_DAY)?;
    let later = now - outlook.now_days;
    let times = outlook.passage.times().iter();
    let times = times.map(|(days, share)| (days - later, *share));
    Some(Seen {
        passage: Passage::from_times(times.collect()),
        rates: outlook.rates,
        now,
    })
}

fn one_look(seen: &[Seen]) -> Vec<Group> {
    let likelihoods = seen
        .iter()
        .map(|one| Some(FailureTimeLikelihood::of(&one.passage, 0.0)));
    let look = Snapshot {
        left_days: 1.0,
        likelihoods: likelihoods.collect(),
    };
    let rates: Vec<(&[Rate], f64)> = seen.iter().map(|one| (&*one.rates, one.now)).collect();
    groups(&[look], &Dependence::measured(&rates))
}

/// Errors and widths in ln of the remaining time.
#[derive(Default)]
struct NeighbourScore {
    errors: Vec<f64>,
    widths: Vec<f64>,
    inside: f64,
}

impl NeighbourScore {
    fn add(&mut self, passage: &Passage, truth: f64) {
        let at = |share| {
            passage
                .quantile(share, HORIZON_DAYS)
                .unwrap_or(f64::INFINITY)
        };
        let (low, high) = (at(0.05).max(1e-3), at(0.95));
        self.errors.push((at(0.5).max(1e-3) / truth).ln().abs());
        self.widths.push((high / low).ln());
        self.inside += f64::from(u8::from(low <= truth && truth <= high));
    }

    fn row(self) -> String {
        let count = self.errors.len() as f64;
        let (error, inside) = (median(self.errors), self.inside / count);
        format!("{error:14.3} {inside:8.3} {:9.3}", median(self.widths))
    }
}

fn at_lead(masses: u64, lead: f64) {
    let (mut joint, mut single) = (NeighbourScore::default(), NeighbourScore::default());
    let mut count = 0;
    for seed in 0..masses {
        let lives = Life::draw_together(MEMBERS, 90_000 + seed);
        let ends: Vec<f64> = lives.iter().filter_map(|life| life.failure_days).collect();
        let now = ends.iter().copied().fold(f64::INFINITY, f64::min) - lead;
        let seen: Option<Vec<Seen>> = lives.iter().map(|life| passage(life, now)).collect();
        let Some(seen) = seen else {
            continue;
        };
        let mut sorted = ends.clone();
        sorted.sort_by(f64::total_cmp);
        let truth = f64::midpoint(sorted[MEMBERS / 2 - 1], sorted[MEMBERS / 2]) - now;
        let largest = one_look(&seen)
            .into_iter()
            .max_by_key(|group| group.members.len());
        let Some(largest) = largest else {
            continue;
        };
        count += 1;
        joint.add(&largest.passage, truth);
        for (one, end) in seen.iter().zip(&ends) {
            single.add(&one.passage, end - now);
        }
    }
    println!("{lead:6} {count:7} {} {}", joint.row(), single.row());
}

fn pairs(masses: u64, lead: f64) {
    let share = |pairs: &dyn Fn(u64) -> Option<[Seen; 2]>| {
        let found: Vec<bool> = (0..masses)
            .filter_map(pairs)
            .map(|pair| one_look(&pair).len() == 1)
            .collect();
        let together = found.iter().filter(|together| **together).count();
        together as f64 / found.len().max(1) as f64
    };
    let before_end = |life: &Life, left: f64| passage(life, life.failure_days? - left);
    let same = share(&|seed| {
        let lives = Life::draw_together(2, 90_000 + seed);
        let end = lives[0].failure_days?.min(lives[1].failure_days?);
        Some([
            passage(&lives[0], end - lead)?,
            passage(&lives[1], end - lead)?,
        ])
    });
    let other = share(&|seed| {
        let (soon, later) = (seed, 10_000 + seed);
        let [soon, later] = [soon, later].map(|seed| Life::draw(Fate::Failing, seed));
        Some([before_end(&soon, lead)?, before_end(&later, 5.0 * lead)?])
    });
    let standing = share(&|seed| {
        let stands = Life::draw(Fate::Saturating, 5000 + seed);
        let end = stands.readings.last()?.0;
        let soon = Life::draw(Fate::Failing, seed);
        Some([before_end(&soon, lead)?, passage(&stands, end)?])
    });
    println!("{lead:6} {:24.3} {other:39.3} {standing:23.3}", 1.0 - same);
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

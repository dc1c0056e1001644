//! How forecasts do on simulated lives of slopes whose end is known: `lives [FAILING] [STANDING]`.
//!
//! For each lead, the forecast made at the last reading that leaves at least that time: its error over the
//! remaining time, its bias, and how often the truth lies in the 90 % interval.

#![expect(clippy::print_stdout, reason = "a table is what it is for")]

use slipwatch::forecast::{Fate, HORIZON_DAYS, Life, Outlook, Panel};

const LEADS: [f64; 5] = [40.0, 20.0, 10.0, 5.0, 2.0];
/// Looks at each standing slope, evenly over its readings.
const LOOKS: usize = 40;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let mut count = |default: u64| -> anyhow::Result<u64> {
        Ok(arguments.next().map_or(Ok(default), |text| text.parse())?)
    };
    let (failing, standing) = (count(1000)?, count(400)?);
    println!("{failing} failing slopes");
    println!("lead d  lives  median |error|  median error  in 90 %  before it  after it");
    let lives: Vec<Life> = (0..failing)
        .map(|seed| Life::draw(Fate::Failing, seed))
        .collect();
    for lead in LEADS {
        at_lead(&lives, lead);
    }
    standing_slopes(standing);
    Ok(())
}

/// The outlook after the first `count` readings.
fn outlook(life: &Life, count: usize) -> Option<Outlook> {
    let (now_days, _) = life.readings[count.checked_sub(1)?];
    Panel::default().update(&life.known(now_days), Life::CRITICAL_MM_PER_DAY)
}

fn at_lead(lives: &[Life], lead: f64) {
    let mut errors = Vec::new();
    let (mut before, mut after) = (0_i32, 0_i32);
    for life in lives {
        let Some(failure) = life.failure_days else {
            continue;
        };
        let known = life
            .readings
            .partition_point(|(days, _)| *days <= failure - lead);
        let Some(remaining) = known
            .checked_sub(1)
            .map(|last| failure - life.readings[last].0)
        else {
            continue;
        };
        // A gap in the readings leaves nothing to judge at this lead.
        if remaining > 2.0 * lead {
            continue;
        }
        let Some(outlook) = outlook(life, known) else {
            continue;
        };
        let quantile = |share| outlook.passage.quantile(share, HORIZON_DAYS);
        errors.push(quantile(0.5).map_or(f64::INFINITY, |days| days / remaining - 1.0));
        before += i32::from(quantile(0.05).is_none_or(|low| remaining < low));
        after += i32::from(quantile(0.95).is_some_and(|high| remaining > high));
    }
    let count = errors.len() as f64;
    let sizes = errors.iter().map(|error| error.abs()).collect();
    println!(
        "{lead:6} {:6} {:15.3} {:13.3} {:8.3} {:10.3} {:9.3}",
        errors.len(),
        median(sizes),
        median(errors),
        1.0 - f64::from(before + after) / count,
        f64::from(before) / count,
        f64::from(after) / count,
    );
}

fn standing_slopes(count: u64) {
    let (mut looks, mut red, mut red_lives, mut orange) = (0, 0, 0, 0);
    let mut least = f64::INFINITY;
    let fates = [Fate::Saturating, Fate::Steady, Fate::Settling];
    for (seed, fate) in (0..count).zip(fates.into_iter().cycle()) {
        let life = Life::draw(fate, 5000 + seed);
        let mut was_red = false;
        for look in 1..=LOOKS {
            let known = life.readings.len() * look / LOOKS;
            let Some(outlook) = outlook(&life, known) else {
                continue;
            };
            looks += 1;
            least = least.min(
                outlook
                    .passage
                    .quantile(0.05, HORIZON_DAYS)
                    .unwrap_or(least),
            );
            let reds = outlook.passage.chance_within(1.0) >= 0.05;
            red += i32::from(reds);
            was_red |= reds;
            orange += i32::from(outlook.passage.chance_within(10.0) >= 0.05);
        }
        red_lives += i32::from(was_red);
    }
    println!(
        "{count} standing slopes, {looks} looks: earliest 5 % quantile {least:.2} d; \
         chance within a day of 5 % or more {red} times, on {red_lives} slopes; within ten days {orange} times"
    );
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

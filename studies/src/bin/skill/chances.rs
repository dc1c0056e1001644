//! What is reported of chances: the Brier score, and the levels they would call.

use crate::corpus::{LOOKS, LOOKS_AT_FAILING, SHORT_LEADS, SIMULATED_LEADS};
use crate::record::{Record, SeriesForecasts};
use crate::reduce::brier;
use crate::simulated::{of_family, standing_fates};
use crate::sums::{
    PANEL, SEED, Scored, average, grid, lead_head, one_if, percent, short_cell, sums,
};
use slipwatch::alert::Policy;
use slipwatch::score::{Interval, ratio};
use std::fmt::Write as _;

/// Passing within so many days is scored.
pub(crate) const BRIER_DAYS: [f64; 4] = [0.25, 1.0, 3.0, 10.0];

fn all<'a>(scored: &Scored<'a>) -> Vec<&'a SeriesForecasts> {
    [&scored.failing[..], &scored.standing[..]].concat()
}

/// How often it came within that time, over all looks of which that is known.
fn base_rate(series: &[&SeriesForecasts], days: f64) -> Option<f64> {
    let came = |record: &Record| record.outcome.within(days).map(one_if);
    average(&sums(series, PANEL, &came))
}

/// The skill of one method against the base rate: 1 less the ratio of their Brier scores.
pub(crate) fn skill(scored: &Scored, name: &str, days: f64) -> Option<Interval> {
    let series = all(scored);
    let base = base_rate(&series, days)?;
    let theirs = |record: &Record| {
        Some(brier(
            record.chance_within(days),
            record.outcome.within(days)?,
        ))
    };
    let climate = |record: &Record| Some(brier(base, record.outcome.within(days)?));
    let over = ratio(
        &sums(&series, name, &theirs),
        &sums(&series, name, &climate),
        SEED,
    )?;
    Some(Interval {
        best: 1.0 - over.best,
        low: 1.0 - over.high,
        high: 1.0 - over.low,
    })
}

/// The section on the Brier score.
pub(crate) fn brier_section(out: &mut String, scored: &Scored) {
    let series = all(scored);
    let short: Vec<String> = SHORT_LEADS.iter().map(ToString::to_string).collect();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "\n## Passing the critical velocity within a time\n\nOver all evaluations of simulated slopes of which it is known: {LOOKS_AT_FAILING} evenly over the readings \
         of each that fails, its leads above, and {} days before the failure where it is read so often; {LOOKS} evenly over each that \
         stands. The looks beside those leads are in no table above. Brier skill, 1 − Brier score / that of the base rate over the same looks (90 % interval, the \
         base rate held). Above 0 is better than the base rate; a point forecast gives 0 or 1.",
        short.join(", ")
    );
    let horizon = |days: &f64| {
        if *days < 1.0 {
            format!("{:.0} h", 24.0 * days)
        } else {
            format!("{days} d")
        }
    };
    let mut head = vec!["method".to_owned()];
    head.extend(BRIER_DAYS.iter().map(horizon));
    let of_base = |of: &dyn Fn(f64) -> f64| {
        let each = BRIER_DAYS.map(|days| base_rate(&series, days).map(of));
        each.map(|value| value.map_or("–".to_owned(), |value| format!("{value:.4}")))
    };
    let mut rows = vec![
        [vec!["base rate".to_owned()], of_base(&|base| base).to_vec()].concat(),
        [
            vec!["its Brier score".to_owned()],
            of_base(&|base| base * (1.0 - base)).to_vec(),
        ]
        .concat(),
    ];
    for name in &scored.methods {
        let mut row = vec![(*name).to_owned()];
        row.extend(BRIER_DAYS.map(|days| short_cell(skill(scored, name, days))));
        rows.push(row);
    }
    grid(out, &head, &rows);
}

/// Which levels the chances of one forecast call.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Called {
    Red,
    Orange,
    Yellow,
}

impl Called {
    const ALL: [Self; 3] = [Self::Red, Self::Orange, Self::Yellow];

    /// By the default policy's figures, and nothing else of it.
    pub(crate) fn by(self, record: &Record) -> bool {
        let policy = Policy::default();
        let days = |span: jiff::SignedDuration| span.as_secs_f64() / 86_400.0;
        let outlook = days(policy.outlook);
        match self {
            Self::Red => record.chance_within(days(policy.red_within())) >= policy.red_chance,
            Self::Orange => record.chance_within(outlook) >= policy.orange_chance,
            Self::Yellow => record.chance_within(outlook) >= policy.yellow_chance,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Red => "red",
            Self::Orange => "orange",
            Self::Yellow => "yellow",
        }
    }
}

/// The share of the panel's looks that call a level.
pub(crate) fn share_called(
    series: &[&SeriesForecasts],
    called: Called,
    is_meant: &dyn Fn(&Record) -> bool,
) -> Option<f64> {
    let score = |record: &Record| is_meant(record).then(|| one_if(called.by(record)));
    average(&sums(series, PANEL, &score))
}

/// The share of series of which a look ever calls a level.
pub(crate) fn share_ever(series: &[&SeriesForecasts], called: Called) -> Option<f64> {
    let ever = series.iter().filter(|one| {
        let mut panel = one.records.iter().filter(|record| record.method == PANEL);
        panel.any(|record| called.by(record))
    });
    (!series.is_empty()).then(|| ever.count() as f64 / series.len() as f64)
}

/// The section on levels.
pub(crate) fn levels_section(out: &mut String, scored: &Scored) {
    let policy = Policy::default();
    let hours = policy.red_within().as_hours();
    let days = policy.outlook.as_hours() / 24;
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "\n## Detection and false alarms\n\nThe panel's chances at the default policy's figures: red from {} within {hours} hours, orange from {} and yellow from {} within {days} \
         days. Each row by its own figure; the rules by which red is confirmed and levels end, and thresholds, are not in this.\n\nShare of failing slopes called, by time before the failure:",
        policy.red_chance, policy.orange_chance, policy.yellow_chance
    );
    let leads = [&SIMULATED_LEADS[..], &SHORT_LEADS[..]].concat();
    let row = |called: Called| {
        let mut row = vec![called.name().to_owned()];
        for lead in &leads {
            let is_meant = |record: &Record| record.lead_days == Some(*lead);
            row.push(percent(share_called(&scored.failing, called, &is_meant)));
        }
        row
    };
    grid(out, &lead_head("", &leads, &[]), &Called::ALL.map(row));
    out.push_str(
        "\nStanding slopes: share of evaluations, and of slopes at one evaluation or more:\n",
    );
    let head = [
        "fate",
        "slopes",
        "evaluations red",
        "orange",
        "yellow",
        "slopes ever red",
        "slopes ever orange",
    ];
    let mut groups: Vec<(&str, Vec<&SeriesForecasts>)> = standing_fates(scored)
        .into_iter()
        .map(|fate| (fate, of_family(&scored.standing, fate)))
        .collect();
    groups.push(("all", scored.standing.clone()));
    let row = |(name, series): &(&str, Vec<&SeriesForecasts>)| {
        let mut row = vec![(*name).to_owned(), series.len().to_string()];
        row.extend(Called::ALL.map(|called| percent(share_called(series, called, &|_| true))));
        row.push(percent(share_ever(series, Called::Red)));
        row.push(percent(share_ever(series, Called::Orange)));
        row
    };
    let rows: Vec<Vec<String>> = groups.iter().map(row).collect();
    grid(out, &head.map(str::to_owned), &rows);
}

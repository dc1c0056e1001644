//! Where the panel loses, and what was asked of it.

use crate::chances::{BRIER_DAYS, Called, share_called, skill};
use crate::corpus::SIMULATED_LEADS;
use crate::record::Record;
use crate::simulated::{coverage, of_family, over_best, standing_fates};
use crate::sites::{Standing, leads, loss, unit};
use crate::sums::{PANEL, Scored, grid, percent, short_cell};
use std::fmt::Write as _;

/// The panel's mean CRPS, and the rivals that are lower, days.
type Loss = (f64, Vec<(f64, &'static str)>);

/// Less is not reported, days.
const LEAST_DAYS: f64 = 0.005;
/// What the figures rest on, in words.
const REASONS: &str = include_str!("reasons.md");
/// Coverage of 90 % intervals that was asked for.
const COVERAGE: std::ops::RangeInclusive<f64> = 0.85..=0.95;
/// The panel's CRPS over the best rival's that was asked for.
const RATIO: f64 = 0.85;
/// Looks at standing slopes that may be orange.
const ORANGE: f64 = 0.02;

/// The section on losses.
pub(crate) fn losses(out: &mut String, scored: &Scored) {
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "\n## Where this program loses, and why\n\nEvery simulated lead and fate, every recorded series that stood and every lead of those that failed, where a rival's mean CRPS is \
         lower than the panel's; all such rivals, best first. A panel's CRPS under {LEAST_DAYS} d is no loss."
    );
    let mut rows = Vec::new();
    let mut row = |place: String, (unit, factor): (&str, f64), lost: Option<Loss>| {
        let Some((ours, rivals)) = lost.filter(|(ours, _)| *ours >= LEAST_DAYS) else {
            return;
        };
        let rivals = rivals
            .iter()
            .map(|(theirs, name)| format!("{name} {:.2}", factor * theirs));
        let rivals: Vec<String> = rivals.collect();
        rows.push(vec![
            place,
            format!("{:.2} {unit}", factor * ours),
            rivals.join(", "),
        ]);
    };
    let days = ("d", 1.0);
    for lead in SIMULATED_LEADS {
        let is_meant = |record: &Record| record.lead_days == Some(lead);
        let lost = loss(scored, &scored.failing, &is_meant);
        row(format!("simulated, {lead} d before"), days, lost);
    }
    for one in &scored.failed {
        let unit = unit(one);
        for lead in leads(one) {
            let is_meant = |record: &Record| record.lead_days == Some(lead);
            let place = format!("{}, {:.0} {} before", one.name, unit.1 * lead, unit.0);
            row(place, unit, loss(scored, &[one], &is_meant));
        }
    }
    for fate in standing_fates(scored) {
        let series = of_family(&scored.standing, fate);
        let lost = loss(scored, &series, &|_| true);
        row(format!("simulated, {fate}"), days, lost);
    }
    for one in &scored.stood {
        let lost = loss(scored, &[one], &|_| true);
        row(format!("{}, stood", one.name), days, lost);
    }
    let head = ["where", "panel", "rivals that are lower"];
    grid(out, &head.map(str::to_owned), &rows);
    let _ = write!(out, "\n{REASONS}");
}

/// The section on targets.
pub(crate) fn targets(out: &mut String, scored: &Scored) {
    out.push_str("\n## What was asked and not reached\n");
    let mut rows = Vec::new();
    let mut row = |asked: String, is_met: bool, figure: String| {
        let met = if is_met { "met" } else { "**not met**" };
        rows.push(vec![asked, met.to_owned(), figure]);
    };
    for lead in SIMULATED_LEADS {
        let held = coverage(scored, PANEL, lead);
        row(
            format!("90 % interval holds 85 to 95 % of failures, {lead} d before"),
            held.is_some_and(|held| COVERAGE.contains(&held)),
            percent(held),
        );
    }
    for lead in SIMULATED_LEADS.map(Some).into_iter().chain([None]) {
        let over = over_best(scored, lead);
        let when = lead.map_or("all leads".to_owned(), |lead| format!("{lead} d before"));
        row(
            format!("mean CRPS at least 15 % under the best rival's, {when}"),
            over.is_some_and(|(_, over)| over.best <= RATIO),
            over.map_or("–".to_owned(), |(rival, over)| {
                format!("{} of {rival}'s", short_cell(Some(over)))
            }),
        );
    }
    for days in BRIER_DAYS {
        let skill = skill(scored, PANEL, days);
        row(
            format!("Brier skill above 0, within {days} d"),
            skill.is_some_and(|skill| skill.best > 0.0),
            short_cell(skill),
        );
    }
    for one in &scored.failed {
        let Some(standing) = Standing::of(one, scored) else {
            continue;
        };
        let leads = standing.leads;
        row(
            format!("{}: at or under the best rival at each lead", one.name),
            standing.at_or_under_each == leads,
            format!("{} of {leads}", standing.at_or_under_each),
        );
        row(
            format!(
                "{}: late median at no more than half of the leads",
                one.name
            ),
            2 * standing.late <= leads,
            format!("{} of {leads}", standing.late),
        );
    }
    for (name, series) in [("simulated", &scored.standing), ("recorded", &scored.stood)] {
        let share = |called| share_called(series, called, &|_| true);
        let (red, orange) = (share(Called::Red), share(Called::Orange));
        row(
            format!("{name} slopes that stand: never red"),
            red.is_some_and(|red| red <= 0.0),
            format!("{} of looks", percent(red)),
        );
        row(
            format!("{name} slopes that stand: orange at under 2 % of evaluations"),
            orange.is_some_and(|orange| orange < ORANGE),
            format!("{} of looks", percent(orange)),
        );
    }
    let head = ["asked", "", "figure"];
    grid(out, &head.map(str::to_owned), &rows);
}

//! What is reported of the simulated slopes: scores by lead and by fate.

use crate::corpus::SIMULATED_LEADS;
use crate::record::{Record, SeriesForecasts};
use crate::reduce::{median, prognostic_horizon, tenths};
use crate::sums::{
    OURS, PANEL, SEED, Scored, average, crps, error_days, grid, lead_head, mean_crps, one_if,
    percent, said, short_cell, sums,
};
use slipwatch::score::{Interval, log_score, ratio};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// A forecast is near where its median lies within this share of the time that remains.
const NEAR_SHARE: f64 = 0.2;

/// Whether a record is one of the leads that methods are compared at.
pub(crate) fn is_at_a_lead(record: &Record) -> bool {
    SIMULATED_LEADS
        .iter()
        .any(|lead| record.lead_days == Some(*lead))
}

fn is_at(lead: f64) -> impl Fn(&Record) -> bool {
    move |record| record.lead_days == Some(lead)
}

/// The section.
pub(crate) fn section(out: &mut String, scored: &Scored) {
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "\n## Simulated slopes\n\n{} that fail, {} that stand.\n\n### Those that fail, by lead\n\nMean CRPS, days (90 % interval). \
         *All*: over all forecasts at these leads. Less is better.",
        scored.failing.len(),
        scored.standing.len()
    );
    let rows = scored.methods.iter().map(|name| crps_row(scored, name));
    let rows: Vec<Vec<String>> = rows.collect();
    grid(out, &lead_head("method", &SIMULATED_LEADS, &["all"]), &rows);
    out.push_str("\n![CRPS by lead](skill/crps.svg)\n\nThe panel's mean CRPS over that of the best rival (a rival is every method but `panel` and `slider-block`):\n");
    let columns = SIMULATED_LEADS.map(Some).into_iter().chain([None]);
    let ratios: Vec<_> = columns.map(|lead| over_best(scored, lead)).collect();
    let name = |best: &Option<(&'static str, Interval)>| {
        best.map_or("–".to_owned(), |(name, _)| name.to_owned())
    };
    let names = ratios.iter().map(name);
    let figures = ratios
        .iter()
        .map(|best| short_cell(best.map(|(_, interval)| interval)));
    let named = |first: &str, cells: &mut dyn Iterator<Item = String>| -> Vec<String> {
        std::iter::once(first.to_owned()).chain(cells).collect()
    };
    let rows = [
        named("best rival", &mut names.into_iter()),
        named("panel over it", &mut figures.into_iter()),
    ];
    grid(out, &lead_head("", &SIMULATED_LEADS, &["all"]), &rows);
    others(out, scored);
    fates(out, scored);
}

fn crps_row(scored: &Scored, name: &str) -> Vec<String> {
    let mut row = vec![name.to_owned()];
    for lead in SIMULATED_LEADS {
        row.push(short_cell(mean_crps(&scored.failing, name, &is_at(lead))));
    }
    row.push(short_cell(mean_crps(&scored.failing, name, &is_at_a_lead)));
    row
}

/// The best rival at a lead, or over all, and the panel's mean CRPS over its.
pub(crate) fn over_best(scored: &Scored, lead: Option<f64>) -> Option<(&'static str, Interval)> {
    let is_meant = |record: &Record| match lead {
        Some(_) => record.lead_days == lead,
        None => is_at_a_lead(record),
    };
    let (rival, _) = scored.best_rival(&scored.failing, &is_meant)?;
    let score = |record: &Record| is_meant(record).then(|| crps(record));
    let of = |name| sums(&scored.failing, name, &score);
    Some((rival, ratio(&of(PANEL), &of(rival), SEED)?))
}

/// The share of failures within the 90 % intervals at a lead.
pub(crate) fn coverage(scored: &Scored, name: &str, lead: f64) -> Option<f64> {
    let score = |record: &Record| {
        let is_covered = record.covered.filter(|_| record.lead_days == Some(lead));
        is_covered.map(one_if)
    };
    average(&sums(&scored.failing, name, &score))
}

/// The panel's PIT by tenths at the leads, of those where it gave a forecast.
pub(crate) fn pit_counts(scored: &Scored) -> [u32; 10] {
    let records = scored.failing.iter().flat_map(|one| &one.records);
    let panel = records.filter(|record| record.method == PANEL && is_at_a_lead(record));
    tenths(panel.filter_map(|record| record.pit))
}

fn others(out: &mut String, scored: &Scored) {
    let by_lead = |out: &mut String, methods: &[&str], of: &dyn Fn(&str, f64) -> String| {
        let row = |name: &&str| -> Vec<String> {
            let cells = SIMULATED_LEADS.iter().map(|lead| of(name, *lead));
            std::iter::once((*name).to_owned()).chain(cells).collect()
        };
        let rows: Vec<Vec<String>> = methods.iter().map(row).collect();
        grid(out, &lead_head("method", &SIMULATED_LEADS, &[]), &rows);
    };
    out.push_str("\nShare of failures within the central 90 % interval:\n");
    by_lead(out, &OURS, &|name, lead| {
        percent(coverage(scored, name, lead))
    });
    out.push_str("\nLog score, nats (less is better; classes of a tenth of a decade):\n");
    by_lead(out, &scored.methods, &|name, lead| {
        let score = |record: &Record| {
            (record.lead_days == Some(lead)).then(|| log_score(&said(record), record.outcome))
        };
        let value = average(&sums(&scored.failing, name, &score));
        value.map_or("–".to_owned(), |value| format!("{value:.2}"))
    });
    out.push_str("\nMedian over slopes of (median forecast − failure) / time that remained; above 0 is late, *never*: most had no median within 400 days:\n");
    by_lead(out, &scored.methods, &|name, lead| bias(scored, name, lead));
    let _ = writeln!(
        out,
        "\nShare of forecasts whose median lies within {:.0} % of the time that remained, and the prognostic horizon: the longest lead \
         from which on every shorter one of these was so near, median over slopes, days (0: the last one was not):",
        100.0 * NEAR_SHARE
    );
    let row = |name: &&'static str| {
        let mut row = vec![(*name).to_owned()];
        row.extend(SIMULATED_LEADS.map(|lead| percent(share_near(scored, name, lead))));
        let horizons = scored.failing.iter().map(|one| horizon(one, name));
        let middle = median(horizons.collect());
        row.push(middle.map_or("–".to_owned(), |days| format!("{days:.0}")));
        row
    };
    let rows: Vec<Vec<String>> = scored.methods.iter().map(row).collect();
    grid(
        out,
        &lead_head("method", &SIMULATED_LEADS, &["horizon"]),
        &rows,
    );
    let counts = pit_counts(scored).map(|count| count.to_string());
    let _ = writeln!(
        out,
        "\nProbability integral transform of the panel, by tenths, over these leads where it gave a forecast (even if calibrated; the first: \
         failures sooner than forecast): {}.\n\n![PIT of the panel](skill/pit.svg)",
        counts.join(", ")
    );
}

fn bias(scored: &Scored, name: &str, lead: f64) -> String {
    let records = scored.failing.iter().flat_map(|one| &one.records);
    let meant = records.filter(|record| record.method == name && record.lead_days == Some(lead));
    let errors = meant.filter_map(|record| Some(error_days(record)? / record.remaining_days()?));
    match median(errors.collect()) {
        None => "–".to_owned(),
        Some(error) if error.is_infinite() => "never".to_owned(),
        Some(error) => format!("{error:+.2}"),
    }
}

fn is_near(record: &Record) -> Option<bool> {
    Some(error_days(record)?.abs() <= NEAR_SHARE * record.remaining_days()?)
}

fn share_near(scored: &Scored, name: &str, lead: f64) -> Option<f64> {
    let score = |record: &Record| {
        let meant = (record.lead_days == Some(lead)).then_some(record)?;
        is_near(meant).map(one_if)
    };
    average(&sums(&scored.failing, name, &score))
}

fn horizon(one: &SeriesForecasts, name: &str) -> f64 {
    let records = one.records.iter();
    let meant = records.filter(|record| record.method == name && is_at_a_lead(record));
    let near = meant.filter_map(|record| Some((record.lead_days?, is_near(record)?)));
    prognostic_horizon(near.collect())
}

/// Fates that stand, by name.
pub(crate) fn standing_fates<'a>(scored: &Scored<'a>) -> BTreeSet<&'a str> {
    let fates = scored.standing.iter().map(|one| one.family.as_str());
    fates.collect()
}

/// Those of one family.
pub(crate) fn of_family<'a>(
    series: &[&'a SeriesForecasts],
    family: &str,
) -> Vec<&'a SeriesForecasts> {
    let meant = series.iter().filter(|one| one.family == family);
    meant.copied().collect()
}

fn fates(out: &mut String, scored: &Scored) {
    out.push_str("\n### Those that stand, by fate\n\nMean CRPS, days; a method that says nothing or *never* has 0.\n");
    let fates = standing_fates(scored);
    let mut head = vec!["method".to_owned()];
    head.extend(fates.iter().map(|&fate| fate.to_owned()));
    let row = |name: &&'static str| {
        let mut row = vec![(*name).to_owned()];
        for fate in &fates {
            let series = of_family(&scored.standing, fate);
            row.push(short_cell(mean_crps(&series, name, &|_| true)));
        }
        row
    };
    let rows: Vec<Vec<String>> = scored.methods.iter().map(row).collect();
    grid(out, &head, &rows);
}

//! What is reported of measured and reconstructed series.

use crate::chances::{Called, share_called};
use crate::corpus::SubjectKind;
use crate::record::{Record, SeriesForecasts};
use crate::sums::{PANEL, Scored, average, crps, error_days, grid, percent, sums};
use slipwatch::score::{METHODS, Outcome};
use std::cmp::Ordering;
use std::fmt::Write as _;

/// A ratio of a CRPS to the time that remained is no less in a geometric mean: a point forecast hits by chance.
const LEAST_RATIO: f64 = 0.01;

/// How the panel did beside its rivals on one series that failed.
#[derive(Debug)]
pub(crate) struct Standing {
    pub(crate) leads: usize,
    /// Leads at which no rival's CRPS is lower.
    pub(crate) at_or_under_each: usize,
    /// The rival of the lowest mean over the leads, and at how many of them the panel is at or under it.
    pub(crate) best: &'static str,
    pub(crate) at_or_under_best: usize,
    /// Leads with a late median, or none.
    pub(crate) late: usize,
}

/// The leads of a series, longest first, days.
pub(crate) fn leads(one: &SeriesForecasts) -> Vec<f64> {
    let mut leads: Vec<f64> = one
        .records
        .iter()
        .filter_map(|record| record.lead_days)
        .collect();
    leads.sort_by(|a, b| b.partial_cmp(a).unwrap_or(Ordering::Equal));
    leads.dedup();
    leads
}

/// The record of a method at a lead.
pub(crate) fn record_at<'a>(one: &'a SeriesForecasts, name: &str, lead: f64) -> Option<&'a Record> {
    let mut records = one.records.iter();
    records.find(|record| record.method == name && record.lead_days == Some(lead))
}

/// The lowest CRPS of any rival at a lead, days.
fn best_at(one: &SeriesForecasts, scored: &Scored, lead: f64) -> Option<(&'static str, f64)> {
    let each = scored
        .rivals()
        .filter_map(|name| Some((name, crps(record_at(one, name, lead)?))));
    each.min_by(|one, other| one.1.total_cmp(&other.1))
}

impl Standing {
    pub(crate) fn of(one: &SeriesForecasts, scored: &Scored) -> Option<Self> {
        let (best, _) = scored.best_rival(&[one], &|_| true)?;
        let leads = leads(one);
        let panel = |lead: &f64| record_at(one, PANEL, *lead);
        let is_under = |lead: &f64, theirs: Option<f64>| {
            let ours = panel(lead).map(crps);
            ours.zip(theirs)
                .is_some_and(|(ours, theirs)| ours <= theirs)
        };
        let count = |is_so: &dyn Fn(&f64) -> bool| leads.iter().filter(|lead| is_so(lead)).count();
        Some(Self {
            best,
            at_or_under_each: count(&|lead| {
                is_under(lead, best_at(one, scored, *lead).map(|(_, least)| least))
            }),
            at_or_under_best: count(&|lead| is_under(lead, record_at(one, best, *lead).map(crps))),
            late: count(&|lead| {
                let error = panel(lead).and_then(error_days);
                error.is_some_and(|error| error > 0.0)
            }),
            leads: leads.len(),
        })
    }
}

/// Days are given in hours where no lead is longer than one.
pub(crate) fn unit(one: &SeriesForecasts) -> (&'static str, f64) {
    if leads(one).first().is_some_and(|lead| *lead <= 1.0) {
        ("h", 24.0)
    } else {
        ("d", 1.0)
    }
}

/// The section on what failed.
pub(crate) fn failed_section(out: &mut String, scored: &Scored) {
    out.push_str("\n## Measured and reconstructed series that failed\n\nOne series has no interval; those of one site share their failure, and count as one slope.\n");
    for one in &scored.failed {
        table_of(out, one, scored);
        match one.name.as_str() {
            "Lanzada F1, lanzada_2025_f1" => {
                out.push_str("\n![Error by lead, Lanzada F1](skill/lanzada-f1.svg)\n");
            }
            "Vaiont, 5" => out.push_str("\n![Error by lead, Vaiont 5](skill/vaiont-5.svg)\n"),
            _ => {}
        }
    }
    each_site_once(out, scored);
    out.push_str("\n### The panel beside its rivals\n\nLeads at which its CRPS is at or under that of the rival best at that lead, and of the rival best over all leads; leads with a late median:\n");
    let row = |one: &&SeriesForecasts| {
        let standing = Standing::of(one, scored)?;
        let of = |count: usize| format!("{count} of {}", standing.leads);
        Some(vec![
            one.name.clone(),
            of(standing.at_or_under_each),
            format!("{} ({})", of(standing.at_or_under_best), standing.best),
            of(standing.late),
        ])
    };
    let rows: Vec<Vec<String>> = scored.failed.iter().filter_map(row).collect();
    let head = ["series", "best at each lead", "best over all", "late"];
    grid(out, &head.map(str::to_owned), &rows);
}

/// The place of a measured series: the first word of its heading.
fn place(one: &SeriesForecasts) -> &str {
    let heading = one.family.split(',').next().unwrap_or(&one.family);
    heading.split(' ').next().unwrap_or(heading)
}

/// CRPS over the time that remained, of every method, the measured places that failed each counted once.
fn each_site_once(out: &mut String, scored: &Scored) {
    let failed = scored.failed.iter().copied();
    let measured: Vec<&SeriesForecasts> = failed
        .filter(|one| one.kind == SubjectKind::Measured)
        .collect();
    let mut places: Vec<&str> = measured.iter().map(|one| place(one)).collect();
    places.dedup();
    let mut rows: Vec<(f64, Vec<String>)> = Vec::new();
    for method in METHODS {
        let (mut cells, mut of_all, mut of_means) = (vec![method.name.to_owned()], 0.0, 0.0);
        for of in &places {
            let records = measured.iter().filter(|one| place(one) == *of);
            let records = records.flat_map(|one| &one.records);
            let ratios: Vec<f64> = records
                .filter(|record| record.method == method.name)
                .filter_map(|record| match record.outcome {
                    Outcome::Failed(left) => Some(crps(record) / left),
                    Outcome::Stood(_) => None,
                })
                .collect();
            let count = ratios.len() as f64;
            let mean = ratios.iter().sum::<f64>() / count;
            let ln = ratios
                .iter()
                .map(|ratio| ratio.max(LEAST_RATIO).ln())
                .sum::<f64>()
                / count;
            cells.push(format!("{mean:.2}, {:.2}", ln.exp()));
            of_all += ln;
            of_means += mean.ln();
        }
        let count = places.len() as f64;
        let (means, all) = ((of_means / count).exp(), (of_all / count).exp());
        cells.push(format!("**{means:.2}**, {all:.2}"));
        rows.push((means, cells));
    }
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let head = ["method"].into_iter().chain(places).chain(["all places"]);
    let head: Vec<String> = head.map(str::to_owned).collect();
    let _ = writeln!(
        out,
        "\n### Measured failures, each place once\n\nCRPS over the time that remained: its mean over leads and benchmarks, and, after the comma, its geometric \
         mean (a ratio under {LEAST_RATIO} counts as that). *All places*: the geometric mean over them.\n"
    );
    let rows: Vec<Vec<String>> = rows.into_iter().map(|(_, cells)| cells).collect();
    grid(out, &head, &rows);
}

fn table_of(out: &mut String, one: &SeriesForecasts, scored: &Scored) {
    let (unit, factor) = unit(one);
    let leads = leads(one);
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "\n### {} ({})\n\nCRPS, {unit}, by lead; in brackets median less failure, {unit} (∞: no median).",
        one.name,
        one.kind.name()
    );
    let mut head = vec!["method".to_owned()];
    head.extend(
        leads
            .iter()
            .map(|lead| format!("{:.0} {unit}", factor * lead)),
    );
    head.push("mean".to_owned());
    let cell = |name: &str, lead: &f64| {
        let Some(record) = record_at(one, name, *lead) else {
            return "–".to_owned();
        };
        let error = error_days(record).map_or(f64::INFINITY, |error| factor * error);
        let error = if error.is_finite() {
            format!("{error:+.1}")
        } else {
            "∞".to_owned()
        };
        format!("{:.2} ({error})", factor * crps(record))
    };
    let row = |name: &&'static str| {
        let mut row = vec![(*name).to_owned()];
        row.extend(leads.iter().map(|lead| cell(name, lead)));
        let mean = average(&sums(&[one], name, &|record| Some(crps(record))));
        row.push(mean.map_or("–".to_owned(), |mean| format!("{:.2}", factor * mean)));
        row
    };
    let rows: Vec<Vec<String>> = scored.methods.iter().map(row).collect();
    grid(out, &head, &rows);
}

/// The section on what stood.
pub(crate) fn stood_section(out: &mut String, scored: &Scored) {
    out.push_str("\n## Measured and reconstructed series that stood\n\nMean CRPS, days, of the panel and of the inverse-velocity line; the panel's highest chances, and evaluations at which the figures above call a level. \
                  A method that never predicts anything has a CRPS of 0 here.\n");
    let head = [
        "series",
        "kind",
        "evaluations",
        "panel",
        "line",
        "highest in 24 h",
        "highest in 30 d",
        "red",
        "orange",
    ];
    let row = |one: &&SeriesForecasts| {
        let crps_of = |name: &str| {
            let mean = average(&sums(&[one], name, &|record| Some(crps(record))));
            mean.map_or("–".to_owned(), |mean| format!("{mean:.3}"))
        };
        let panel: Vec<&Record> = one
            .records
            .iter()
            .filter(|record| record.method == PANEL)
            .collect();
        let highest = |days: f64| {
            let chances = panel.iter().map(|record| record.chance_within(days));
            format!("{:.3}", chances.fold(0.0, f64::max))
        };
        let share = |called| percent(share_called(&[one], called, &|_| true));
        vec![
            one.name.clone(),
            one.kind.name().to_owned(),
            panel.len().to_string(),
            crps_of(PANEL),
            crps_of("inverse-velocity-line"),
            highest(1.0),
            highest(30.0),
            share(Called::Red),
            share(Called::Orange),
        ]
    };
    let rows: Vec<Vec<String>> = scored.stood.iter().map(row).collect();
    grid(out, &head.map(str::to_owned), &rows);
}

/// The panel's mean CRPS over some records, and every rival of a lower one, best first; `None` where there is none.
pub(crate) fn loss(
    scored: &Scored,
    series: &[&SeriesForecasts],
    is_meant: &dyn Fn(&Record) -> bool,
) -> Option<(f64, Vec<(f64, &'static str)>)> {
    let score = |record: &Record| is_meant(record).then(|| crps(record));
    let of = |name: &str| average(&sums(series, name, &score));
    let ours = of(PANEL)?;
    let rivals = scored.rivals().filter_map(|name| Some((of(name)?, name)));
    let mut lower: Vec<(f64, &str)> = rivals.filter(|(theirs, _)| *theirs < ours).collect();
    lower.sort_by(|one, other| one.0.total_cmp(&other.0));
    (!lower.is_empty()).then_some((ours, lower))
}

//! The figures of the document.

use crate::corpus::SIMULATED_LEADS;
use crate::record::SeriesForecasts;
use crate::simulated::{is_at_a_lead, pit_counts};
use crate::sites::{leads, record_at, unit};
use crate::sums::{OURS, PANEL, Scored, average, crps, error_days, sums};
use slipwatch::plot::{
    Axis, BLUE, Bar, Bars, Figure, GREEN, GREY, Legend, Mark, PURPLE, Panel, RED,
};

/// Rivals drawn beside the program's own methods.
const RIVALS: usize = 3;
const LINE: &str = "inverse-velocity-line";
const SIZE: (f64, f64) = (760.0, 380.0);

/// Names of files, and what they hold.
pub(crate) fn all(scored: &Scored) -> Vec<(&'static str, String)> {
    let mut figures = vec![("crps.svg", crps_by_lead(scored)), ("pit.svg", pit(scored))];
    let named = |name: &str| scored.failed.iter().find(|one| one.name == name);
    for (file, name) in [
        ("lanzada-f1.svg", "Lanzada F1, lanzada_2025_f1"),
        ("vaiont-5.svg", "Vaiont, 5"),
    ] {
        if let Some(one) = named(name) {
            figures.push((file, errors(one, scored)));
        }
    }
    figures
}

fn line(points: Vec<(f64, f64)>, colour: &'static str, dash: &'static str) -> Mark {
    Mark::Line {
        points,
        colour,
        dash,
    }
}

fn one_panel(description: &str, panel: Panel) -> String {
    let figure = Figure {
        description: description.to_owned(),
        columns: 1,
        panel: SIZE,
        panels: vec![panel],
    };
    figure.svg()
}

fn crps_by_lead(scored: &Scored) -> String {
    let mut rivals: Vec<(f64, &'static str)> = scored
        .rivals()
        .filter_map(|name| {
            let score = |record: &_| is_at_a_lead(record).then(|| crps(record));
            Some((average(&sums(&scored.failing, name, &score))?, name))
        })
        .collect();
    rivals.sort_by(|one, other| one.0.total_cmp(&other.0));
    let rivals = rivals.into_iter().take(RIVALS).map(|(_, name)| name);
    let styles = [
        (BLUE, ""),
        (BLUE, "6 4"),
        (RED, ""),
        (GREEN, "8 3"),
        (PURPLE, "2 3"),
    ];
    let mark = |(name, (colour, dash)): (&'static str, (&'static str, &'static str))| {
        let points = SIMULATED_LEADS.iter().filter_map(|lead| {
            let score = |record: &crate::record::Record| {
                (record.lead_days == Some(*lead)).then(|| crps(record))
            };
            Some((*lead, average(&sums(&scored.failing, name, &score))?))
        });
        (name.to_owned(), line(points.collect(), colour, dash))
    };
    let marks = OURS.into_iter().chain(rivals).zip(styles).map(mark);
    one_panel(
        "Mean CRPS of simulated slopes by lead",
        Panel {
            title: "Simulated slopes that fail".to_owned(),
            x: Axis::log("days before the failure", 1.0, 100.0),
            y: Axis::log("mean CRPS, days", 0.2, 40.0),
            marks: marks.collect(),
            legend: Legend::TopLeft,
        },
    )
}

fn pit(scored: &Scored) -> String {
    let counts = pit_counts(scored);
    let all: f64 = counts.iter().map(|count| f64::from(*count)).sum();
    let most = counts
        .iter()
        .fold(0.0, |most: f64, count| most.max(f64::from(*count)));
    let bar = |(tenth, count): (u32, &u32)| Bar {
        name: format!(
            "{:.1} to {:.1}",
            0.1 * f64::from(tenth),
            0.1 * f64::from(tenth + 1)
        ),
        value: f64::from(*count),
        colour: BLUE,
        note: format!("{:.1} %", 100.0 * f64::from(*count) / all.max(1.0)),
    };
    let bars = Bars {
        description: "Probability integral transform of the panel".to_owned(),
        title: "Chance that the panel gave to a failure by the time it came".to_owned(),
        width: SIZE.0,
        axis: Axis::linear("forecasts", 0.0, 1.05 * most.max(0.1 * all).max(1.0)),
        mark: (0.1 * all, "even".to_owned()),
        bars: (0..).zip(&counts).map(bar).collect(),
    };
    bars.svg()
}

fn errors(one: &SeriesForecasts, scored: &Scored) -> String {
    let (unit, factor) = unit(one);
    let leads = leads(one);
    let points = |name: &str| -> Vec<(f64, f64)> {
        let each = leads.iter().filter_map(|lead| {
            let error = error_days(record_at(one, name, *lead)?)?;
            error.is_finite().then_some((factor * lead, factor * error))
        });
        each.collect()
    };
    let others = scored
        .methods
        .iter()
        .filter(|name| **name != PANEL && **name != LINE);
    let others: Vec<(f64, f64)> = others.flat_map(|name| points(name)).collect();
    let longest = factor * leads.first().copied().unwrap_or(1.0);
    let zero = vec![(0.0, 0.0), (1.1 * longest, 0.0)];
    let dots = Mark::Dots {
        points: others,
        colour: GREY,
        radius: 2.5,
    };
    one_panel(
        "Error of the median by lead",
        Panel {
            title: one.name.clone(),
            x: Axis::linear(&format!("{unit} before the failure"), 0.0, 1.05 * longest),
            y: Axis::linear(
                &format!("median less failure, {unit}"),
                -0.6 * longest,
                0.6 * longest,
            ),
            marks: vec![
                (String::new(), line(zero, GREY, "4 3")),
                ("others".to_owned(), dots),
                (LINE.to_owned(), line(points(LINE), RED, "6 4")),
                (PANEL.to_owned(), line(points(PANEL), BLUE, "")),
            ],
            legend: Legend::Above,
        },
    )
}

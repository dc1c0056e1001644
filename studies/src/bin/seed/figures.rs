//! The figures of the document, each a file's text.

use super::document::{Studies, m_text};
use super::la_clapiere::Fit;
use super::recorded::{decimal_year, vaiont_day, velocities};
use super::regimes::{Column, Instant};
use super::synthetic::{self, Study};
use super::vaiont::Benchmark;
use anyhow::{Context, Result};
use slipwatch::fit::{ConstantLoad, Exponent};
use slipwatch::inversion::{SweepReport, SweepRow};
use slipwatch::model::{Accuracy, Trajectory};
use slipwatch::plot::{Axis, BLACK, BLUE, Figure, GREEN, GREY, Legend, Mark, PURPLE, Panel, RED};
use slipwatch::reading::{Quantity, Series, days_since};
use slipwatch::regime::Regime;

const DASHED: &str = "7 4";
const DOTTED: &str = "2 4";
/// Points of a model's curve.
const POINTS: u32 = 400;

fn line(
    name: &str,
    points: Vec<(f64, f64)>,
    colour: &'static str,
    dash: &'static str,
) -> (String, Mark) {
    let mark = Mark::Line {
        points,
        colour,
        dash,
    };
    (name.to_owned(), mark)
}

fn dots(name: &str, points: Vec<(f64, f64)>, colour: &'static str, radius: f64) -> (String, Mark) {
    let mark = Mark::Dots {
        points,
        colour,
        radius,
    };
    (name.to_owned(), mark)
}

/// Every figure, by the name of its file.
pub(crate) fn all(studies: &Studies) -> Result<[(&'static str, Figure); 5]> {
    let of_vaiont = studies.vaiont_kind.name();
    let of_la_clapiere = studies.la_clapiere_kind.name();
    Ok([
        ("regimes", regimes(&super::regimes::columns()?)),
        ("vaiont", vaiont(&studies.vaiont, of_vaiont)?),
        (
            "la-clapiere",
            la_clapiere(&studies.la_clapiere, &studies.fits, of_la_clapiere)?,
        ),
        (
            "sweep",
            sweep(&studies.growing, &studies.growing_velocity, of_la_clapiere)?,
        ),
        ("synthetic", synthetic(&studies.synthetic)),
    ])
}

/// Slip, velocity and state, a row each, over the columns of m.
fn regimes(columns: &[Column]) -> Figure {
    let rows: [fn(&Instant) -> f64; 3] = [
        |instant| instant.slip,
        |instant| instant.velocity,
        |instant| instant.state,
    ];
    let mut panels = Vec::new();
    for (row, of) in rows.into_iter().enumerate() {
        for column in columns {
            panels.push(regime_panel(column, row, of));
        }
    }
    Figure {
        description: "Slip, velocity and state of the law for m above, at and below 1 and below 0"
            .to_owned(),
        columns: columns.len(),
        panel: (270.0, 230.0),
        panels,
    }
}

fn regime_panel(column: &Column, row: usize, of: fn(&Instant) -> f64) -> Panel {
    let units = column.units;
    let label = [units.slip, units.velocity, units.state][row];
    let last = |instants: &[Instant]| instants.last().map_or(0.0, |instant| instant.time);
    let end = column.curves.iter().map(|curve| last(&curve.instants));
    let end = end.fold(0.0, f64::max);
    let slow = column.curves[1].instants.iter().map(of).fold(0.0, f64::max);
    let y = match row {
        0 => Axis::linear(label, 0.0, 2.0 * slow),
        // Room below for the legend.
        1 => Axis::log(label, 0.02, 100.0),
        _ => Axis::log(label, 0.01, 10.0),
    };
    let styles = [(RED, ""), (BLUE, DASHED)];
    let curves = column.curves.iter().zip(styles);
    let marks = curves.map(|(curve, (colour, dash))| {
        let points = curve.instants.iter().map(|one| (one.time, of(one)));
        let name = if row == 1 { curve.name } else { "" };
        line(name, points.collect(), colour, dash)
    });
    Panel {
        title: if row == 0 { column.title } else { "" }.to_owned(),
        x: Axis::linear(units.time, 0.0, end),
        y,
        marks: marks.collect(),
        legend: Legend::BottomLeft,
    }
}

/// Velocity and its inverse, a row each benchmark.
fn vaiont(benchmarks: &[Benchmark], kind: &str) -> Result<Figure> {
    let mut panels = Vec::new();
    for benchmark in benchmarks {
        panels.extend(vaiont_panels(benchmark, kind)?);
    }
    Ok(Figure {
        description: format!("Velocity and inverse velocity of four Vaiont benchmarks ({kind})"),
        columns: 2,
        panel: (460.0, 250.0),
        panels,
    })
}

fn vaiont_panels(benchmark: &Benchmark, kind: &str) -> Result<[Panel; 2]> {
    let mut readings = Vec::new();
    for reading in &benchmark.series.readings {
        readings.push((vaiont_day(reading.time)?, reading.value));
    }
    let last = readings.last().context("no readings")?.1;
    let inverse = |points: &[(f64, f64)]| points.iter().map(|(t, v)| (*t, 1.0 / v)).collect();
    let slowest = readings[0].1;
    let best = modelled(&benchmark.least_squares, 80.0).velocities;
    let at_paper_m = modelled(&benchmark.at_paper_m, 80.0).velocities;
    let best_name = benchmark
        .free
        .parameters
        .m
        .best
        .map_or("no best fit".to_owned(), |m| {
            format!("best fit, m = {}", m_text(Some(m)))
        });
    let paper_name = format!("paper's m = {:.2} imposed", benchmark.paper_m);
    let id = benchmark.id;
    let name = format!("readings ({kind})");
    let mut inverse_marks = vec![
        dots(&name, inverse(&readings), BLACK, 2.2),
        line(&best_name, inverse(&best), BLUE, ""),
        line(&paper_name, inverse(&at_paper_m), RED, DASHED),
    ];
    if let Some(time) = benchmark.free.inverse_velocity.failure_time {
        let zero = vec![(vaiont_day(time)?, 0.0)];
        inverse_marks.push(dots("straight line meets zero", zero, GREEN, 5.0));
    }
    let title = |what: &str| format!("Benchmark {id}, {what}");
    Ok([
        Panel {
            title: title("velocity"),
            x: Axis::linear("days from 2 August 1963", 0.0, 76.0),
            y: Axis::linear("velocity, mm/day", 0.0, 1.35 * last),
            marks: vec![
                dots(&name, readings, BLACK, 2.2),
                line(&best_name, best, BLUE, ""),
                line(&paper_name, at_paper_m, RED, DASHED),
            ],
            legend: Legend::TopLeft,
        },
        Panel {
            title: title("inverse velocity"),
            x: Axis::linear("days from 2 August 1963", 0.0, 76.0),
            y: Axis::linear("1/velocity, day/mm", -0.05 / slowest, 1.3 / slowest),
            marks: inverse_marks,
            legend: Legend::TopRight,
        },
    ])
}

/// A fitted law as the fit solved it: (days, value) pairs.
#[derive(Default)]
struct Modelled {
    velocities: Vec<(f64, f64)>,
    displacements: Vec<(f64, f64)>,
}

fn modelled(fit: &ConstantLoad, end_days: f64) -> Modelled {
    let Some(best) = fit.best() else {
        return Modelled::default();
    };
    let solution = Trajectory::solve(&best.law, end_days, Accuracy::Fit);
    let mut modelled = Modelled::default();
    for index in 0..=POINTS {
        let day = end_days * f64::from(index) / f64::from(POINTS);
        if let Some(motion) = solution.at(day) {
            modelled.velocities.push((day, motion.velocity));
            let displacement = best.displacement_at_start + motion.displacement;
            modelled.displacements.push((day, displacement));
        }
    }
    modelled
}

/// Displacement and velocity of 1982.9 to 1987.9 with the fits of the displacement.
fn la_clapiere(series: &Series, fits: &[Fit], kind: &str) -> Result<Figure> {
    let first = series.readings.first().context("no readings")?.time;
    let start = decimal_year(first)?;
    let year = |day: f64| start + day / 365.25;
    let metres =
        |points: &[(f64, f64)]| points.iter().map(|(t, x)| (year(*t), x / 1000.0)).collect();
    let in_years = |points: &[(f64, f64)]| points.iter().map(|(t, v)| (year(*t), *v)).collect();
    let pairs = |series: &Series| -> Vec<(f64, f64)> {
        let pair = series.readings.iter();
        pair.map(|one| (days_since(first, one.time), one.value))
            .collect()
    };
    let name = format!("readings ({kind})");
    let mut slip = vec![dots(&name, metres(&pairs(series)), BLACK, 2.5)];
    let between = pairs(&velocities(series)?);
    let mut speed = vec![dots(
        &format!("between readings ({kind})"),
        in_years(&between),
        BLACK,
        2.5,
    )];
    let styles = [(BLUE, ""), (PURPLE, DOTTED), (GREY, ""), (RED, DASHED)];
    for (fit, (colour, dash)) in fits.iter().zip(styles) {
        let name = match fit.exponent {
            Exponent::Free => format!("best fit, m = {}", m_text(fit.report.parameters.m.best)),
            Exponent::Fixed(m) => format!("m = {m:.2} imposed"),
        };
        let model = modelled(&fit.least_squares, 1900.0);
        slip.push(line(&name, metres(&model.displacements), colour, dash));
        speed.push(line(&name, in_years(&model.velocities), colour, dash));
    }
    let time = || Axis::linear("year", 1982.8, 1988.15);
    Ok(Figure {
        description: format!("Displacement and velocity of benchmark 10 of La Clapière ({kind})"),
        columns: 2,
        panel: (460.0, 320.0),
        panels: vec![
            Panel {
                title: "Displacement".to_owned(),
                x: time(),
                y: Axis::linear("displacement, m", -2.0, 34.0),
                marks: slip,
                legend: Legend::TopLeft,
            },
            Panel {
                title: "Velocity".to_owned(),
                x: time(),
                y: Axis::linear("velocity, mm/day", 0.0, 110.0),
                marks: speed,
                legend: Legend::TopLeft,
            },
        ],
    })
}

/// Transition time, regime and minima against t_max; a column each quantity.
fn sweep(displacement: &SweepReport, velocity: &SweepReport, kind: &str) -> Result<Figure> {
    let mut panels = Vec::new();
    for row in 0..3 {
        for report in [displacement, velocity] {
            panels.push(match row {
                0 => transition_panel(report, kind)?,
                1 => probability_panel(report, kind)?,
                _ => minima_panel(report, kind)?,
            });
        }
    }
    Ok(Figure {
        description: format!(
            "Transition time, regime and minima against t_max, La Clapière ({kind})"
        ),
        columns: 2,
        panel: (460.0, 260.0),
        panels,
    })
}

fn t_max_axis(kind: &str) -> Axis {
    Axis::linear(&format!("t_max, year ({kind})"), 1984.7, 1988.1)
}

fn from_quantity(report: &SweepReport) -> &'static str {
    match report.quantity {
        Quantity::Displacement => "from displacement",
        Quantity::Velocity => "from velocity",
    }
}

fn transition_panel(report: &SweepReport, kind: &str) -> Result<Panel> {
    let mut marks = vec![line(
        "transition at t_max",
        vec![(1984.0, 1984.0), (1989.0, 1989.0)],
        GREY,
        DASHED,
    )];
    marks.extend(by_regime(report, |row| {
        row.transition_time.map(decimal_year).transpose()
    })?);
    Ok(Panel {
        title: format!("Transition time, {}", from_quantity(report)),
        x: t_max_axis(kind),
        y: Axis::linear("transition time, year", 1982.5, 1990.0),
        marks,
        legend: Legend::TopLeft,
    })
}

fn probability_panel(report: &SweepReport, kind: &str) -> Result<Panel> {
    let mut marks = vec![
        line("", vec![(1984.0, 0.6), (1989.0, 0.6)], GREY, DOTTED),
        line("", vec![(1984.0, 0.4), (1989.0, 0.4)], GREY, DOTTED),
    ];
    marks.extend(by_regime(report, |row| {
        Ok(row.regime.probability_unstable)
    })?);
    Ok(Panel {
        title: format!("Regime by the posterior, {}", from_quantity(report)),
        x: t_max_axis(kind),
        y: Axis::linear("P(unstable)", -0.05, 1.05),
        marks,
        legend: Legend::BottomLeft,
    })
}

/// The rows' values as dots, in the colour of the posterior's regime.
fn by_regime(
    report: &SweepReport,
    of: impl Fn(&SweepRow) -> Result<Option<f64>>,
) -> Result<Vec<(String, Mark)>> {
    let regimes = [
        (Regime::UnstableAccelerating, RED),
        (Regime::StableAccelerating, BLUE),
        (Regime::UnstableDecelerating, PURPLE),
        (Regime::StableDecelerating, GREEN),
        (Regime::Undetermined, BLACK),
    ];
    let mut marks = Vec::new();
    for (regime, colour) in regimes {
        let mut points = Vec::new();
        for row in report.rows.iter().filter(|row| row.regime.label == regime) {
            if let Some(value) = of(row)? {
                points.push((decimal_year(row.t_max)?, value));
            }
        }
        if !points.is_empty() {
            marks.push(dots(regime.label(), points, colour, 4.0));
        }
    }
    Ok(marks)
}

fn minima_panel(report: &SweepReport, kind: &str) -> Result<Panel> {
    let (mut others, mut best) = (Vec::new(), Vec::new());
    for row in &report.rows {
        let year = decimal_year(row.t_max)?;
        others.extend(
            row.alternatives
                .0
                .iter()
                .filter_map(|one| Some((year, one.m?))),
        );
        best.extend(row.m.map(|m| (year, m)));
    }
    Ok(Panel {
        title: format!("Minima of the misfit, {}", from_quantity(report)),
        x: t_max_axis(kind),
        y: Axis::linear("m", -22.0, 52.0),
        marks: vec![
            dots("local minimum", others, GREY, 2.5),
            dots("best fit", best, RED, 4.0),
        ],
        legend: Legend::TopLeft,
    })
}

/// Best m and the posterior's interval of every series, in the order of the best m.
fn synthetic(studies: &[Study]) -> Figure {
    let of_displacement = studies
        .iter()
        .filter(|study| study.quantity == Quantity::Displacement);
    Figure {
        description: "Best m and its interval for synthetic series with m = 0.98".to_owned(),
        columns: 2,
        panel: (460.0, 290.0),
        panels: of_displacement.map(synthetic_panel).collect(),
    }
}

fn synthetic_panel(study: &Study) -> Panel {
    let mut draws = study.draws.clone();
    draws.sort_by(|a, b| a.m.total_cmp(&b.m));
    let ranked = || (1_u32..).map(f64::from).zip(&draws);
    let count = draws.len() as f64;
    let mut marks: Vec<(String, Mark)> = ranked()
        .map(|(rank, draw)| {
            let name = if rank < 2.0 {
                "90 % by the posterior"
            } else {
                ""
            };
            let ends = vec![(rank, draw.interval.0), (rank, draw.interval.1)];
            line(name, ends, GREY, "")
        })
        .collect();
    let best = ranked().map(|(rank, draw)| (rank, draw.m));
    marks.push(dots("best fit", best.collect(), RED, 2.0));
    let truth = vec![(0.0, synthetic::M), (count + 1.0, synthetic::M)];
    marks.push(line("m of the series, 0.98", truth, BLUE, DASHED));
    Panel {
        title: format!(
            "Inflection after {:.0} years, slip scatters by {:.0} %",
            study.kind.inflection_years,
            100.0 * study.kind.scatter
        ),
        x: Axis::linear("series, in the order of their best m", 0.0, count + 1.0),
        y: Axis::linear("m", -0.1, 3.4),
        marks,
        legend: Legend::TopRight,
    }
}

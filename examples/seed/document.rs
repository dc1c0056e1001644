//! The document: every study's table, and the paper's statements beside ours.

use crate::claims::{Claim, Readings, claims};
use crate::la_clapiere::{self, Fit};
use crate::recorded::{decimal_year, vaiont_day, velocities};
use crate::synthetic::{self, Study};
use crate::vaiont::{self, Benchmark, COLLAPSE_DAY, Side, best_on};
use anyhow::Result;
use slipwatch::fit::{Exponent, P_PRIOR};
use slipwatch::inversion::{Estimate, FitReport, SweepReport};
use slipwatch::reading::{Series, Timestamp};
use std::fmt::Write as _;

/// Everything that is measured for the document.
#[derive(Debug)]
pub(crate) struct Studies {
    pub(crate) vaiont: Vec<Benchmark>,
    /// Displacement of 1982.9 to 1987.9.
    pub(crate) la_clapiere: Series,
    pub(crate) fits: Vec<Fit>,
    pub(crate) velocity_fit: FitReport,
    pub(crate) growing: SweepReport,
    pub(crate) growing_velocity: SweepReport,
    pub(crate) synthetic: Vec<Study>,
}

impl Studies {
    /// Runs every study, with `synthetics` series of each kind.
    pub(crate) fn run(synthetics: u64) -> Result<Self> {
        let la_clapiere = la_clapiere::readings()?;
        Ok(Self {
            vaiont: vaiont::inverted()?,
            fits: la_clapiere::fits(&la_clapiere),
            velocity_fit: la_clapiere::velocity_fit(&la_clapiere)?,
            growing: la_clapiere::growing(&la_clapiere)?,
            growing_velocity: la_clapiere::growing(&velocities(&la_clapiere)?)?,
            synthetic: synthetic::studies(synthetics)?,
            la_clapiere,
        })
    }
}

/// Three digits that count, or a dash.
pub(crate) fn number(value: Option<f64>) -> String {
    let Some(value) = value else {
        return "–".to_owned();
    };
    let size = value.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if !(0.001..1e5).contains(&size) {
        format!("{value:.0e}")
    } else if size < 0.095 {
        format!("{value:.3}")
    } else if size < 99.95 {
        format!("{value:.2}")
    } else {
        format!("{value:.0}")
    }
}

/// m; a law that has run into m = 1 is named by the side that it came from.
pub(crate) fn m_text(m: Option<f64>) -> String {
    match m {
        // The bounds of the search come back with the rounding of 1/(1-p).
        Some(m) if (m - m.round()).abs() < 1e-12 * m.abs().max(1e-3) => format!("{m:.0}"),
        Some(m) if (m - 1.0).abs() < 1e-4 => if m > 1.0 { "1⁺" } else { "1⁻" }.to_owned(),
        Some(m) if (m - 1.0).abs() < 0.05 => format!("{m:.3}"),
        m => number(m),
    }
}

/// Names, or that there are none.
pub(crate) fn list(names: &[&str]) -> String {
    if names.is_empty() {
        return "none".to_owned();
    }
    names.join(", ")
}

/// Decimal years.
pub(crate) fn years(times: &[Timestamp]) -> Result<String> {
    let texts = times.iter().map(|time| year(Some(*time)));
    Ok(texts.collect::<Result<Vec<_>>>()?.join(", "))
}

fn year(time: Option<Timestamp>) -> Result<String> {
    let year = time.map(decimal_year).transpose()?;
    Ok(year.map_or("–".to_owned(), |year| format!("{year:.2}")))
}

fn day(time: Option<Timestamp>) -> Result<String> {
    let day = time.map(vaiont_day).transpose()?;
    Ok(day.map_or("–".to_owned(), |day| format!("{day:.2}")))
}

fn share(share: Option<f64>) -> String {
    share.map_or("–".to_owned(), |share| format!("{share:.2}"))
}

fn interval(estimate: &Estimate) -> String {
    let bound = |value: Option<f64>| match value {
        None => "open".to_owned(),
        value => m_text(value),
    };
    format!("{} to {}", bound(estimate.low), bound(estimate.high))
}

/// A table in Markdown.
fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let mut out = format!("| {} |\n|{}\n", head.join(" | "), "---|".repeat(head.len()));
    for row in rows {
        let _ = writeln!(out, "| {} |", row.join(" | "));
    }
    out
}

/// The whole text.
pub(crate) fn text(studies: &Studies) -> Result<String> {
    let sections = [
        INTRODUCTION.to_owned(),
        agreement(&claims(studies)?),
        REGIMES.to_owned(),
        vaiont_section(&studies.vaiont)?,
        la_clapiere_section(&studies.fits)?,
        growing_section(&studies.growing)?,
        quantities_section(studies)?,
        synthetic_section(&studies.synthetic),
    ];
    Ok(sections.join("\n"))
}

const INTRODUCTION: &str = "\
# The paper's studies, repeated

Written by `cargo run --release --example seed`, which measures every number and draws every figure below; a second run
writes the same bytes. `tests/seed.rs` holds what is claimed.

The paper: A. Helmstetter, D. Sornette, J.-R. Grasso, J. V. Andersen, S. Gluzman, V. Pisarenko, \"Slider-block friction model
for landslides: application to Vaiont and La Clapière landslides\", J. Geophys. Res., 2004.

**The readings of both slopes are reconstructions, not measurements** ([recordings/README.md](../recordings/README.md)): made by
the law itself under loads, their constants tuned by hand towards what the paper states. Where it says †, that statement was
put in: where it comes out, the program finds what was put in; where it does not, these readings do not hold it. Neither
is evidence about m, the regime or the slopes. The regimes of the law and the synthetic series need no recording.

m, x_i, T and rms are those of the best unweighted least-squares fit, m from -20 to 29; 1⁻ and 1⁺ are laws that have run
into m = 1 from below or above. Intervals bound 90 % by the posterior, \"open\" where the bound would be the prior's.
P(unstable) is its probability of m > 1.
";

fn agreement(claims: &[Claim]) -> String {
    let rows: Vec<Vec<String>> = claims
        .iter()
        .map(|claim| {
            let readings = match claim.readings {
                Readings::Tuned => "reconstruction †",
                Readings::Reconstructed => "reconstruction",
                Readings::Synthetic => "synthetic",
            };
            let verdict = if claim.agrees {
                "agrees"
            } else {
                "**differs**"
            };
            vec![
                claim.paper.clone(),
                claim.here.clone(),
                readings.to_owned(),
                verdict.to_owned(),
            ]
        })
        .collect();
    format!(
        "## Where ours and the paper agree\n\n{}\n\
         A difference on a reconstruction says nothing against the paper either: its readings were not available.\n",
        table(&["the paper", "here", "readings", "verdict"], &rows)
    )
}

const REGIMES: &str = "\
## The regimes of the law

![Slip, velocity and state of the law](seed/regimes.svg)

The law alone, no reading. T, D and D_c are the paper's units of time, velocity and slip; m = 1 has none, and is drawn in the
contacts' initial age θᵢ and the initial velocity vᵢ. Red starts below the steady velocity where there is one to
approach, and fails where m ≥ 1; blue slows down.
";

fn vaiont_section(benchmarks: &[Benchmark]) -> Result<String> {
    let failures = failure_rows(benchmarks)?;
    Ok(format!(
        "## Vaiont: m, regime and failure\n\n\
         **Reconstruction †:** m, x_i and T of the four motions, and the load lost in the last days, were put in. rms in mm/day. The\n\
         last three columns are the best fits on either side of m = 1 and at it.\n\n{}\n\
         **Reconstruction †:** days from 2 August 1963, the collapse being day {COLLAPSE_DAY}. The line goes through the last quarter of the\n\
         record; passage is that of 1 m/day, by the panel of forecasts as the monitor uses it; the singularity that of\n\
         the fit with the paper's m. α is the exponent of dv/dt = A v^α over the whole record, 2 where 1/v is straight; its interval takes the\n\
         residuals as independent, which these are not (correlation 0.3 from day to day), and is too narrow.\n\n{}\n\
         ![Velocity and inverse velocity, Vaiont](seed/vaiont.svg)\n\n\
         Reconstruction †. Dots: readings. Blue: the best fit. Red: the paper's m imposed. Green: where the line meets zero.\n",
        m_table(benchmarks),
        table(
            &[
                "benchmark",
                "line meets zero",
                "r²",
                "1 m/day: 5 %",
                "50 %",
                "95 %",
                "chance in 400 days",
                "singularity, paper's m",
                "α",
                "α, 90 %"
            ],
            &failures
        )
    ))
}

fn m_table(benchmarks: &[Benchmark]) -> String {
    let side = |one: &Benchmark, side| {
        best_on(side, &one.free).map_or("–".to_owned(), |best| {
            format!("{} (m = {})", number(best.rms), m_text(best.m))
        })
    };
    let row = |one: &Benchmark| {
        let imposed = one.at_paper_m.best().map(|best| best.rms);
        vec![
            one.id.to_owned(),
            format!("{:.2}", one.paper_m),
            m_text(one.free.parameters.m.best),
            interval(&one.free.parameters.m),
            share(one.free.regime.probability_unstable),
            one.free.regime.label.to_string(),
            number(one.free.rms),
            number(imposed),
            side(one, Side::Above),
            number(best_on(Side::At, &one.free).and_then(|best| best.rms)),
            side(one, Side::Below),
        ]
    };
    let head = [
        "benchmark",
        "m, paper",
        "m, best",
        "m, 90 %",
        "P(unstable)",
        "regime",
        "rms",
        "rms at the paper's m",
        "m > 1",
        "m = 1",
        "m < 1",
    ];
    table(&head, &benchmarks.iter().map(row).collect::<Vec<_>>())
}

fn failure_rows(benchmarks: &[Benchmark]) -> Result<Vec<Vec<String>>> {
    let row = |one: &Benchmark| -> Result<Vec<String>> {
        let (line, passage) = (&one.free.inverse_velocity, &one.free.failure_time);
        let imposed = one.at_paper_m.best();
        Ok(vec![
            one.id.to_owned(),
            day(line.failure_time)?,
            share(line.r_squared),
            day(passage.low)?,
            day(passage.median)?,
            day(passage.high)?,
            share(passage.probability),
            number(imposed.and_then(|fit| fit.law.failure_days())),
            number(line.alpha.and_then(|alpha| alpha.best)),
            line.alpha.map_or("–".to_owned(), |alpha| interval(&alpha)),
        ])
    };
    benchmarks.iter().map(row).collect()
}

fn la_clapiere_section(fits: &[Fit]) -> Result<String> {
    let row = |fit: &Fit| -> Result<Vec<String>> {
        let (report, best) = (&fit.report, &fit.report.parameters);
        Ok(vec![
            match fit.exponent {
                Exponent::Free => "free".to_owned(),
                Exponent::Fixed(m) => format!("{m} imposed"),
            },
            m_text(best.m.best),
            number(best.x_i.best),
            number(best.t_unit_days.best),
            number(best.d.best),
            number(report.rms),
            year(report.transition_time)?,
        ])
    };
    let rows = fits.iter().map(row).collect::<Result<Vec<_>>>()?;
    Ok(format!(
        "## La Clapière, benchmark 10: displacement from 1982.9 to 1987.9\n\n\
         **Reconstruction †:** made with m = 0.98 and x_i = 39 under a river and an extra load that were chosen until m < 1 came\n\
         out. A law without load fits that load as friction, so neither m nor x_i is found again. The paper: m = 0.98, x_i = 39,\n\
         beside an imposed m = 1.5. [la-clapiere.md](la-clapiere.md) has the shares of the loads.\n\n{}\n\
         ![Displacement and velocity, La Clapière](seed/la-clapiere.svg)\n\n\
         Reconstruction †. All fits are of the displacement; the right panel shows their velocities.\n",
        table(
            &[
                "m",
                "best m",
                "x_i",
                "T, days",
                "D, mm/day",
                "rms, mm",
                "transition"
            ],
            &rows
        )
    ))
}

fn growing_section(growing: &SweepReport) -> Result<String> {
    Ok(format!(
        "## La Clapière: t_max growing from two to five years\n\n\
         **Reconstruction:** the river's season and the extra load are in these readings, and what follows of them was not tuned\n\
         row by row. The minima are the distinct ones of the misfit. The transition is the inflection of the best fit's\n\
         velocity; a law that fails or only slows down has none, nor has one with m from -1 to 0.\n\n{}\n\
         ![Transition time, regime and minima against t_max](seed/sweep.svg)\n\n\
         Reconstruction. Top: the transition time, where there is one; below the dashed line it is past. Middle: probability of\n\
         m > 1; the regime is undetermined between the dotted lines, or where no regime has .6. Bottom: m of every minimum.\n",
        sweep_table(growing, "rms, mm")?
    ))
}

fn sweep_table(growing: &SweepReport, rms: &str) -> Result<String> {
    let mut rows = Vec::new();
    for row in &growing.rows {
        let minima = row.alternatives.range_of_m().map(|(low, high)| {
            let count = row.alternatives.0.len();
            format!("{count}, {} to {}", m_text(Some(low)), m_text(Some(high)))
        });
        rows.push(vec![
            year(Some(row.t_max))?,
            row.regime.label.to_string(),
            share(row.regime.probability_unstable),
            m_text(row.m),
            number(row.x_i),
            year(row.transition_time)?,
            minima.unwrap_or("–".to_owned()),
            number(row.rms),
        ]);
    }
    let head = [
        "t_max",
        "regime by the posterior",
        "P(unstable)",
        "m",
        "x_i",
        "transition",
        "minima, their m",
        rms,
    ];
    Ok(table(&head, &rows))
}

fn quantities_section(studies: &Studies) -> Result<String> {
    let cells = |report: &FitReport| {
        vec![
            m_text(report.parameters.m.best),
            interval(&report.parameters.m),
            number(report.parameters.x_i.best),
            report.regime.label.to_string(),
            share(report.regime.probability_unstable),
        ]
    };
    let row = |name: String, velocity: &FitReport, displacement: &FitReport| {
        let mut row = vec![name];
        row.extend(cells(velocity));
        row.extend(cells(displacement));
        row
    };
    let mut rows = Vec::new();
    for one in &studies.vaiont {
        let name = format!("Vaiont {}", one.id);
        rows.push(row(name, &one.free, &one.from_displacement));
    }
    if let Some(free) = studies.fits.first() {
        let name = "La Clapière 10".to_owned();
        rows.push(row(name, &studies.velocity_fit, &free.report));
    }
    let head = [
        "benchmark",
        "m, velocity",
        "90 %",
        "x_i",
        "regime",
        "P(unstable)",
        "m, displacement",
        "90 %",
        "x_i",
        "regime",
        "P(unstable)",
    ];
    Ok(format!(
        "## Displacement against velocity\n\n\
         **Reconstruction:** Vaiont's readings are velocities, summed to displacements by the trapezoidal rule; La Clapière's are\n\
         displacements, their differences the mean velocities between, each at the middle of its interval.\n\n{}\n\
         **Reconstruction:** the velocity of La Clapière under a growing t_max.\n\n{}",
        table(&head, &rows),
        sweep_table(&studies.growing_velocity, "rms, mm/day")?
    ))
}

fn synthetic_section(studies: &[Study]) -> String {
    let row =
        |study: &Study| {
            let of_m = |share| m_text(Some(study.quantile(share, |draw| draw.m)));
            let percent = |share: f64| format!("{:.1} %", 100.0 * share);
            vec![
                study.quantity.to_string(),
                format!("{:.0}", study.kind.inflection_years),
                format!("{:.0} %", 100.0 * study.kind.scatter),
                of_m(0.05),
                of_m(0.5),
                of_m(0.95),
                percent(study.share(|draw| draw.m < 1.0)),
                percent(study.share(|draw| draw.x_i.is_some_and(|x_i| x_i > 1.0) && draw.m < 1.0)),
                percent(study.share(|draw| draw.probability_below_one > 0.5)),
                percent(study.share(|draw| draw.probability_below_one > 0.9)),
                number(Some(
                    study.quantile(0.5, |draw| draw.interval.1 - draw.interval.0),
                )),
                percent(study.share(|draw| {
                    draw.interval.0 <= synthetic::M && synthetic::M <= draw.interval.1
                })),
            ]
        };
    let head = [
        "of",
        "inflection, years",
        "scatter",
        "best m: 5 %",
        "50 %",
        "95 %",
        "m < 1",
        "and x_i > 1",
        "P(m < 1) > .5",
        "P(m < 1) > .9",
        "width of the 90 %",
        "which holds 0.98",
    ];
    let count = studies.first().map_or(0, |study| study.draws.len());
    let prior = |p: f64| 1.0 / (1.0 - p);
    let table = table(&head, &studies.iter().map(row).collect::<Vec<_>>());
    let (low, high) = (prior(P_PRIOR.0), prior(P_PRIOR.1));
    let edge = 100.0 * (1.0 - 1.0 / synthetic::M) / P_PRIOR.0;
    let (m, x_i, error) = (synthetic::M, synthetic::X_I, synthetic::READING_ERROR_MM);
    format!(
        "## Synthetic series with m = {m} and x_i = {x_i}\n\n\
         No reconstruction: {count} seeded series a row, 61 monthly displacements over five years, from 1.5 m/yr at the start; readings\n\
         err by {error:.0} mm, and each month's slip scatters about the law's. T and the noise are ours: T puts the\n\
         inflection of the velocity before the end of the record, or after it. Best m is\n\
         of the least squares; P and the interval are the posterior's, whose prior spans m from {low:.1} to {high:.1}: its width is the\n\
         median one, and the last column the share of the intervals that hold {m}.\n\
         That share is no test of the interval: {m} stands in the outermost {edge:.0} % of the prior's part below 1, and an interval\n\
         that leaves 5 % beyond either end leaves it out where the readings say little of m.\n\n{table}\n\
         ![Best m and its interval, synthetic series](seed/synthetic.svg)\n\n\
         The rows of displacement. Red: best m. Grey: 90 % by the posterior. Blue: the m that made the series.\n"
    )
}

//! The document: every study's table, and the paper's statements beside ours.

use super::as_drawn::{self, AsDrawn};
use super::claims::{Claim, Readings, claims};
use super::document_vaiont::vaiont_section;
use super::given_up::{self, LossTrial};
use super::la_clapiere::{self, Fit};
use super::recorded::{Archive, RecordKind, decimal_year, vaiont_day, velocities};
use super::river::{self, River};
use super::synthetic::{self, Study};
use super::vaiont::{self, Benchmark};
use super::valley::{self, AS_GOOD, NEARLY, Valley};
use anyhow::{Context, Result};
use slipwatch::fit::{Exponent, P_PRIOR};
use slipwatch::inversion::{Estimate, FitReport, SweepReport};
use slipwatch::reading::{Series, Timestamp};
use std::fmt::Write as _;

/// Everything that is measured for the document.
#[derive(Debug)]
pub(crate) struct Studies {
    pub(crate) vaiont: Vec<Benchmark>,
    pub(crate) vaiont_kind: RecordKind,
    /// Vaiont with an increase that exhausts itself.
    pub(crate) trials: Vec<LossTrial>,
    /// Vaiont with noise as it is drawn.
    pub(crate) as_drawn: Vec<AsDrawn>,
    /// Displacement of 1982.9 to 1987.9.
    pub(crate) la_clapiere: Series,
    pub(crate) la_clapiere_kind: RecordKind,
    pub(crate) valley: Option<Valley>,
    pub(crate) river: River,
    pub(crate) fits: Vec<Fit>,
    pub(crate) velocity_fit: FitReport,
    pub(crate) growing: SweepReport,
    pub(crate) growing_velocity: SweepReport,
    pub(crate) synthetic: Vec<Study>,
}

impl Studies {
    /// Runs every study, with `synthetics` series of each kind.
    pub(crate) fn run(synthetics: u64, archive: &Archive) -> Result<Self> {
        let la_clapiere = la_clapiere::readings(&archive.la_clapiere)?;
        let fits = la_clapiere::fits(&la_clapiere);
        let free = &fits.first().context("no fit")?.least_squares;
        let vaiont = vaiont::inverted(&archive.vaiont)?;
        Ok(Self {
            as_drawn: as_drawn::shares(&vaiont)?,
            vaiont,
            vaiont_kind: archive.vaiont_kind.clone(),
            trials: given_up::trials(&archive.vaiont)?,
            la_clapiere_kind: archive.la_clapiere_kind.clone(),
            valley: valley::valley(&la_clapiere),
            river: river::river(&archive.la_clapiere, archive.flow.as_ref(), free)?,
            fits,
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

pub(crate) fn day(time: Option<Timestamp>) -> Result<String> {
    let day = time.map(vaiont_day).transpose()?;
    Ok(day.map_or("–".to_owned(), |day| format!("{day:.2}")))
}

pub(crate) fn share(share: Option<f64>) -> String {
    share.map_or("–".to_owned(), |share| format!("{share:.2}"))
}

pub(crate) fn interval(estimate: &Estimate) -> String {
    let bound = |value: Option<f64>| match value {
        None => "open".to_owned(),
        value => m_text(value),
    };
    format!("{} to {}", bound(estimate.low), bound(estimate.high))
}

/// A table in Markdown.
pub(crate) fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let mut out = format!("| {} |\n|{}\n", head.join(" | "), "---|".repeat(head.len()));
    for row in rows {
        let _ = writeln!(out, "| {} |", row.join(" | "));
    }
    out
}

/// The whole text.
pub(crate) fn text(studies: &Studies) -> Result<String> {
    let sections = [
        introduction(studies),
        agreement(&claims(studies)?, studies),
        REGIMES.to_owned(),
        vaiont_section(studies)?,
        la_clapiere_section(studies)?,
        growing_section(studies)?,
        quantities_section(studies)?,
        synthetic_section(&studies.synthetic),
    ];
    Ok(sections.join("\n"))
}

fn introduction(studies: &Studies) -> String {
    let readings = match (&studies.vaiont_kind, &studies.la_clapiere_kind) {
        (RecordKind::Reconstruction, RecordKind::Reconstruction) => RECONSTRUCTED.to_owned(),
        (vaiont, la_clapiere) => format!(
            "The readings were given with `--recordings`. Vaiont: {}. La Clapière: {}.\n",
            vaiont.name(),
            la_clapiere.name()
        ),
    };
    format!("{INTRODUCTION}\n{readings}\n{NOTATION}")
}

const INTRODUCTION: &str = "\
# The paper's studies, repeated

Written by `cargo run --release -p studies --bin seed`, which measures every number and draws every figure below; a second run
writes the same bytes. `studies/src/bin/seed/tests.rs` holds what is claimed.

The paper: A. Helmstetter, D. Sornette, J.-R. Grasso, J. V. Andersen, S. Gluzman, V. Pisarenko, \"Slider-block friction model
for landslides: application to Vaiont and La Clapière landslides\", J. Geophys. Res., 2004.
";

const RECONSTRUCTED: &str = "\
**The readings of both slopes are reconstructions, not measurements** ([recordings/README.md](../recordings/README.md)): the
laws that the paper fitted, with residuals that leave those fits the best. Where it says †, that statement was
put in: where it comes out, the program finds what was put in; where it does not, these readings do not hold it. Neither
is evidence about m, the regime or the slopes. The regimes of the law and the synthetic series need no recording.

Whoever has the tables of the measured records can `slipwatch convert` them to `vaiont-1963.mcap` and
`la-clapiere-1982-1995.mcap` (or .csv) in a folder, and `cargo run --release -p studies --bin seed -- --recordings FOLDER` repeats every
study on them, and writes this document and its figures there.
";

const NOTATION: &str = "\
m, x_i, T and rms are those of the best unweighted least-squares fit, m from -20 to 29; 1⁻ and 1⁺ are laws that have run
into m = 1 from below or above. Intervals bound 90 % by the posterior, \"open\" where the bound would be the prior's.
P(unstable) is its probability of m > 1.
";

fn agreement(claims: &[Claim], studies: &Studies) -> String {
    let cells = |claim: &Claim| {
        let is_of_vaiont = claim.paper.starts_with("Vaiont");
        let kind = if is_of_vaiont {
            &studies.vaiont_kind
        } else {
            &studies.la_clapiere_kind
        };
        let readings = match (claim.readings, kind) {
            (Readings::Synthetic, _) => "synthetic".to_owned(),
            (Readings::Tuned, RecordKind::Reconstruction) => "reconstruction †".to_owned(),
            (_, kind) => kind.name().to_owned(),
        };
        let verdict = if claim.agrees {
            "agrees"
        } else {
            "**differs**"
        };
        vec![
            claim.paper.clone(),
            claim.here.clone(),
            readings,
            verdict.to_owned(),
        ]
    };
    let rows: Vec<Vec<String>> = claims.iter().map(cells).collect();
    let is_made = studies.vaiont_kind == RecordKind::Reconstruction;
    format!(
        "## Where ours and the paper agree\n\n{}{}",
        table(&["the paper", "here", "readings", "verdict"], &rows),
        if is_made { GIVEN_UP } else { "" }
    )
}

/// What the differences above come from.
const GIVEN_UP: &str = "
A difference on a reconstruction says nothing against the paper either: its readings were not available. The one statement on
Vaiont that was given up is that the increase of 5 and 63 exhausts itself: under the law, m = 1.35 and 1.24 bend 1/v
downwards to the end, and any bend upwards in the last days moves m away (the trials below). What is kept of it: up to the
last reading ln v gains less than 1/(69.5 - t) does.
";

const REGIMES: &str = "\
## The regimes of the law

![Slip, velocity and state of the law](seed/regimes.svg)

The law alone, no reading. T, D and D_c are the paper's units of time, velocity and slip; m = 1 has none, and is drawn in the
contacts' initial age θᵢ and the initial velocity vᵢ. Red starts below the steady velocity where there is one to
approach, and fails where m ≥ 1; blue slows down.
";

fn la_clapiere_section(studies: &Studies) -> Result<String> {
    let fits = &studies.fits;
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
    let fitted = table(
        &[
            "m",
            "best m",
            "x_i",
            "T, days",
            "D, mm/day",
            "rms, mm",
            "transition",
        ],
        &rows,
    );
    let kind = &studies.la_clapiere_kind;
    Ok(format!(
        "## La Clapière, benchmark 10: displacement from 1982.9 to 1987.9\n\n\
         {}\n\n{fitted}\n{}\n\
         ![Displacement and velocity, La Clapière](seed/la-clapiere.svg)\n\n\
         {} All fits are of the displacement; the right panel shows their velocities.\n",
        kind.note(LA_CLAPIERE_MADE),
        valley_text(studies),
        kind.note("Reconstruction †.")
    ))
}

const LA_CLAPIERE_MADE: &str = "\
**Reconstruction †:** the law with m = 0.98 and x_i = 39, times what a river does to the velocity until it loses its hold, and
a slow change by a few percent that was searched for until this fit and those of the next section came out. The paper:
m = 0.98, x_i = 39, poorly constrained, beside an imposed m = 1.5. [la-clapiere.md](la-clapiere.md) has the shares of the parts.";

fn valley_text(studies: &Studies) -> String {
    let Some(valley) = &studies.valley else {
        return String::new();
    };
    let row = |place: &valley::ValleyPlace| {
        vec![
            format!("{}", place.m),
            number(place.x_i),
            number(place.t_days),
            number(place.d),
            number(Some(place.rms)),
            format!("{:+.1} %", 100.0 * (place.rms / valley.least_rms - 1.0)),
        ]
    };
    let rows: Vec<Vec<String>> = valley.places.iter().map(row).collect();
    let free = studies.fits.first();
    let ends = |ends: Option<(f64, f64)>, text: fn(Option<f64>) -> String| {
        ends.map_or("none".to_owned(), |(low, high)| {
            format!("from {} to {}", text(Some(low)), text(Some(high)))
        })
    };
    let head = [
        "m imposed",
        "x_i",
        "T, days",
        "D, mm/day",
        "rms, mm",
        "above the least",
    ];
    format!(
        "{} How poorly m and x_i are constrained, by the best fit at each m below 1. Of those tried, m {}\n\
         and x_i {} have an rms within {:.0} % of the least; m {} and x_i {}\n\
         within {:.0} %. By the posterior 90 % lie in m {} and x_i {}.\n\n{}",
        studies.la_clapiere_kind.note("**Reconstruction †:**"),
        ends(valley.m(AS_GOOD), m_text),
        ends(valley.x_i(AS_GOOD), number),
        100.0 * AS_GOOD,
        ends(valley.m(NEARLY), m_text),
        ends(valley.x_i(NEARLY), number),
        100.0 * NEARLY,
        free.map_or("–".to_owned(), |fit| interval(&fit.report.parameters.m)),
        free.map_or("–".to_owned(), |fit| interval(&fit.report.parameters.x_i)),
        table(&head, &rows)
    )
}

fn growing_section(studies: &Studies) -> Result<String> {
    let kind = &studies.la_clapiere_kind;
    Ok(format!(
        "## La Clapière: t_max growing from two to five years\n\n\
         {}\n\
         The minima are the distinct ones of the misfit. The transition is the inflection of the best fit's\n\
         velocity; a law that fails or only slows down has none, nor has one with m from -1 to 0.\n\n{}\n\
         ![Transition time, regime and minima against t_max](seed/sweep.svg)\n\n\
         {} Top: the transition time, where there is one; below the dashed line it is past. Middle: probability of\n\
         m > 1; the regime is undetermined between the dotted lines, or where no regime has .6. Bottom: m of every minimum.\n",
        kind.note(GROWING_MADE),
        sweep_table(&studies.growing, "rms, mm")?,
        kind.note("Reconstruction.")
    ))
}

const GROWING_MADE: &str = "\
**Reconstruction †:** the seasons of 1983 to 1985 and the slow change of the velocity were chosen so that 0 < m < 1 from the
third refit on, and so that the transition recedes. What each refit's m and transition are was not.";

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
         {} Vaiont's readings are velocities, summed to displacements by the trapezoidal rule; La Clapière's are\n\
         displacements, their differences the mean velocities between, each at the middle of its interval.\n\n{}\n\
         {} The velocity of La Clapière under a growing t_max.\n\n{}",
        studies.vaiont_kind.note("**Reconstruction:**"),
        table(&head, &rows),
        studies.la_clapiere_kind.note("**Reconstruction:**"),
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

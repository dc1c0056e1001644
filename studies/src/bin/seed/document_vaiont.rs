//! The section of the document on Vaiont.

use super::as_drawn::{self, AsDrawn};
use super::claims::SAME_M;
use super::document::{Studies, day, interval, m_text, number, share, table};
use super::given_up::{self, FROM_DAY};
use super::simplex;
use super::vaiont::{Benchmark, COLLAPSE_DAY, Side, best_on};
use anyhow::Result;

const VAIONT_MADE: &str = "\
**Reconstruction †:** the laws with the paper's m, and noise of 4 % of the velocity without what the law could fit of it. What a
least-squares fit leaves has no part along any change of the law's unknowns, or it would not be the best; of the noise, that
part was taken away, to the second order in the unknowns.";

pub(crate) fn vaiont_section(studies: &Studies) -> Result<String> {
    let benchmarks = &studies.vaiont;
    let kind = &studies.vaiont_kind;
    let failures = failure_rows(benchmarks)?;
    Ok(format!(
        "## Vaiont: m, regime and failure\n\n\
         {} rms in mm/day. The simplexes over (m, x_i, T) are the paper's own kind of fit, from {} starts, where they begin and end being chosen here.\n\
         The last three columns are the best fits on either side of m = 1 and at it.\n\n{}\n\
         {}\n{}\n\
         {} Days from 2 August 1963, the collapse being day {COLLAPSE_DAY}. The line goes through the last quarter of the\n\
         record; passage is that of 1 m/day, by the panel of forecasts as the monitor uses it; the singularity that of\n\
         the fit with the paper's m. α is the exponent of dv/dt = A v^α over the whole record, 2 where 1/v is straight; its interval takes the\n\
         residuals as independent.\n\n{}\n\
         ![Velocity and inverse velocity, Vaiont](seed/vaiont.svg)\n\n\
         {} Dots: readings. Blue: the best fit. Red: the paper's m imposed. Green: where the line meets zero.\n",
        kind.note(VAIONT_MADE),
        simplex::STARTS,
        m_table(benchmarks),
        as_drawn_text(studies),
        trials_text(studies),
        kind.note("**Reconstruction †:**"),
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
        ),
        kind.note("Reconstruction †.")
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
        let simplex = one.simplex.map(|found| (found.m, found.rms));
        vec![
            one.id.to_owned(),
            format!("{:.2}", one.paper_m),
            m_text(one.free.parameters.m.best),
            simplex.map_or("–".to_owned(), |(m, rms)| {
                format!("{} ({})", m_text(Some(m)), number(Some(rms)))
            }),
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
        "by simplexes (rms)",
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
        let (line, passage) = (&one.free.inverse_velocity, &one.free.critical_velocity_time);
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

/// How small noise must be, as it is drawn, for the best m to be the law's.
fn as_drawn_text(studies: &Studies) -> String {
    let row = |one: &AsDrawn| {
        let mut row = vec![format!("{} %", 100.0 * one.noise)];
        for (found, rms) in one.found.iter().zip(&one.rms) {
            row.push(format!("{:.0} % ({})", 100.0 * found, number(Some(*rms))));
        }
        row
    };
    let rows: Vec<Vec<String>> = studies.as_drawn.iter().map(row).collect();
    let ids = studies.vaiont.iter().map(|one| one.id);
    let head: Vec<&str> = std::iter::once("noise of the velocity")
        .chain(ids)
        .collect();
    format!(
        "{} Noise as it is drawn hides m: the best fit's own velocities under it, {} series each; how many have a best m within\n\
         {SAME_M} of the law's, and the rms of the noise in mm/day.\n\n{}",
        studies.vaiont_kind.note("**Reconstruction †:**"),
        as_drawn::SERIES,
        table(&head, &rows)
    )
}

/// What an increase that exhausts itself does to m.
fn trials_text(studies: &Studies) -> String {
    let row = |trial: &given_up::LossTrial| {
        let mut row = vec![format!("{}", trial.loss_per_day)];
        for (m, gain) in &trial.of {
            row.push(m_text(*m));
            row.push(number(*gain));
        }
        row
    };
    let rows: Vec<Vec<String>> = studies.trials.iter().map(row).collect();
    let head = [
        "ln v lost per day",
        "m (5)",
        "gain (5)",
        "m (63)",
        "gain (63)",
        "m (50)",
        "gain (50)",
    ];
    format!(
        "{} What an exhausted increase would do to m: the same readings with ln v lowered from day {FROM_DAY:.0} on. Gain is that of\n\
         ln v over the last four days, over that of 1/(69.5 - t).\n\n{}",
        studies.vaiont_kind.note("**Reconstruction †:**"),
        table(&head, &rows)
    )
}

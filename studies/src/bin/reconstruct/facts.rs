//! What the paper states of the two records, asked of a recording; an error names what does not hold.
//!
//! The ranges are wider than the paper's figures by the noise that the reconstruction adds.

use super::la_clapiere::ReconstructedMotion;
use anyhow::{Context, Result, ensure};
use jiff::Timestamp;
use slipwatch::reading::{Recording, days_since};
use std::ops::Range;

/// Paper: the straight line through 1/v meets zero near this day, for every benchmark.
const CRITICAL_DAY: f64 = 69.5;
/// Readings that the line is drawn through: the last four weeks, and the last three.
const LINE_READINGS: [usize; 2] = [28, 21];

/// Paper: what benchmarks 5, 50, 63 and 67 did before 9 October 1963.
///
/// # Errors
/// Names the first statement that the readings contradict.
pub(crate) fn vaiont(recording: &Recording, day_zero: Timestamp) -> Result<()> {
    let mut all = Vec::new();
    for id in ["5", "50", "63", "67"] {
        let points = points(recording, id, day_zero)?;
        ensure!(
            points.len() == 68,
            "{id}: {} readings, not 68",
            points.len()
        );
        vaiont_benchmark(id, &points)?;
        all.push(points);
    }
    let velocities = || all.iter().flatten().map(|point| point.1);
    holds(
        "slowest",
        velocities().fold(f64::INFINITY, f64::min),
        4.5..6.0,
    )?;
    holds("fastest", velocities().fold(0.0, f64::max), 200.0..300.0)?;
    let [five, fifty, sixty_three, sixty_seven] = &all[..] else {
        anyhow::bail!("not four benchmarks");
    };
    for (a, b) in five.iter().zip(sixty_three) {
        holds("63 over 5", b.1 / a.1, 0.7..1.3)?;
    }
    let rise = |points: &[(f64, f64)]| (points[67].1 - points[0].1, points[67].1 / points[0].1);
    for (name, other) in [("5", five), ("63", sixty_three)] {
        let ratio = rise(fifty).0 / rise(other).0;
        holds(&format!("rise of 50 over that of {name}"), ratio, 0.2..0.65)?;
    }
    holds("relative rise of 50", rise(fifty).1, 15.0..40.0)?;
    // Bending upwards in 1/v: the earlier the readings, the sooner their line meets zero.
    let early = zero_of_line(&sixty_seven[..47]);
    let late = zero_of_line(&sixty_seven[54..]);
    holds(
        "67's late line behind its early one, days",
        late - early,
        3.0..20.0,
    )?;
    let growths = all.iter().map(|points| growth(points));
    holds(
        "growth of the last days, mean",
        growths.sum::<f64>() / 4.0,
        0.5..0.95,
    )
}

fn vaiont_benchmark(id: &str, points: &[(f64, f64)]) -> Result<()> {
    for count in LINE_READINGS {
        let zero = zero_of_line(&points[points.len() - count..]);
        let near = CRITICAL_DAY - 1.0..CRITICAL_DAY + 1.0;
        holds(
            &format!("{id}: 1/v of {count} days is zero on day"),
            zero,
            near,
        )?;
    }
    let displacement_m = points
        .windows(2)
        .map(|pair| f64::midpoint(pair[0].1, pair[1].1) * (pair[1].0 - pair[0].0))
        .sum::<f64>()
        / 1000.0;
    holds(&format!("{id}: displacement, m"), displacement_m, 0.8..4.0)?;
    // Exhausted: less than 1/(t_c - t) gains over the last readings.
    holds(
        &format!("{id}: growth of the last days"),
        growth(points),
        0.3..1.0,
    )
}

/// How much ln(v) gained over the last four days, over what `1/(t_c - t)` gains.
fn growth(points: &[(f64, f64)]) -> f64 {
    let (from, to) = (points[points.len() - 5], points[points.len() - 1]);
    (to.1 / from.1).ln() / ((CRITICAL_DAY - from.0) / (CRITICAL_DAY - to.0)).ln()
}

/// Where the least-squares line through 1/v meets zero.
fn zero_of_line(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean_t = points.iter().map(|point| point.0).sum::<f64>() / count;
    let mean_w = points.iter().map(|point| 1.0 / point.1).sum::<f64>() / count;
    let covariance: f64 = points
        .iter()
        .map(|(t, v)| (t - mean_t) * (1.0 / v - mean_w))
        .sum();
    let variance: f64 = points.iter().map(|(t, _)| (t - mean_t).powi(2)).sum();
    mean_t - mean_w * variance / covariance
}

/// Paper: what benchmark 10 did, as far as monthly readings show it.
///
/// # Errors
/// Names the first statement that the readings contradict.
pub(crate) fn la_clapiere(recording: &Recording) -> Result<()> {
    let epoch: Timestamp = "1982-01-01T00:00:00Z".parse()?;
    let points: Vec<_> = points(recording, "10", epoch)?
        .into_iter()
        .map(|(days, mm)| (1982.0 + days / 365.25, mm))
        .collect();
    let rate = |years: Range<f64>| -> Result<f64> {
        let inside = || points.iter().filter(|point| years.contains(&point.0));
        let (first, last) = (inside().next(), inside().next_back());
        let (first, last) = first.zip(last).context("no readings in these years")?;
        Ok((last.1 - first.1) / (last.0 - first.0) / 1000.0)
    };
    holds(
        "rate of the first year, m/yr",
        rate(1982.8..1983.95)?,
        1.3..2.4,
    )?;
    let before = rate(1982.8..1986.0)?;
    let peak = points
        .windows(2)
        .map(|pair| (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0) / 365.25)
        .fold(0.0, f64::max);
    holds("fastest month, mm/day", peak, 55.0..95.0)?;
    let afterwards = rate(1988.0..1991.0)? * 1000.0 / 365.25;
    holds(
        "1987's 90 mm/day over 1988-1990",
        90.0 / afterwards,
        5.0..7.0,
    )?;
    holds(
        "1994-1995 over 1982-1985",
        rate(1994.0..1996.0)? / before,
        1.0..1.5,
    )
}

/// Paper: the velocities of benchmark 10 from day to day.
///
/// # Errors
/// Names the first statement that the motion contradicts.
pub(crate) fn la_clapiere_motion(motions: &[ReconstructedMotion]) -> Result<()> {
    let fastest = |years: Range<f64>| {
        let inside = motions.iter().filter(|motion| years.contains(&motion.year));
        inside.map(|motion| motion.velocity).fold(0.0, f64::max)
    };
    holds("fastest of 1982-1985", fastest(1982.0..1986.0), 15.0..30.0)?;
    holds(
        "fastest of summer 1987",
        fastest(1987.4..1987.7),
        77.0..83.0,
    )?;
    holds(
        "fastest of October 1987",
        fastest(1987.75..1987.84),
        87.0..93.0,
    )?;
    // No season returns: from 1989 on the velocity falls from every day to the next.
    let later = motions.windows(2).filter(|pair| pair[0].year >= 1989.0);
    for pair in later {
        let change = pair[1].velocity - pair[0].velocity;
        ensure!(change < 0.0, "{}: the velocity rises again", pair[0].time);
    }
    Ok(())
}

fn points(recording: &Recording, id: &str, epoch: Timestamp) -> Result<Vec<(f64, f64)>> {
    let series = recording
        .series
        .iter()
        .find(|series| series.benchmark.as_str() == id)
        .with_context(|| format!("no benchmark {id}"))?;
    let point =
        |reading: &slipwatch::reading::Reading| (days_since(epoch, reading.time), reading.value);
    Ok(series.readings.iter().map(point).collect())
}

fn holds(what: &str, value: f64, within: Range<f64>) -> Result<()> {
    ensure!(
        within.contains(&value),
        "{what}: {value:.3}, not within {within:?}"
    );
    Ok(())
}

//! `simulate`: the law itself, at the times asked for.

use super::exit::UsageError;
use super::load::read_load;
use crate::model::{Accuracy, Law, Load, LoadedLaw, Motion, Trajectory};
use crate::regime::Regime;
use schemars::JsonSchema;
use serde::Serialize;
use std::io::{self, Write};
use std::path::PathBuf;

/// Solve the law: CSV of t (days), x (`theta/theta_i` at m = 1), velocity, displacement
///
/// From the singularity on there is no motion: the values are empty (CSV) or null (JSON).
#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true)]
pub(super) struct Args {
    /// m = B/A; 0 makes no law, and 1 needs --s-theta
    #[arg(long, value_name = "M", required_unless_present = "s_theta")]
    m: Option<f64>,
    /// The initial state
    #[arg(
        long,
        value_name = "X",
        required_unless_present = "s_theta",
        conflicts_with = "s_theta"
    )]
    x_i: Option<f64>,
    /// m = 1: the control parameter S `theta_i`, which takes the place of `x_i`
    #[arg(long, value_name = "S")]
    s_theta: Option<f64>,
    /// The time unit T in days; at m = 1 the contacts' initial age `theta_i`
    #[arg(long, value_name = "T", default_value_t = 1.0)]
    t_unit_days: f64,
    /// The velocity scale D; at m = 1 the initial velocity
    #[arg(long, value_name = "D", default_value_t = 1.0)]
    scale: f64,
    /// Days since the start
    #[arg(
        long,
        value_name = "A,B,...",
        value_delimiter = ',',
        required = true,
        allow_hyphen_values = true
    )]
    times: Vec<f64>,
    /// The load on the slope: CSV of days,log_load, the change of (tau/sigma')/A, linear between its lines;
    /// two lines of one day are a step. The law's initial velocity is that without load
    #[arg(long, value_name = "FILE.csv")]
    load: Option<PathBuf>,
    /// How results look on stdout; text is CSV too
    #[arg(long, value_enum, default_value_t, value_name = "FORMAT")]
    format: TableFormat,
}

#[derive(Debug, Clone, Copy, Default, clap::ValueEnum)]
enum TableFormat {
    #[default]
    Text,
    Json,
    Csv,
}

#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct MotionRow {
    /// Days.
    t: f64,
    /// The state; at m = 1 `theta/theta_i`. `None` from the singularity on, as the others.
    x: Option<f64>,
    /// In units of the scale, a day.
    velocity: Option<f64>,
    /// In units of the scale.
    displacement: Option<f64>,
}

#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct Simulation {
    /// Of the law.
    regime: Regime,
    /// From the beginning to the singularity; `None` without one.
    failure_days: Option<f64>,
    /// From the beginning to the inflection of the velocity; `None` without one.
    transition_days: Option<f64>,
    /// The motion at each time that was asked for.
    rows: Vec<MotionRow>,
}

/// Solves the law and prints it.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let law = law(args)?;
    let load = args.load.as_deref().map(read_load).transpose()?;
    let simulation = simulate(&law, load.as_ref(), &args.times)?;
    let mut stdout = io::BufWriter::new(io::stdout().lock());
    match args.format {
        TableFormat::Json => writeln!(stdout, "{}", serde_json::to_string(&simulation)?)?,
        TableFormat::Text | TableFormat::Csv => write_csv(&simulation.rows, &mut stdout)?,
    }
    stdout.flush()?;
    Ok(())
}

fn law(args: &Args) -> anyhow::Result<Law> {
    Ok(match (args.s_theta, args.m, args.x_i) {
        (Some(_), Some(m), _) if (m - 1.0).abs() >= f64::EPSILON => {
            let problem = format!("--m: found {m}, expected 1 or none beside --s-theta");
            return Err(UsageError(problem).into());
        }
        (Some(s_theta), ..) => Law::at_unit_m(s_theta, args.t_unit_days, args.scale)?,
        (None, Some(m), _) if (m - 1.0).abs() < f64::EPSILON => {
            let problem = "--m: found 1, expected another number, or --s-theta in place of --x-i";
            return Err(UsageError(problem.to_owned()).into());
        }
        (None, Some(m), Some(x_i)) => Law::from_paper(m, x_i, args.t_unit_days, args.scale)?,
        (None, ..) => {
            let problem = "expected --m and --x-i, or --s-theta";
            return Err(UsageError(problem.to_owned()).into());
        }
    })
}

/// The motion at each time asked for, and what the law says of itself.
struct SimulatedLaw {
    motions: Vec<Option<Motion>>,
    failure_days: Option<f64>,
    transition_days: Option<f64>,
}

/// Under a constant load.
fn unloaded(law: &Law, times: &[f64]) -> SimulatedLaw {
    let end = times.iter().copied().fold(0.0, f64::max);
    let trajectory = Trajectory::solve(law, end, Accuracy::Full);
    SimulatedLaw {
        motions: times.iter().map(|t| trajectory.at(*t)).collect(),
        failure_days: trajectory.failure_days().filter(|days| days.is_finite()),
        transition_days: law.transition_days(),
    }
}

/// Under a load: a failure is looked for up to the last of the times, and there is no one transition.
fn loaded(law: &Law, load: &Load, times: &[f64]) -> anyhow::Result<SimulatedLaw> {
    let loaded = LoadedLaw::new(law, load, Accuracy::Full)?;
    let mut order: Vec<usize> = (0..times.len()).collect();
    order.sort_by(|a, b| times[*a].total_cmp(&times[*b]));
    let in_order: Vec<f64> = order.iter().map(|at| times[*at]).collect();
    let mut found = vec![None; times.len()];
    loaded.motions(&in_order, &mut found);
    let mut motions = found.clone();
    for (at, motion) in order.iter().zip(found) {
        motions[*at] = motion;
    }
    Ok(SimulatedLaw {
        motions,
        failure_days: loaded.failure_days(in_order.last().copied().unwrap_or(0.0)),
        transition_days: None,
    })
}

fn simulate(law: &Law, load: Option<&Load>, times: &[f64]) -> anyhow::Result<Simulation> {
    if let Some(t) = times.iter().find(|t| !(t.is_finite() && **t >= 0.0)) {
        let problem = format!("--times: found {t}, expected finite numbers of days, 0 or later");
        return Err(UsageError(problem).into());
    }
    let solution = match load {
        None => unloaded(law, times),
        Some(load) => loaded(law, load, times)?,
    };
    let failure_days = solution.failure_days;
    let rows = times.iter().zip(&solution.motions).map(|(&t, motion)| {
        if motion.is_none() && failure_days.is_none_or(|failure| t < failure) {
            anyhow::bail!("the law could not be solved as far as day {t:?}");
        }
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        Ok(MotionRow {
            t,
            x: motion
                .and_then(|motion| law.state(motion.y))
                .and_then(finite),
            velocity: motion.and_then(|motion| finite(motion.velocity)),
            displacement: motion.and_then(|motion| finite(motion.displacement)),
        })
    });
    Ok(Simulation {
        regime: law.regime(),
        failure_days,
        transition_days: solution.transition_days,
        rows: rows.collect::<anyhow::Result<_>>()?,
    })
}

fn write_csv(rows: &[MotionRow], out: &mut impl Write) -> io::Result<()> {
    // Debug, unlike Display, writes large and small numbers with an exponent.
    let cell = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:?}"));
    writeln!(out, "t,x,velocity,displacement")?;
    for row in rows {
        let (x, velocity) = (cell(row.x), cell(row.velocity));
        writeln!(out, "{:?},{x},{velocity},{}", row.t, cell(row.displacement))?;
    }
    Ok(())
}

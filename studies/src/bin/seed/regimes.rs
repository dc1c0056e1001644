//! Slip, velocity and state of every regime of the law, in its own units.

use anyhow::{Context, Result};
use slipwatch::model::{Accuracy, Law, Trajectory};

/// Two motions at one m, on either side of the steady state.
#[derive(Debug)]
pub(crate) struct Column {
    pub(crate) title: &'static str,
    /// What time, velocity, slip and state are measured in.
    pub(crate) units: Units,
    pub(crate) curves: Vec<Curve>,
}

/// Labels of the axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Units {
    pub(crate) time: &'static str,
    pub(crate) velocity: &'static str,
    pub(crate) slip: &'static str,
    pub(crate) state: &'static str,
}

/// One solution at increasing times.
#[derive(Debug)]
pub(crate) struct Curve {
    pub(crate) name: &'static str,
    pub(crate) instants: Vec<Instant>,
}

/// One instant of a solution.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant {
    pub(crate) time: f64,
    pub(crate) velocity: f64,
    pub(crate) slip: f64,
    pub(crate) state: f64,
}

/// T, D and `D_c`: m other than 1.
const SCALED: Units = Units {
    time: "time / T",
    velocity: "velocity / D",
    slip: "slip / D_c",
    state: "state x",
};
/// The contacts' initial age and the initial velocity: m = 1.
const AGED: Units = Units {
    time: "time / θᵢ",
    velocity: "velocity / vᵢ",
    slip: "slip / (vᵢ θᵢ)",
    state: "state θ/θᵢ",
};
/// Points of a curve.
const POINTS: u32 = 240;

/// The columns of the paper's table of regimes.
pub(crate) fn columns() -> Result<Vec<Column>> {
    let scaled = |m: f64, x_i: f64| Law::from_paper(m, x_i, 1.0, 1.0);
    let aged = |s_theta_i: f64| Law::at_unit_m(s_theta_i, 1.0, 1.0);
    Ok(vec![
        Column {
            title: "m = 1.5",
            units: SCALED,
            curves: vec![
                curve("xᵢ = 0.6: fails", &scaled(1.5, 0.6)?, 1.5)?,
                curve("xᵢ = 1.6: slows on", &scaled(1.5, 1.6)?, 1.5)?,
            ],
        },
        Column {
            title: "m = 1",
            units: AGED,
            curves: vec![
                curve("S θᵢ = 2: fails", &aged(2.0)?, 2.0)?,
                curve("S θᵢ = 0.5: slows on", &aged(0.5)?, 2.0)?,
            ],
        },
        Column {
            title: "m = 0.5",
            units: SCALED,
            curves: vec![
                curve("xᵢ = 6: rises to D", &scaled(0.5, 6.0)?, 12.0)?,
                curve("xᵢ = 0.2: slows to D", &scaled(0.5, 0.2)?, 12.0)?,
            ],
        },
        Column {
            title: "m = −0.5",
            units: SCALED,
            curves: vec![
                curve("xᵢ = 0.2: rises to D", &scaled(-0.5, 0.2)?, 3.0)?,
                curve("xᵢ = 3: slows to D", &scaled(-0.5, 3.0)?, 3.0)?,
            ],
        },
    ])
}

/// Up to `end`, or to the failure before it with ever shorter steps.
fn curve(name: &'static str, law: &Law, end: f64) -> Result<Curve> {
    let solution = Trajectory::solve(law, end, Accuracy::Full);
    let failure = solution.failure_days().filter(|failure| *failure < end);
    let mut instants = Vec::new();
    for index in 0..=POINTS {
        let share = f64::from(index) / f64::from(POINTS);
        let (time, motion) = match failure {
            Some(failure) => {
                let remaining = failure * 1e-4_f64.powf(share);
                (failure - remaining, solution.before_failure(remaining))
            }
            None => (end * share, solution.at(end * share)),
        };
        let motion = motion.with_context(|| format!("{name} at {time}"))?;
        instants.push(Instant {
            time,
            velocity: motion.velocity,
            slip: motion.displacement,
            state: law.state(motion.y).context("no state")?,
        });
    }
    Ok(Curve { name, instants })
}

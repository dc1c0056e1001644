//! The log-periodic power law singularity of the displacement (Sornette and Sammis 1995; for landslides Lei and
//! Sornette 2025, "Log-periodic power law singularities in landslide dynamics: statistical evidence from 52 crises",
//! Geophys. Res. Lett. 52, e2025GL116379).
//!
//! Displacement A + B s^m + C1 s^m cos(omega ln s) + C2 s^m sin(omega ln s), with s the time left to the
//! singularity. A, B, C1 and C2 are solved for each (tc, m, omega), which leaves three unknowns (Filimonov
//! and Sornette 2013, "A stable and robust calibration scheme of the log-periodic power law model", Physica A
//! 392, 3698-3707). The fit is repeated over windows that end now, and the share of them whose fit passes the
//! filters is the confidence that there is a singularity at all, as for markets (Sornette, Demos, Zhang,
//! Cauwels, Filimonov and Zhang 2015, J. Invest. Strategies 4, 77-95): each window gives its time of failure
//! an equal probability, and one that is filtered out gives it to "never".
//!
//! Filters, as there: m from 0.01 to 1.2, omega from 2 to 25, B s^m rising to the singularity, a damping
//! m |B| / (omega |C|) of 0.8 or more, residuals of a twentieth at most (of the window's displacement, here). Their
//! least of 2.5 oscillations within the window is left out in favour of the method: on simulated slopes that fail it
//! filters out most fits, good ones too. Ours: the windows, where the search begins, and that the singularity lies
//! no farther ahead than a window is long.

use super::simplex::descend;
use super::{displacements, rates};
use crate::forecast::Passage;
use crate::score::Known;
use nalgebra::{Matrix4, Vector4};

/// Points in a window, at least twice the seven unknowns.
const FEWEST_POINTS: usize = 14;
/// The newest shares of the record that are fitted.
const WINDOWS: [f64; 5] = [1.0, 0.8, 0.64, 0.51, 0.41];
/// Where the search begins: time left over the window's length, m, omega.
const LEFT: [f64; 4] = [0.02, 0.06, 0.2, 0.6];
const EXPONENTS: [f64; 2] = [0.25, 0.65];
const OMEGAS: [f64; 4] = [6.5, 8.5, 10.5, 12.5];
/// Descents in a window, from the best beginnings, and the evaluations of each.
const DESCENTS: usize = 3;
const MOST_EVALUATIONS: usize = 90;
/// Steps of the first simplex: ln of the time left, m, omega.
const STEPS: [f64; 3] = [0.4, 0.15, 0.8];
/// What the search may look at: a fit that is best at the side of a filter's range is to be filtered out.
const SEARCHED_LEFT: (f64, f64) = (1e-4, 1.5);
const SEARCHED_M: (f64, f64) = (-0.5, 1.5);
const SEARCHED_OMEGA: (f64, f64) = (1.0, 50.0);
const FILTER_LEFT: (f64, f64) = (1e-4, 1.0);
const FILTER_M: (f64, f64) = (0.01, 1.2);
const FILTER_OMEGA: (f64, f64) = (2.0, 25.0);
const LEAST_DAMPING: f64 = 0.8;
const MOST_RMS: f64 = 0.05;
/// Under this m the power is a logarithm.
const UNRESOLVED: f64 = 1e-9;

/// The singularities of the windows that qualify.
pub(in crate::score) fn forecast(known: &Known) -> Option<Passage> {
    let path = displacements(&rates(known));
    if path.len() < FEWEST_POINTS {
        return None;
    }
    let newest = path.last()?.0;
    let share = 1.0 / WINDOWS.len() as f64;
    let times = WINDOWS.iter().filter_map(|part| {
        let window = FitWindow::of(&path, *part)?;
        let left_days = window.qualified()? * window.length_days;
        Some(((newest + left_days - known.now_days).max(0.0), share))
    });
    Some(Passage::from_times(times.collect()))
}

/// The newest part of a path, its time from -1 to 0 and its displacement from 0 to 1.
struct FitWindow {
    points: Vec<(f64, f64)>,
    length_days: f64,
}

/// What is solved for at one (tc, m, omega).
struct Solved {
    /// Of (s^m - 1)/m, which does not become a constant as m vanishes: B m.
    trend: f64,
    /// Of the oscillation.
    amplitude: f64,
    /// Sum of squared residuals.
    cost: f64,
}

impl FitWindow {
    fn of(path: &[(f64, f64)], part: f64) -> Option<Self> {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a share of a count"
        )]
        let count = (part * path.len() as f64) as usize;
        let kept = &path[path.len() - count.max(FEWEST_POINTS)..];
        let (&(start, from), &(end, to)) = (kept.first()?, kept.last()?);
        let (length_days, moved) = (end - start, to - from);
        let is_usable = |size: f64| size.is_normal() && size > 0.0;
        (is_usable(length_days) && is_usable(moved)).then(|| Self {
            points: kept
                .iter()
                .map(|(days, slip)| ((days - end) / length_days, (slip - from) / moved))
                .collect(),
            length_days,
        })
    }

    /// Time left to the singularity, over the window's length, where the best fit passes the filters.
    fn qualified(&self) -> Option<f64> {
        let cost = |at: &[f64; 3]| self.cost(at);
        let mut starts: Vec<([f64; 3], f64)> = LEFT
            .iter()
            .flat_map(|left| EXPONENTS.map(|m| (*left, m)))
            .flat_map(|(left, m)| OMEGAS.map(|omega| [left.ln(), m, omega]))
            .map(|at| (at, cost(&at)))
            .collect();
        starts.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (at, _) = starts[..DESCENTS]
            .iter()
            .map(|(start, _)| descend(cost, *start, STEPS, MOST_EVALUATIONS))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        self.passes(&at).then(|| at[0].exp())
    }

    fn cost(&self, at: &[f64; 3]) -> f64 {
        let [ln_left, m, omega] = *at;
        let searched = inside(ln_left.exp(), SEARCHED_LEFT)
            && inside(m, SEARCHED_M)
            && inside(omega, SEARCHED_OMEGA);
        if !searched {
            return f64::INFINITY;
        }
        self.solve(at).map_or(f64::INFINITY, |solved| solved.cost)
    }

    fn passes(&self, at: &[f64; 3]) -> bool {
        let [ln_left, m, omega] = *at;
        let left = ln_left.exp();
        let Some(solved) = self.solve(at) else {
            return false;
        };
        let rms = (solved.cost / self.points.len() as f64).sqrt();
        inside(left, FILTER_LEFT)
            && inside(m, FILTER_M)
            && inside(omega, FILTER_OMEGA)
            && solved.trend < 0.0
            && -solved.trend >= LEAST_DAMPING * omega * solved.amplitude
            && rms <= MOST_RMS
    }

    /// Least squares of the displacement; `None` where the four columns are not independent.
    fn solve(&self, [ln_left, m, omega]: &[f64; 3]) -> Option<Solved> {
        let left = ln_left.exp();
        let column = |days: f64| {
            let ln = (left - days).ln();
            let power = (m * ln).exp();
            let trend = if m.abs() < UNRESOLVED {
                ln
            } else {
                (m * ln).exp_m1() / m
            };
            let (sine, cosine) = (omega * ln).sin_cos();
            Vector4::new(1.0, trend, power * cosine, power * sine)
        };
        let columns: Vec<Vector4<f64>> =
            self.points.iter().map(|(days, _)| column(*days)).collect();
        let (mut normal, mut products) = (Matrix4::zeros(), Vector4::zeros());
        for (column, (_, slip)) in columns.iter().zip(&self.points) {
            normal += column * column.transpose();
            products += column * *slip;
        }
        let linear = normal.cholesky()?.solve(&products);
        let left = columns.iter().zip(&self.points);
        let cost = left
            .map(|(column, (_, slip))| (slip - column.dot(&linear)).powi(2))
            .sum();
        Some(Solved {
            trend: linear[1],
            amplitude: linear[2].hypot(linear[3]),
            cost,
        })
    }
}

fn inside(value: f64, (low, high): (f64, f64)) -> bool {
    (low..=high).contains(&value)
}

#[cfg(test)]
mod tests {
    use super::super::drawn::{never, slips};
    use super::*;

    /// Singular on day 100.
    fn singular(t: f64, exponent: f64, omega: f64) -> f64 {
        let left = 100.0 - t;
        -500.0 * left.powf(exponent) * (1.0 + 0.04 * (omega * left.ln() + 0.7).cos())
    }

    #[test]
    fn its_own_law_is_found_with_confidence() {
        let known = slips(1.0, 92.0, |t| singular(t, 0.5, 11.0));
        let passage = forecast(&known).unwrap();
        let near = passage.chance_within(8.4) - passage.chance_within(7.6);
        assert!(near > 0.55, "{passage:?}");
        assert!(
            (near - passage.chance_within(1e9)).abs() < 1e-9,
            "{passage:?}"
        );
    }

    #[test]
    fn a_law_passes_the_filters_just_where_its_exponent_frequency_and_damping_are_within() {
        let passes = |exponent: f64, omega: f64, amplitude: f64| {
            let slip = |t: f64| {
                let left = 100.0 - t;
                -left.powf(exponent) * (1.0 + amplitude * (omega * left.ln()).cos())
            };
            let path: Vec<(f64, f64)> = (0..93)
                .map(|day| (f64::from(day), slip(f64::from(day))))
                .collect();
            let window = FitWindow::of(&path, 1.0).unwrap();
            window.passes(&[(8.0_f64 / 92.0).ln(), exponent, omega])
        };
        assert!(passes(0.5, 11.0, 0.04));
        assert!(!passes(1.3, 11.0, 0.04), "exponent");
        assert!(!passes(0.5, 26.0, 0.01), "frequency");
        assert!(!passes(0.5, 1.5, 0.04), "frequency");
        assert!(!passes(0.5, 11.0, 0.08), "damping");
    }

    #[test]
    fn a_slope_that_slows_down_never_fails_and_a_short_record_says_nothing() {
        let slowing = slips(1.0, 60.0, |t| 80.0 * (1.0 + t).ln());
        assert!(never(forecast(&slowing).as_ref()));
        let scant = slips(1.0, 8.0, |t| singular(t, 0.5, 11.0));
        assert_eq!(forecast(&scant), None);
    }
}

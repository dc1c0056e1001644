//! Jumps of the reading in the sense of the motion that may be slip of the ground.

use super::problem::Problem;
use super::quantiles::upper_median;
use super::refit::Fitted;
use super::response::Driver;

/// A jump that took longer than this, days, may be slip.
const LONGEST_JUMP_DAYS: f64 = 3.0;

/// Names of what only ever loosens a slope: more of it, more motion.
const LOOSENING: [&str; 10] = [
    "rain",
    "precip",
    "flow",
    "discharge",
    "pore",
    "piez",
    "groundwater",
    "melt",
    "snowmelt",
    "moisture",
];

/// Why the newest term, a jump of the reading in the sense of the motion, may be slip of the ground; `None` of any other.
pub(super) fn may_be_slip(
    problem: &Problem,
    fitted: &Fitted,
    drivers: &[Driver],
) -> Option<String> {
    let term = fitted.terms.last()?;
    let size = *fitted.parameters.last()?;
    let is_forward = term.is_jump_of_reading() && size > 0.0;
    let at = term.at.filter(|_| is_forward)?;
    slip_instead(problem, at, size, drivers)
}

/// Why a jump in the sense of the motion may be slip and no offset; `None` where a jump back is evidence of the
/// instrument, or nothing is evidence of slip.
fn slip_instead(problem: &Problem, at: usize, size: f64, drivers: &[Driver]) -> Option<String> {
    let level = |range: std::ops::Range<usize>| upper_median(problem.y[range].to_vec());
    let beside = 5;
    let comes_back = (beside..problem.t.len() - beside).any(|i| {
        let fall = level(i - beside..i) - level(i..i + beside);
        fall > 0.5 * size
    });
    if comes_back {
        return None;
    }
    let gap = problem.t[at] - problem.t[at - 1];
    if gap > LONGEST_JUMP_DAYS {
        return Some(format!("in {gap:.0} days fast creep would look the same"));
    }
    let wet = drivers.iter().find(|driver| {
        is_loosening(&driver.name)
            && driver.is_high(problem.t[at] - LONGEST_JUMP_DAYS, problem.t[at])
    });
    wet.map(|driver| {
        format!(
            "{} is among its highest just before: slip would look the same",
            driver.name
        )
    })
}

/// Whether a covariate of that name only ever loosens a slope.
pub(super) fn is_loosening(name: &str) -> bool {
    let name = name.to_lowercase();
    let parts = || name.split(|c: char| !c.is_alphanumeric());
    // A strain, a drain and a terrain are no rain.
    LOOSENING.iter().any(|word| match *word {
        "rain" => parts().any(|part| part.starts_with(word)),
        _ => name.contains(word),
    })
}

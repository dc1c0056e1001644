//! Covariates that go together, as rain and the river that it feeds: readings that answer to one answer to the other, and
//! do not say which of them acts.

use super::act::Act;
use super::frame::dot;
use super::response::Driver;
use super::term::Term;
use crate::reading::CovariateKind;

/// Responses that share half of their variance.
const TOGETHER: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Whether two terms are loads through two covariates whose responses go together.
pub(super) fn go_together(one: &Term, other: &Term) -> bool {
    let (Act::Load(own), Act::Load(theirs)) = (&one.act, &other.act) else {
        return false;
    };
    if one.channel.is_none() || other.channel.is_none() || one.channel == other.channel {
        return false;
    }
    // Responses have mean 0 and standard deviation 1.
    let alike = |a: &Vec<f64>, b: &Vec<f64>| dot(a, b).abs() > TOGETHER * a.len() as f64;
    own.iter()
        .zip(theirs)
        .any(|(own, theirs)| alike(own, theirs))
}

/// Whether its covariate is rain, which leads what it feeds: a river, a spring, the water in the slope.
pub(super) fn is_rain(term: &Term, drivers: &[Driver]) -> bool {
    let channel = Driver::at(drivers, term.channel);
    channel.is_some_and(|driver| driver.kind == CovariateKind::Rain)
}

#[cfg(test)]
mod tests;

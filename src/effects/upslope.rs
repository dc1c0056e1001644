//! Readings that go the wrong way: the law only moves downslope, and whatever is tried beside it only undoes that.

use super::explanation::Effect;
use super::findings::Findings;
use super::kind::Kind;
use super::problem::Problem;
use super::quantiles::upper_median;
use crate::reading::{Quantity, Unit};

/// What is remarked of them.
pub(super) const REMARK: &str = "The readings fall: the slope would move upslope, which the law cannot. Is their sign right? In a config components = [\"COLUMN\"] and \
     direction = [-1.0] of the [[benchmark]] turn it.";
/// The median of so many readings at either end says where they stand.
const END: usize = 5;
/// They fall by more than this share of their whole range,
const SHARE: f64 = 0.5;
/// and by so many times the scatter of a reading about the middle of its neighbours.
const CLEAR: f64 = 20.0;
/// Of velocities this share is below zero.
const MOSTLY: f64 = 0.9;

/// What is found in readings that go upslope, with its remark; `None` of others.
pub(super) fn refused(
    problem: &Problem,
    unit: Unit,
    remarks: &mut Vec<String>,
) -> Option<Findings> {
    if !goes_upslope(problem) {
        return None;
    }
    remarks.push(REMARK.to_owned());
    Some(Findings {
        verdict: Effect::of(Kind::UNEXPLAINED),
        ..Findings::none(unit)
    })
}

/// Whether the fitted readings go upslope on the whole, far beyond their noise.
fn goes_upslope(problem: &Problem) -> bool {
    let y = &problem.y[..problem.used];
    if y.len() < 2 * END {
        return false;
    }
    match problem.quantity {
        Quantity::Velocity => {
            let below = y.iter().filter(|velocity| **velocity < 0.0).count();
            below as f64 > MOSTLY * y.len() as f64
        }
        Quantity::Displacement => {
            let end = |part: &[f64]| upper_median(part.to_vec());
            let fall = end(&y[..END]) - end(&y[y.len() - END..]);
            let off = y.windows(3).map(|w| (w[1] - 0.5 * (w[0] + w[2])).abs());
            fall > SHARE * problem.range() && fall > CLEAR * upper_median(off.collect())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::explain::explain;
    use super::super::fixture::{daily, generator, normals, series};
    use super::super::kind::Kind;
    use super::super::options::Options;
    use super::*;

    /// What is said of the readings of a slope that creeps steadily, times `sign`, with its remarks.
    fn explained(quantity: Quantity, sign: f64) -> (Kind, Vec<String>) {
        let days = daily(60);
        let noise = normals(&mut generator(3), days.len());
        let values = days.iter().zip(noise).map(|(day, noise)| {
            let value = match quantity {
                Quantity::Displacement => 5.0 * day + noise,
                Quantity::Velocity => 5.0 * (1.0 + 0.05 * noise),
            };
            sign * value
        });
        let series = series(quantity, &days, &values.collect::<Vec<f64>>());
        let options = Options {
            surrogates: 99,
            ..Options::default()
        };
        let said = explain(&series, &[], &[], &options, &mut |_| ());
        (said.verdict.effect, said.remarks)
    }

    #[test]
    fn readings_with_the_wrong_sign_are_said_to_have_it_and_get_no_effect() {
        for quantity in [Quantity::Displacement, Quantity::Velocity] {
            let (verdict, remarks) = explained(quantity, -1.0);
            assert_eq!(verdict, Kind::UNEXPLAINED);
            assert!(remarks.iter().any(|one| one == REMARK), "{remarks:?}");
            let (verdict, remarks) = explained(quantity, 1.0);
            assert_eq!(verdict, Kind::NONE);
            assert!(!remarks.iter().any(|one| one == REMARK), "{remarks:?}");
        }
    }
}

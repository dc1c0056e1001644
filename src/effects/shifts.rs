//! What covariates at the wrong time gain by the very search that is made for those at the right one, in full. Where the law without them
//! fits poorly, a joint refit with almost anything leaves it for a better one: the law linearised about it knows nothing of that.

use super::judge::objection;
use super::refit::Fitted;
use super::response::Driver;
use super::search::{Refitted, SIGNIFICANT, Search};
use super::surrogate::{LEAST_SHIFT, WholeGains};
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64Mcg;

/// Records of more readings than this are judged by the law linearised alone: there whole searches refuse drivers that are known to act.
const SHORT: usize = 64;
/// So many searches are made at least and at most.
const SEARCHES: (usize, usize) = (8, 60);
/// By so much of the BIC a covariate leads what needs none where no search is needed to tell that it does.
const LEADS: f64 = 60.0;
/// The searches end where so many have gained as much,
const AS_GOOD: usize = 3;
/// or, after the fewest, where the chance of it is below this.
const CERTAIN: f64 = 1e-4;

impl Search<'_> {
    /// Gives refitted covariates, whose p-value by the law linearised is small, that of whole searches where this is larger. `rival` is the
    /// most that anything gains which needs no covariate: what leads it by far, and a slow load too, has not merely left a poor law.
    pub(super) fn judge_by_whole_searches(
        &mut self,
        base: &Fitted,
        covariates: &mut [Refitted],
        (rival, seed): (f64, u64),
    ) {
        let (problem, margin) = (self.problem, self.options.bic_margin);
        if problem.used > SHORT {
            return;
        }
        let is_open = |one: &Refitted| one.gain > margin && one.p_value < SIGNIFICANT;
        let open = covariates.iter().filter(|one| is_open(one));
        let most = open.map(|one| one.gain).fold(0.0, f64::max);
        let mut rival = rival;
        if most > rival + LEADS {
            let slow = self.slow_load(base).map_or(0.0, |slow| slow.gain);
            rival = rival.max(slow);
        }
        let is_doubtful = |one: &Refitted| is_open(one) && one.gain <= rival + LEADS;
        let doubtful = covariates.iter().filter(|one| is_doubtful(one));
        let Some(most) = doubtful.map(|one| one.paid(problem)).reduce(f64::max) else {
            return;
        };
        let gains = self.null_gains_in_full(base, most, seed);
        for one in covariates.iter_mut().filter(|one| is_doubtful(one)) {
            one.p_value = gains.p_of_two(one.paid(problem)).max(one.p_value);
        }
    }

    /// The gains of whole searches over covariates at the wrong time, none paid for; no more than tell how rare a gain of `most` is.
    fn null_gains_in_full(&mut self, base: &Fitted, most: f64, seed: u64) -> WholeGains {
        let mut gains = WholeGains::default();
        for (share, mirrored) in distinct_shifts(self.drivers, SEARCHES.1, seed) {
            gains.push(self.gain_of_shifted(base, share, mirrored));
            let is_certain = gains.len() >= SEARCHES.0 && gains.p_value(most) < CERTAIN;
            if is_certain || gains.reaching(most) >= AS_GOOD {
                break;
            }
        }
        gains
    }

    /// What the best of the covariates gains, all of them shifted by the same share of their records.
    fn gain_of_shifted(&mut self, base: &Fitted, share: f64, mirrored: bool) -> f64 {
        let shifted = self.drivers.iter();
        let shifted: Vec<Driver> = shifted.map(|own| own.moved_by(share, mirrored)).collect();
        let mut other = self.through_others(&shifted);
        let steady = other.steady_law(base);
        let steady = steady.as_ref().and_then(|law| other.ground(law));
        let ground = other.ground(base);
        let found = ground.map(|ground| other.through_covariates(base, &ground, steady.as_ref()));
        self.scratch = other.scratch;
        let found = found.unwrap_or_default().into_iter();
        let may_be = found.filter(|one| objection(self.problem, &one.fitted, &shifted).is_none());
        may_be.map(|one| one.paid(self.problem)).fold(0.0, f64::max)
    }
}

/// Shares of the record by which covariates are shifted, each another place on the longest of them, and whether they are run backwards.
fn distinct_shifts(drivers: &[Driver], count: usize, seed: u64) -> Vec<(f64, bool)> {
    let length = drivers.iter().map(Driver::len).max().unwrap_or(0);
    let shares = (1..length).map(|place| place as f64 / length as f64);
    let far = shares.filter(|share| (LEAST_SHIFT..=1.0 - LEAST_SHIFT).contains(share));
    let mut all: Vec<(f64, bool)> = far
        .flat_map(|share| [(share, false), (share, true)])
        .collect();
    all.shuffle(&mut Pcg64Mcg::seed_from_u64(seed));
    all.truncate(count);
    all
}

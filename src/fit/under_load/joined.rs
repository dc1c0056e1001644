//! Where a law begins: what came before it, a velocity that walks at random, ends at the law's own velocity there.
//!
//! The readings before a start and those after it are two filters of one state, the level of ln v, what remembers in the scatter
//! and the error of the reading between them, which run towards each other. Together they say more than each alone, and a start
//! where they disagree is none.

use super::evidence::{FEWEST_UNDER_THE_LAW, MOST_DRIFTS, NEGLIGIBLE, Room, ln_prior_of_start};
use super::gains::{Gains, LEVEL_VARIANCE, LoadMemory, RateRecord};
use nalgebra::{Matrix3, Vector3};

/// The most, in ln, that a start is expected to gain where the walk before it ends at the law's velocity.
pub(super) const MOST_JOINED: f64 = 8.0;
/// Walks of less than this share of a start are not counted.
const RARE_WALK: f64 = 1e-5;
/// Products of variances are kept within this: far inside of what a float holds.
const IN_RANGE: (f64, f64) = (1e-60, 1e60);

/// A number for each walk.
type OfWalks = [f64; MOST_DRIFTS];

/// What the rates before one say of the state there (level, what remembers, error of the reading at the rate's start), by each
/// walk: its mean, its covariance and, of the level, the variance before any reading. Their evidence, ln, is less by half of the
/// sum of the squares of their misses and of ln of their variances, of which the newest are a product.
#[derive(Debug, Clone, Copy)]
struct WalkEnds {
    squares: OfWalks,
    ln_variances: OfWalks,
    variances: OfWalks,
    level: OfWalks,
    load: OfWalks,
    end: OfWalks,
    level_level: OfWalks,
    level_load: OfWalks,
    level_end: OfWalks,
    load_load: OfWalks,
    load_end: OfWalks,
    end_end: OfWalks,
    prior: OfWalks,
}

/// The state by one walk, as in [`WalkEnds`].
#[derive(Debug, Clone, Copy)]
struct WalkEnd {
    mean: Vector3<f64>,
    covariance: Matrix3<f64>,
    prior: f64,
}

/// What came before each rate, by every walk.
#[derive(Debug, Clone, Default)]
pub(super) struct WalksBefore {
    ends: Vec<WalkEnds>,
    walks: usize,
    /// Variance of what remembers in the scatter.
    remembered: f64,
    /// ln of the evidence of the rates before each one, and of the prior of a start there.
    pub(super) ln: Vec<f64>,
}

/// A law joined to one walk before its start.
#[derive(Debug, Clone, Copy)]
struct JoinedWalk {
    /// ln of how much likelier that is than the two apart, and of the walk's share.
    ln: f64,
    /// ln of the velocity at the start: mean and variance.
    level: f64,
    variance: f64,
}

/// What the readings from a start on say of the state there.
struct FromTheStart {
    mean: Vector3<f64>,
    precision: Matrix3<f64>,
    ln_determinant: f64,
}

impl WalksBefore {
    /// Walks of `record` under a noise.
    pub(super) fn walk(&mut self, record: &RateRecord, memory: &LoadMemory) {
        let drifts = record.assumed.drifts_before;
        self.walks = drifts.len().min(MOST_DRIFTS);
        let noise = memory.noise();
        let variance = noise.sigma.powi(2);
        self.remembered = variance;
        self.ends.clear();
        self.ln.clear();
        let squares =
            std::array::from_fn(|which| drifts.get(which).map_or(0.0, |drift| drift * drift));
        let count = record.from.len();
        let mut at = WalkEnds::before_any(variance);
        for index in 0..count {
            if index > 0 {
                let (keep, ..) = memory.of_rate(count - index);
                let both = record.white[index - 1].recip() + record.white[index].recip();
                at.go_on(
                    keep,
                    variance,
                    squares.map(|square: f64| 0.5 * square * both),
                );
                if !record.ends_where_next_begins(index - 1) {
                    at.at_a_new_reading();
                }
            }
            let of_start = record
                .assumed
                .from_the_first
                .map_or(0.0, |first| ln_prior_of_start(record, index, first));
            let (_, ln_sum) = at.likelihoods(self.walks);
            self.ln.push(ln_sum - (self.walks as f64).ln() + of_start);
            self.ends.push(at);
            let (_, sees, lacks) = memory.of_rate(count - 1 - index);
            let (error, of_ends) = record.own_and_ends(index, noise);
            at.read(record.ln_velocity[index], error + lacks, of_ends, sees);
        }
    }

    /// The walks before the rate `index`, each joined to a law that begins with it.
    fn joined(&self, index: usize, law: &FromTheStart) -> [Option<JoinedWalk>; MOST_DRIFTS] {
        let mut joined = [None; MOST_DRIFTS];
        let Some(ends) = self.ends.get(index) else {
            return joined;
        };
        let (likelihoods, _) = ends.likelihoods(self.walks);
        let sum: f64 = likelihoods.iter().sum();
        for (which, (slot, likelihood)) in joined.iter_mut().zip(likelihoods).enumerate() {
            let share = likelihood / sum;
            if share > RARE_WALK {
                let end = ends.of_walk(which);
                *slot = end.join(law, self.remembered).map(|found| JoinedWalk {
                    ln: found.ln + share.ln(),
                    ..found
                });
            }
        }
        joined
    }
}

impl WalkEnds {
    /// Before any reading: what remembers has this variance.
    fn before_any(variance: f64) -> Self {
        let none = [0.0; MOST_DRIFTS];
        Self {
            squares: none,
            ln_variances: none,
            variances: [1.0; MOST_DRIFTS],
            level: none,
            load: none,
            end: none,
            level_level: [LEVEL_VARIANCE; MOST_DRIFTS],
            level_load: none,
            level_end: none,
            load_load: [variance; MOST_DRIFTS],
            load_end: none,
            end_end: [1.0; MOST_DRIFTS],
            prior: [LEVEL_VARIANCE; MOST_DRIFTS],
        }
    }

    /// To the next rate: `keep` of what remembers is left, and the levels drift by the variances `drifted`.
    fn go_on(&mut self, keep: f64, variance: f64, drifted: OfWalks) {
        for (walk, drifted) in drifted.iter().enumerate() {
            self.load[walk] *= keep;
            self.level_load[walk] *= keep;
            self.load_end[walk] *= keep;
            self.load_load[walk] =
                keep * keep * self.load_load[walk] + variance * (1.0 - keep * keep);
            self.level_level[walk] += drifted;
            self.prior[walk] += drifted;
        }
    }

    /// The next rate begins with a reading that no rate so far has ended with.
    fn at_a_new_reading(&mut self) {
        self.end = [0.0; MOST_DRIFTS];
        self.level_end = [0.0; MOST_DRIFTS];
        self.load_end = [0.0; MOST_DRIFTS];
        self.end_end = [1.0; MOST_DRIFTS];
    }

    /// Takes a rate of that variance of its error, which the readings at its two ends move by so much each.
    fn read(&mut self, read: f64, error: f64, ends: f64, sees: f64) {
        for walk in 0..MOST_DRIFTS {
            let level =
                self.level_level[walk] + sees * self.level_load[walk] - ends * self.level_end[walk];
            let load =
                self.level_load[walk] + sees * self.load_load[walk] - ends * self.load_end[walk];
            let end = self.level_end[walk] + sees * self.load_end[walk] - ends * self.end_end[walk];
            let s = (level + sees * load - ends * end + error + ends * ends).max(1e-12);
            let expected = self.level[walk] + sees * self.load[walk] - ends * self.end[walk];
            let miss = read - expected;
            let (precision, gain) = (1.0 / s, miss / s);
            self.squares[walk] += miss * gain;
            self.variances[walk] *= s;
            self.level[walk] += level * gain;
            self.load[walk] += load * gain;
            // From here on the third is the error of the reading at the rate's end.
            self.end[walk] = ends * gain;
            self.level_level[walk] -= level * level * precision;
            self.level_load[walk] -= level * load * precision;
            self.load_load[walk] -= load * load * precision;
            self.level_end[walk] = -level * ends * precision;
            self.load_end[walk] = -load * ends * precision;
            self.end_end[walk] = 1.0 - ends * ends * precision;
        }
        self.keep_products_in_range();
    }

    fn keep_products_in_range(&mut self) {
        let is_inside = |product: &f64| (IN_RANGE.0..IN_RANGE.1).contains(product);
        if self.variances.iter().all(is_inside) {
            return;
        }
        for (ln, product) in self.ln_variances.iter_mut().zip(&mut self.variances) {
            *ln += product.ln();
            *product = 1.0;
        }
    }

    /// The likelihoods of the first so many walks, in the same units, and ln of the sum of their evidence.
    fn likelihoods(&self, walks: usize) -> (OfWalks, f64) {
        let twice: OfWalks =
            std::array::from_fn(|walk| self.squares[walk] + self.ln_variances[walk]);
        let least = twice[..walks].iter().copied().fold(f64::INFINITY, f64::min);
        let mut likelihoods = [0.0; MOST_DRIFTS];
        for (walk, likelihood) in likelihoods.iter_mut().enumerate().take(walks) {
            let of_variances = (self.variances[0] / self.variances[walk]).sqrt();
            *likelihood = (-0.5 * (twice[walk] - least)).exp() * of_variances;
        }
        let sum: f64 = likelihoods.iter().sum();
        let ln_sum = -0.5 * least + (sum / self.variances[0].sqrt()).ln();
        (likelihoods, ln_sum)
    }

    /// What one walk says of the state.
    fn of_walk(&self, walk: usize) -> WalkEnd {
        WalkEnd {
            mean: Vector3::new(self.level[walk], self.load[walk], self.end[walk]),
            covariance: Matrix3::new(
                self.level_level[walk],
                self.level_load[walk],
                self.level_end[walk],
                self.level_load[walk],
                self.load_load[walk],
                self.load_end[walk],
                self.level_end[walk],
                self.load_end[walk],
                self.end_end[walk],
            ),
            prior: self.prior[walk],
        }
    }
}

impl WalkEnd {
    /// How much likelier the walk is together with what the law says of the state than apart, ln, and where its level is then.
    fn join(&self, law: &FromTheStart, remembered: f64) -> Option<JoinedWalk> {
        let own = self.covariance.try_inverse()?;
        let before = Vector3::new(self.prior, remembered, 1.0);
        let prior = Matrix3::from_diagonal(&before.map(f64::recip));
        let precision = own + law.precision - prior;
        let covariance = precision.try_inverse()?;
        let pull = own * self.mean + law.precision * law.mean;
        let mean = covariance * pull;
        let squares = self.mean.dot(&(own * self.mean)) + law.mean.dot(&(law.precision * law.mean))
            - pull.dot(&mean);
        let determinants = self.covariance.determinant() * precision.determinant();
        let determinants = (determinants / before.product()).ln() + law.ln_determinant;
        let ln = -0.5 * (squares + determinants);
        (ln.is_finite() && covariance[(0, 0)] > 0.0).then_some(JoinedWalk {
            ln,
            level: mean[0],
            variance: covariance[(0, 0)],
        })
    }
}

impl FromTheStart {
    /// Of a law weighed last, that begins with the oldest rate of `step`.
    fn of(gains: &Gains, room: &Room<1>, step: usize, predicted: f64) -> Option<Self> {
        let [[level], [load], [end]] = *room.at_start.get(step)?;
        let covariance = gains.at_start.get(step)?;
        Some(Self {
            mean: Vector3::new(level + predicted, load, end),
            precision: covariance.try_inverse()?,
            ln_determinant: Some(covariance.determinant().ln()).filter(|ln| ln.is_finite())?,
        })
    }
}

/// Joins every start of the law weighed last that counts to the walks before it: weighs the starts in the room anew, and gives the
/// best of them, ln.
pub(super) fn join(
    walks: &WalksBefore,
    predicted: &[[f64; 1]],
    gains: &Gains,
    room: &mut Room<1>,
) -> f64 {
    let count = predicted.len();
    let first = FEWEST_UNDER_THE_LAW.min(count) - 1;
    let each = room.ln_evidence.iter().skip(first);
    let most = each.map(|[ln]| *ln).fold(f64::NEG_INFINITY, f64::max);
    let mut best = f64::NEG_INFINITY;
    for step in first..room.ln_evidence.len() {
        let [ln] = room.ln_evidence[step];
        let index = count - 1 - step;
        let joined = if index == 0 {
            0.0
        } else if ln > most - NEGLIGIBLE - MOST_JOINED {
            let law = FromTheStart::of(gains, room, step, predicted[index][0]);
            let all = law.map(|law| walks.joined(index, &law));
            let sum = |all: [Option<JoinedWalk>; MOST_DRIFTS]| {
                all.iter()
                    .flatten()
                    .map(|one| one.ln.exp())
                    .sum::<f64>()
                    .ln()
            };
            all.map_or(f64::NEG_INFINITY, sum)
        } else {
            f64::NEG_INFINITY
        };
        room.ln_evidence[step] = [ln + joined];
        best = best.max(ln + joined);
    }
    best
}

/// ln of the velocity of a law less the record's centre, and its variance, by the readings before its start and after it; `share`:
/// the probability of the walks before the one that is meant. `None` where it begins with the first rate.
pub(super) fn level_joined(
    walks: &WalksBefore,
    (gains, room): (&Gains, &Room<1>),
    (rates, predicted): (usize, &[[f64; 1]]),
    share: f64,
) -> Option<(f64, f64)> {
    let index = predicted
        .len()
        .checked_sub(rates)
        .filter(|index| *index > 0)?;
    let of_law = predicted[index][0];
    let law = FromTheStart::of(gains, room, rates - 1, of_law)?;
    let all = walks.joined(index, &law);
    let weight = |one: &JoinedWalk| one.ln.exp();
    let mut left = share * all.iter().flatten().map(weight).sum::<f64>();
    let chosen = all.iter().flatten().find(|one| {
        left -= weight(one);
        left < 0.0
    });
    let chosen = chosen.or_else(|| all.iter().flatten().last())?;
    Some((chosen.level - of_law, chosen.variance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::under_load::evidence::weigh;
    use crate::fit::under_load::gains::LoadNoise;
    use nalgebra::{DMatrix, DVector};

    const PREDICTED: f64 = 0.05;
    const NOISE: LoadNoise = LoadNoise {
        scatter: 0.1,
        sigma: 0.3,
        tau: 2.0,
        shared: 0.7,
        ln_evidence: 0.0,
    };

    /// ln of the normal density of the record where the law begins with the second rate and a walk of that drift comes before,
    /// but for the constants; and the mean and variance of the law's level then.
    fn dense(record: &RateRecord, memory: &LoadMemory, drift: f64) -> (f64, f64, f64) {
        let (_, sees, lacks) = memory.of_rate(0);
        let drifted = drift * drift;
        let kept = LEVEL_VARIANCE / (LEVEL_VARIANCE + drifted);
        let of_level = |index: usize| if index == 0 { kept } else { 1.0 };
        let ends =
            |index: usize| (0.5 * NOISE.shared / record.trust[index]).sqrt() * record.error[index];
        let covariance = DMatrix::from_fn(5, 5, |i, j| {
            let days = (record.middle[i] - record.middle[j]).abs();
            let remembered = (sees * NOISE.sigma).powi(2) * (-days / NOISE.tau).exp();
            let mut sum = LEVEL_VARIANCE * of_level(i) * of_level(j) + remembered;
            if i == j {
                sum += record.variance(i, NOISE.scatter) + lacks;
            }
            if i == j && i == 0 {
                sum += kept * drifted;
            }
            if i.abs_diff(j) == 1 && i.min(j) != 2 {
                sum -= ends(i) * ends(j);
            }
            sum
        });
        let miss = DVector::from_fn(5, |i, _| record.ln_velocity[i] - PREDICTED * of_level(i));
        let inverse = covariance.clone().try_inverse().unwrap();
        let square = (miss.transpose() * &inverse * &miss)[(0, 0)];
        let gain = DVector::from_fn(5, |i, _| LEVEL_VARIANCE * of_level(i)).transpose() * &inverse;
        let level = (&gain * &miss)[(0, 0)];
        let seen = DVector::from_fn(5, |i, _| LEVEL_VARIANCE * of_level(i));
        let variance = LEVEL_VARIANCE - (&gain * seen)[(0, 0)];
        (
            -0.5 * (square + covariance.determinant().ln()),
            level,
            variance,
        )
    }

    #[test]
    fn a_law_and_the_walk_before_it_are_as_likely_together_as_their_normal_density_says() {
        let record = RateRecord::of_five();
        let memory = LoadMemory::new(&record, &NOISE);
        let mut walks = WalksBefore::default();
        walks.walk(&record, &memory);
        let gains = Gains::new(&record, &memory, &[0.0; 5], &walks.ln);
        let predicted = [[PREDICTED]; 5];
        let mut room = Room::default();
        weigh(&record, &predicted, &gains, f64::NEG_INFINITY, &mut room);
        join(&walks, &predicted, &gains, &mut room);
        let drifts = record.assumed.drifts_before;
        let each: Vec<(f64, f64, f64)> = drifts
            .iter()
            .map(|drift| dense(&record, &memory, *drift))
            .collect();
        let sum: f64 = each.iter().map(|(ln, ..)| ln.exp()).sum::<f64>() / 4.0;
        let want = sum.ln() + ln_prior_of_start(&record, 1, 0.5);
        let got = room.ln_evidence[3][0];
        assert!((got - want).abs() < 1e-9, "{got} {want}");
        let (level, variance) =
            level_joined(&walks, (&gains, &room), (4, &predicted), 0.0).unwrap();
        let (_, of_level, of_variance) = each[0];
        assert!((level - of_level).abs() < 1e-9, "{level} {of_level}");
        assert!(
            (variance - of_variance).abs() < 1e-9,
            "{variance} {of_variance}"
        );
    }
}

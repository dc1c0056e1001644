//! The evidence of laws that are computed together, summed over every start that each may have.

use super::gains::{Gains, LEVEL_VARIANCE, RateRecord};
use super::shape::{BLOCKS, Block, LANES, TablePlace};

/// Rates that a law must explain, at least.
pub(super) const FEWEST_UNDER_THE_LAW: usize = 4;
/// Most standard deviations, for one rate after another, of a velocity that follows no law.
pub(super) const MOST_DRIFTS: usize = 4;
/// Rates between two looks at whether a block can still count.
const LOOKED: usize = 8;
/// Starts this much less likely than the best, ln, are not counted.
pub(super) const NEGLIGIBLE: f64 = 10.0;

/// The times of a record in units of one slope's time to failure.
#[derive(Debug, Clone)]
pub(super) struct SlopeTable {
    /// |r|, 1/day.
    pub(super) r: f64,
    /// ln(1 + |r| t) at the middle of each rate.
    pub(super) u: Vec<f64>,
    /// ln of the mean rate that each shape of each block predicts, in units of the velocity now; of blocks that nobody
    /// asks about none.
    pub(super) predicted: Vec<Vec<[f64; LANES]>>,
}

/// Room for one evaluation of so many laws, used again and again.
#[derive(Debug, Clone, Default)]
pub(super) struct Room<const TOGETHER: usize> {
    pub(super) ln_evidence: Vec<[f64; TOGETHER]>,
    today: Vec<[[f64; TOGETHER]; 2]>,
    /// Level, load and error of the reading at the start of each rate, after it; where errors are followed.
    pub(super) at_start: Vec<[[f64; TOGETHER]; 3]>,
}

/// A law that begins with one rate: its share of all of its starts is its probability.
#[derive(Debug, Clone, Copy)]
pub(super) struct StartedLaw {
    /// How many rates it explains.
    pub(super) rates: usize,
    /// What those say of it.
    pub(super) evidence: ShapeEvidence,
}

/// What the readings say of one law.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShapeEvidence {
    pub(super) ln: f64,
    /// ln v less the record's centre, and the load, of today.
    pub(super) ln_velocity: f64,
    pub(super) load: f64,
    /// Their variances and their covariance.
    pub(super) today: [f64; 3],
}

/// The times of a record, days before its present, each once: what ends one rate mostly begins the next.
#[derive(Debug, Clone)]
pub(super) struct RecordTimes {
    days: Vec<f64>,
    /// Where the start, the middle and the end of each rate stand among them.
    of_rates: Vec<[usize; 3]>,
}

impl RecordTimes {
    pub(super) fn of(record: &RateRecord) -> Self {
        let mut times = Self {
            days: Vec::with_capacity(2 * record.from.len() + 1),
            of_rates: Vec::with_capacity(record.from.len()),
        };
        let each = record.from.iter().zip(&record.middle).zip(&record.to);
        for ((from, middle), to) in each {
            let place = [from, middle, to].map(|days| times.place(*days));
            times.of_rates.push(place);
        }
        times
    }

    /// Where `days` stands, behind the others where it is not the last of them.
    fn place(&mut self, days: f64) -> usize {
        if self.days.last() != Some(&days) {
            self.days.push(days);
        }
        self.days.len() - 1
    }
}

impl SlopeTable {
    /// `blocks`: those that are asked about.
    pub(super) fn new(r: f64, times: &RecordTimes, blocks: &[bool]) -> Self {
        let u: Vec<f64> = times.days.iter().map(|days| (r * days).ln_1p()).collect();
        let places: Vec<TablePlace> = u.iter().map(|u| TablePlace::of(*u)).collect();
        let predicted = BLOCKS.iter().zip(blocks).map(|(block, is_asked)| {
            if *is_asked {
                predict(block, &places, &times.of_rates)
            } else {
                Vec::new()
            }
        });
        let predicted = predicted.collect();
        Self {
            r,
            u: times
                .of_rates
                .iter()
                .map(|[_, middle, _]| u[*middle])
                .collect(),
            predicted,
        }
    }
}

fn predict(block: &Block, places: &[TablePlace], rates: &[[usize; 3]]) -> Vec<[f64; LANES]> {
    let ln_y: Vec<[f64; LANES]> = places.iter().map(|place| block.ln_y(*place)).collect();
    let mean = |rate: &[usize; 3]| {
        let [from, middle, to] = rate.map(|place| &ln_y[place]);
        std::array::from_fn(|lane| {
            // ln of the mean of e^x over an x that falls evenly: ln(sinh(h)/h) above the middle.
            let h2 = 0.25 * (from[lane] - to[lane]).powi(2);
            let above = if h2 < 4.0 {
                h2 / 6.0
            } else {
                h2.sqrt() - (2.0 * h2.sqrt()).ln()
            };
            above - middle[lane]
        })
    };
    rates.iter().map(mean).collect()
}

/// The evidence of laws that predict, in units of the velocity now, these logarithms of the mean rates. One whose evidence,
/// ln, cannot reach `least` has none.
pub(super) fn weigh<const TOGETHER: usize>(
    record: &RateRecord,
    predicted: &[[f64; TOGETHER]],
    gains: &Gains,
    least: f64,
    room: &mut Room<TOGETHER>,
) -> [ShapeEvidence; TOGETHER] {
    if record.assumed.follows_errors {
        weigh_with::<TOGETHER, true>(record, predicted, gains, least, room)
    } else {
        weigh_with::<TOGETHER, false>(record, predicted, gains, least, room)
    }
}

fn weigh_with<const TOGETHER: usize, const SHARED: bool>(
    record: &RateRecord,
    predicted: &[[f64; TOGETHER]],
    gains: &Gains,
    least: f64,
    room: &mut Room<TOGETHER>,
) -> [ShapeEvidence; TOGETHER] {
    room.ln_evidence.clear();
    room.today.clear();
    room.at_start.clear();
    let count = record.ln_velocity.len();
    let [mut load, mut level, mut velocity_now, mut load_now, mut ln] = [[0.0; TOGETHER]; 5];
    let mut end = [0.0; TOGETHER];
    let first = FEWEST_UNDER_THE_LAW.min(count) - 1;
    let mut best = [f64::NEG_INFINITY; TOGETHER];
    // The sum over starts is no more than all of them at the best.
    let least = least - ((count - first) as f64).ln();
    for (step, gain) in gains.steps.iter().enumerate() {
        // What a start has lost to its misses no older one wins back.
        if step % LOOKED == 0 && cannot_reach(least, &best, &ln, gains.most_outside[step]) {
            return [NO_EVIDENCE; TOGETHER];
        }
        let index = count - 1 - step;
        let (read, predicted) = (record.ln_velocity[index], &predicted[index]);
        let outside = gains.outside[step];
        let mut total = [0.0; TOGETHER];
        for lane in 0..TOGETHER {
            load[lane] *= gain.keep;
            let seen = if SHARED {
                gain.sees * load[lane] + gain.shared * end[lane]
            } else {
                load[lane]
            };
            let miss = read - predicted[lane] - seen - level[lane];
            if SHARED {
                end[lane] = gain.end * miss;
            }
            ln[lane] -= 0.5 * miss * miss * gain.precision;
            load[lane] += gain.load * miss;
            level[lane] += gain.level * miss;
            velocity_now[lane] += gain.velocity_now * miss;
            load_now[lane] += gain.load_now * miss;
            total[lane] = ln[lane] + outside;
        }
        room.ln_evidence.push(total);
        room.today.push([velocity_now, load_now]);
        if SHARED {
            room.at_start.push([level, load, end]);
        }
        if step >= first {
            for (best, total) in best.iter_mut().zip(total) {
                *best = if total > *best { total } else { *best };
            }
        }
    }
    std::array::from_fn(|lane| {
        if best[lane].is_finite() && best[lane] >= least {
            over_starts(gains, room, first, lane, best[lane])
        } else {
            NO_EVIDENCE
        }
    })
}

/// Whether no lane can reach `least`, of which `best` are the best starts so far, `ln` what the misses have cost, and
/// `most_outside` the most that an older start has beside them.
fn cannot_reach(least: f64, best: &[f64], ln: &[f64], most_outside: f64) -> bool {
    let mut lanes = best.iter().zip(ln);
    lanes.all(|(best, ln)| *best < least && ln + most_outside < least)
}

const NO_EVIDENCE: ShapeEvidence = ShapeEvidence {
    ln: f64::NEG_INFINITY,
    ln_velocity: 0.0,
    load: 0.0,
    today: [0.0; 3],
};

/// Over the starts of the law weighed last, as they stand in the room, of which the best has that evidence, ln.
pub(super) fn over_all_starts(gains: &Gains, room: &Room<1>, best: f64) -> ShapeEvidence {
    let first = FEWEST_UNDER_THE_LAW.min(room.ln_evidence.len()) - 1;
    if best.is_finite() {
        over_starts(gains, room, first, 0, best)
    } else {
        NO_EVIDENCE
    }
}

/// Over the starts of a lane from the first that may be, of which the best has that evidence, ln.
fn over_starts<const TOGETHER: usize>(
    gains: &Gains,
    room: &Room<TOGETHER>,
    first: usize,
    lane: usize,
    best: f64,
) -> ShapeEvidence {
    let starts = &room.ln_evidence[first..];
    let mut sum = 0.0;
    let mut mean = NO_EVIDENCE;
    for (offset, ln) in starts.iter().enumerate() {
        if ln[lane] < best - NEGLIGIBLE {
            continue;
        }
        let (step, weight) = (first + offset, (ln[lane] - best).exp());
        let [velocity_now, load_now] = &room.today[step];
        sum += weight;
        mean.ln_velocity += weight * velocity_now[lane];
        mean.load += weight * load_now[lane];
        for (slot, variance) in mean.today.iter_mut().zip(&gains.today[step]) {
            *slot += weight * variance;
        }
    }
    ShapeEvidence {
        ln: best + f64::ln(sum),
        ln_velocity: mean.ln_velocity / sum,
        load: mean.load / sum,
        today: mean.today.map(|variance| variance / sum),
    }
}

/// The start of the law weighed last that has `share` of the probability of all of its starts on its newer side.
pub(super) fn start_at(gains: &Gains, room: &Room<1>, share: f64) -> Option<StartedLaw> {
    let first = FEWEST_UNDER_THE_LAW.min(room.ln_evidence.len()) - 1;
    let starts = &room.ln_evidence[first..];
    let all = starts.iter().map(|[ln]| *ln);
    let best = all.fold(f64::NEG_INFINITY, f64::max);
    let weight = |ln: f64| (ln - best).exp();
    let mut left = share * starts.iter().map(|[ln]| weight(*ln)).sum::<f64>();
    let found = starts.iter().position(|[ln]| {
        left -= weight(*ln);
        left < 0.0
    });
    let step = first + found.unwrap_or(starts.len() - 1);
    let [[ln_velocity], [load]] = *room.today.get(step)?;
    let [ln] = room.ln_evidence[step];
    Some(StartedLaw {
        rates: step + 1,
        evidence: ShapeEvidence {
            ln,
            ln_velocity,
            load,
            today: gains.today[step],
        },
    })
}

/// How far each rate misses the law of one lane, as z squared of its error as it was before any doubt; the
/// law over the whole record.
pub(super) fn misses<const TOGETHER: usize>(
    record: &RateRecord,
    predicted: &[[f64; TOGETHER]],
    (lane, scatter): (usize, f64),
    gains: &Gains,
) -> Vec<f64> {
    let count = record.ln_velocity.len();
    let mut squares = vec![0.0; count];
    let (mut load, mut level, mut end) = (0.0, 0.0, 0.0);
    for (step, gain) in gains.steps.iter().enumerate() {
        let index = count - 1 - step;
        load *= gain.keep;
        let miss = record.ln_velocity[index]
            - predicted[index][lane]
            - gain.sees * load
            - level
            - gain.shared * end;
        let doubted = record.variance(index, scatter) * (1.0 - record.trust[index]);
        squares[index] = miss * miss / (1.0 / gain.precision - doubted).max(1e-12);
        load += gain.load * miss;
        level += gain.level * miss;
        end = gain.end * miss;
    }
    squares
}

/// ln of the evidence of the rates before each one, by a velocity that is a random walk, and of the prior of a start there.
pub(super) fn before_the_law(record: &RateRecord, scatter: f64) -> Vec<f64> {
    let count = record.ln_velocity.len();
    let drifts = record.assumed.drifts_before;
    let mut total = vec![0.0_f64; count];
    let mut each = vec![[0.0_f64; MOST_DRIFTS]; count];
    for (which, drift) in drifts.iter().enumerate() {
        let (mut level, mut variance, mut ln) = (0.0, LEVEL_VARIANCE, 0.0);
        for (index, slot) in each.iter_mut().enumerate() {
            slot[which] = ln;
            if index > 0 {
                variance += drift * drift;
            }
            let s = (variance + record.variance(index, scatter)).max(1e-12);
            let miss = record.ln_velocity[index] - level;
            ln -= 0.5 * (miss * miss / s + s.ln());
            level += variance / s * miss;
            variance -= variance * variance / s;
        }
    }
    for (index, (slot, each)) in total.iter_mut().zip(&each).enumerate() {
        let each = &each[..drifts.len()];
        let best = each.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = each.iter().map(|ln| (ln - best).exp()).sum();
        *slot = best + (sum / drifts.len() as f64).ln();
        if let Some(first) = record.assumed.from_the_first {
            *slot += ln_prior_of_start(record, index, first);
        }
    }
    total
}

/// ln of the prior that the law begins with that rate: with the first one with that probability, or else later, even in the
/// logarithm of its distance from the present.
pub(super) fn ln_prior_of_start(record: &RateRecord, index: usize, first: f64) -> f64 {
    let newest = record.from.len().saturating_sub(FEWEST_UNDER_THE_LAW);
    if index == 0 || newest == 0 {
        return first.ln();
    }
    let ago = |index: usize| record.from[index].max(1e-9);
    let share = (ago(index - 1) / ago(index)).ln() / (ago(0) / ago(newest)).ln();
    ((1.0 - first) * share.max(1e-12)).ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::under_load::gains::{LoadMemory, LoadNoise};
    use nalgebra::{DMatrix, DVector};

    const SCATTER: f64 = 0.1;
    const SHARED: f64 = 0.7;

    fn record() -> RateRecord {
        RateRecord {
            ln_velocity: vec![0.3, -0.2, 0.15, 0.4, -0.1],
            white: vec![0.5, 1.0, 1.0, 1.0, 1.0],
            ..RateRecord::of_five()
        }
    }

    #[test]
    fn differences_that_share_a_reading_are_as_likely_as_their_normal_density_says() {
        let record = record();
        let noise = LoadNoise {
            scatter: SCATTER,
            sigma: 0.0,
            tau: 1.0,
            shared: SHARED,
            ln_evidence: 0.0,
        };
        let memory = LoadMemory::new(&record, &noise);
        let gains = Gains::new(&record, &memory, &[0.0; 5], &[0.0; 5]);
        let mut room = Room::default();
        weigh(&record, &[[0.05]; 5], &gains, f64::NEG_INFINITY, &mut room);
        let ends = |index: usize| (0.5 * SHARED / record.trust[index]).sqrt() * record.error[index];
        let covariance = DMatrix::from_fn(5, 5, |i, j| {
            let level = LEVEL_VARIANCE;
            if i == j {
                level + record.variance(i, SCATTER)
            } else if i.abs_diff(j) == 1 && i.min(j) != 2 {
                level - ends(i) * ends(j)
            } else {
                level
            }
        });
        let miss = DVector::from_iterator(5, record.ln_velocity.iter().map(|ln| ln - 0.05));
        let inverse = covariance.clone().try_inverse().unwrap();
        let square = (miss.transpose() * inverse * &miss)[(0, 0)];
        let want = -0.5 * (square + covariance.determinant().ln());
        let got = room.ln_evidence[4][0];
        assert!((got - want).abs() < 1e-9, "{got} {want}");
    }

    #[test]
    fn a_start_has_its_share_of_all_of_them() {
        let record = record();
        let noise = LoadNoise {
            scatter: SCATTER,
            sigma: 0.1,
            tau: 1.0,
            shared: 0.0,
            ln_evidence: 0.0,
        };
        let memory = LoadMemory::new(&record, &noise);
        let before = before_the_law(&record, SCATTER);
        let gains = Gains::new(&record, &memory, &[0.0; 5], &before);
        let mut room = Room::default();
        weigh(&record, &[[0.0]; 5], &gains, f64::NEG_INFINITY, &mut room);
        let rates = |share: f64| start_at(&gains, &room, share).unwrap().rates;
        let [four, five] = [3, 4].map(|step: usize| room.ln_evidence[step][0].exp());
        let share_of_four = four / (four + five);
        assert_eq!(rates(share_of_four - 1e-6), 4);
        assert_eq!(rates(share_of_four + 1e-6), 5);
    }
}

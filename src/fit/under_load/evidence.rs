//! The evidence of four shapes of the law at one slope, summed over every start that the law may have.

use super::gains::{Gains, LEVEL_VARIANCE, RateRecord};
use super::shape::{BLOCKS, Block, LANES, TablePlace};

/// Rates that a law must explain, at least.
const FEWEST_UNDER_THE_LAW: usize = 4;
/// Standard deviations, for one rate after another, of a velocity that follows no law.
const DRIFTS: [f64; 3] = [0.05, 0.15, 0.4];
/// Rates between two looks at whether a block can still count.
const LOOKED: usize = 8;
/// Starts this much less likely than the best, ln, are not counted.
const NEGLIGIBLE: f64 = 10.0;

/// The times of a record in units of one slope's time to failure.
#[derive(Debug, Clone)]
pub(super) struct SlopeTable {
    /// |r|, 1/day.
    pub(super) r: f64,
    /// ln(1 + |r| t) at the middle of each rate.
    pub(super) u: Vec<f64>,
    /// ln of the mean rate that each shape of each block predicts, in units of the velocity now; of blocks that nobody
    /// asks about none.
    predicted: Vec<Vec<[f64; LANES]>>,
}

/// Room for one evaluation, used again and again.
#[derive(Debug, Clone, Default)]
pub(super) struct Room {
    ln_evidence: Vec<[f64; LANES]>,
    today: Vec<[[f64; LANES]; 2]>,
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

/// The evidence of each shape of the block of that index. A shape whose evidence, ln, cannot reach `least` has none.
pub(super) fn weigh(
    record: &RateRecord,
    (block, slope): (usize, &SlopeTable),
    gains: &Gains,
    least: f64,
    room: &mut Room,
) -> [ShapeEvidence; LANES] {
    let predicted = &slope.predicted[block];
    room.ln_evidence.clear();
    room.today.clear();
    let count = record.ln_velocity.len();
    let [mut load, mut level, mut velocity_now, mut load_now, mut ln] = [[0.0; LANES]; 5];
    let first = FEWEST_UNDER_THE_LAW.min(count) - 1;
    let mut best = [f64::NEG_INFINITY; LANES];
    // The sum over starts is no more than all of them at the best.
    let least = least - ((count - first) as f64).ln();
    for (step, gain) in gains.steps.iter().enumerate() {
        // What a start has lost to its misses no older one wins back.
        if step % LOOKED == 0 && cannot_reach(least, &best, &ln, gains.most_outside[step]) {
            return [NO_EVIDENCE; LANES];
        }
        let index = count - 1 - step;
        let (read, predicted) = (record.ln_velocity[index], &predicted[index]);
        let outside = gains.outside[step];
        let mut total = [0.0; LANES];
        for lane in 0..LANES {
            load[lane] *= gain.keep;
            let miss = read - predicted[lane] - load[lane] - level[lane];
            ln[lane] -= 0.5 * miss * miss * gain.precision;
            load[lane] += gain.load * miss;
            level[lane] += gain.level * miss;
            velocity_now[lane] += gain.velocity_now * miss;
            load_now[lane] += gain.load_now * miss;
            total[lane] = ln[lane] + outside;
        }
        room.ln_evidence.push(total);
        room.today.push([velocity_now, load_now]);
        if step >= first {
            for (best, total) in best.iter_mut().zip(total) {
                *best = if total > *best { total } else { *best };
            }
        }
    }
    std::array::from_fn(|lane| {
        if best[lane].is_finite() && best[lane] >= least {
            over_starts(gains, room, (first, lane), best[lane])
        } else {
            NO_EVIDENCE
        }
    })
}

/// Whether no lane can reach `least`, of which `best` are the best starts so far, `ln` what the misses have cost, and
/// `most_outside` the most that an older start has beside them.
fn cannot_reach(least: f64, best: &[f64; LANES], ln: &[f64; LANES], most_outside: f64) -> bool {
    let mut lanes = best.iter().zip(ln);
    lanes.all(|(best, ln)| *best < least && ln + most_outside < least)
}

const NO_EVIDENCE: ShapeEvidence = ShapeEvidence {
    ln: f64::NEG_INFINITY,
    ln_velocity: 0.0,
    load: 0.0,
    today: [0.0; 3],
};

/// Over the starts of a lane from the first that may be, of which the best has that evidence, ln.
fn over_starts(
    gains: &Gains,
    room: &Room,
    (first, lane): (usize, usize),
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

/// How far each rate misses the law of one lane, as z squared of its error as it was before any doubt; the
/// law over the whole record.
pub(super) fn misses(
    record: &RateRecord,
    (block, slope): (usize, &SlopeTable),
    (lane, scatter): (usize, f64),
    gains: &Gains,
) -> Vec<f64> {
    let count = record.ln_velocity.len();
    let mut squares = vec![0.0; count];
    let (mut load, mut level) = (0.0, 0.0);
    for (step, gain) in gains.steps.iter().enumerate() {
        let index = count - 1 - step;
        load *= gain.keep;
        let miss = record.ln_velocity[index] - slope.predicted[block][index][lane] - load - level;
        let doubted = record.variance(index, scatter) * (1.0 - record.trust[index]);
        squares[index] = miss * miss / (1.0 / gain.precision - doubted).max(1e-12);
        load += gain.load * miss;
        level += gain.level * miss;
    }
    squares
}

/// ln of the evidence of the rates before each one, by a velocity that is a random walk.
pub(super) fn before_the_law(record: &RateRecord, scatter: f64) -> Vec<f64> {
    let count = record.ln_velocity.len();
    let mut total = vec![0.0_f64; count];
    let mut each = vec![[0.0_f64; DRIFTS.len()]; count];
    for (which, drift) in DRIFTS.iter().enumerate() {
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
    for (slot, each) in total.iter_mut().zip(&each) {
        let best = each.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = each.iter().map(|ln| (ln - best).exp()).sum();
        *slot = best + (sum / DRIFTS.len() as f64).ln();
    }
    total
}

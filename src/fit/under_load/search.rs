//! The search over slopes, shapes and noises: coarse, then fine where the evidence is.

use super::Cell;
use super::assumptions::Assumptions;
use super::evidence::{self, RecordTimes, Room, ShapeEvidence, SlopeTable, weigh};
use super::gains::{Gains, LoadMemory, LoadNoise, RateRecord};
use super::prior::{RARE, SlopePrior};
use super::shape::{BLOCKS, LANES, SHAPES};
use crate::fit::{Rate, ReadingError};
use crate::reading::upper_median;
use std::collections::BTreeMap;

/// Grids of the scatter of the readings, of the load's standard deviation, and of its memory over the span
/// of the newer half of the rates.
const SCATTERS: [f64; 2] = [0.02, 0.06];
const SIGMAS: [f64; 3] = [0.05, 0.12, 0.3];
const MEMORIES: [f64; 3] = [0.02, 0.08, 0.32];
/// Steps of ln r: in the coarse pass, and how many of the fine one make one of them.
const COARSE_STEP: f64 = 0.45;
const FINER: usize = 2;
/// Most slopes of the coarse pass.
const MOST_COARSE_SLOPES: usize = 40;
/// Most slopes of the fine pass, and most noises.
const MOST_FINE_SLOPES: usize = 32;
const MOST_NOISES: usize = 5;
/// What is this much less likely than the best, ln: shapes and slopes left out of the fine pass, noises
/// left out, and cells left out of the answer.
const LEFT_OUT: (f64, f64, f64) = (8.0, 4.0, 9.0);
/// Cells on which noises are compared.
const COMPARED: usize = 4;
/// The error of ln v where nothing moves.
const AT_REST: f64 = 1.5;
/// A velocity this many standard errors from its neighbours, so many on either side, is not like them.
const STANDS_OUT: f64 = 5.0;
const NEIGHBOURS: usize = 3;
/// Rates that say what the velocity of today is about.
const CENTRE: usize = 9;

/// A shape at a slope.
#[derive(Debug, Clone, Copy)]
struct Scored {
    ln: f64,
    block: usize,
    lane: usize,
    slope: usize,
}

pub(super) struct GridSearch {
    pub(super) record: RateRecord,
    pub(super) prior: SlopePrior,
    times: RecordTimes,
    /// The evidence of what came before each rate, by no law, for each scatter of the readings that was asked about since
    /// a rate was last doubted.
    befores: BTreeMap<u64, Vec<f64>>,
    coarse: usize,
    room: Room<LANES>,
}

impl GridSearch {
    pub(super) fn new(rates: &[Rate], assumed: &Assumptions) -> Self {
        let record = record(rates, assumed);
        let prior = SlopePrior::new(rates, record.from[0]);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small positive number"
        )]
        let coarse = ((prior.highest / prior.lowest).ln() / COARSE_STEP).ceil() as usize;
        Self {
            times: RecordTimes::of(&record),
            befores: BTreeMap::new(),
            record,
            prior,
            coarse: coarse.clamp(4, MOST_COARSE_SLOPES),
            room: Room::default(),
        }
    }

    /// The laws that the rates leave open; `None` where none has an evidence.
    pub(super) fn cells(&mut self, rates: &[Rate]) -> Option<Vec<Cell>> {
        let all = vec![true; BLOCKS.len()];
        let range = (self.prior.lowest, self.prior.highest);
        let coarse = self.slopes(range, self.coarse, &all);
        let mut noises = noises(rates);
        let mut scored: Vec<Scored> = Vec::new();
        for _ in 0..2 {
            let likeliest = scored.first().map_or(coarse.len() / 2, |best| best.slope);
            scored = self.sweep(&coarse, likeliest, &noises[0]);
            let best = *scored.first()?;
            self.doubt(&coarse, &best, &noises[0]);
            self.compare(&coarse, &scored, &mut noises);
        }
        let cells = self.fine(&scored, &noises);
        (!cells.is_empty()).then_some(cells)
    }

    /// `count` slopes at the middles of equal steps of ln r, to be asked about `blocks`.
    fn slopes(
        &self,
        (lowest, highest): (f64, f64),
        count: usize,
        blocks: &[bool],
    ) -> Vec<SlopeTable> {
        let at = |index: usize| (index as f64 + 0.5) / count as f64;
        (0..count)
            .map(|index| {
                let r = lowest * (highest / lowest).powf(at(index));
                SlopeTable::new(r, &self.times, blocks)
            })
            .collect()
    }

    /// Prior of a shape at a slope, with the velocity that it is found to have.
    fn ln_prior(&self, shape: usize, r: f64, evidence: &ShapeEvidence) -> f64 {
        let shape = &SHAPES[shape];
        let now = evidence.ln_velocity + self.record.centre;
        let kept = shape.ln_kept().map(|growth| now + growth);
        let kept = kept.filter(|_| self.record.assumed.keeps_little);
        self.prior.ln_prior(shape.ln_prior, r, kept)
    }

    /// The gains of a slope under a noise.
    fn gains(&mut self, slope: &SlopeTable, memory: &LoadMemory) -> Gains {
        let scatter = memory.scatter();
        let before = self
            .befores
            .entry(scatter.to_bits())
            .or_insert_with(|| evidence::before_the_law(&self.record, scatter));
        Gains::new(&self.record, memory, &slope.u, before)
    }

    /// Every shape at every slope under one noise, best first; the slopes next to `likeliest` are asked about first, so that
    /// the others are soon known not to count.
    fn sweep(&mut self, slopes: &[SlopeTable], likeliest: usize, noise: &LoadNoise) -> Vec<Scored> {
        let memory = LoadMemory::new(&self.record, noise);
        let mut scored = Vec::with_capacity(slopes.len() * SHAPES.len());
        let mut best = f64::NEG_INFINITY;
        for index in outwards(slopes.len(), likeliest) {
            let slope = &slopes[index];
            let gains = self.gains(slope, &memory);
            for (block, of) in BLOCKS.iter().enumerate() {
                let least = best - LEFT_OUT.0 - most_ln_prior(block, slope.r);
                let predicted = &slope.predicted[block];
                let found = weigh(&self.record, predicted, &gains, least, &mut self.room);
                for (lane, evidence) in found.iter().enumerate() {
                    let ln = evidence.ln + self.ln_prior(of.first + lane, slope.r, evidence);
                    if ln > best - LEFT_OUT.0 {
                        best = best.max(ln);
                        scored.push(Scored {
                            ln,
                            block,
                            lane,
                            slope: index,
                        });
                    }
                }
            }
        }
        scored.retain(|one| one.ln > best - LEFT_OUT.0);
        scored.sort_by(|a, b| b.ln.total_cmp(&a.ln));
        scored
    }

    /// Doubts the rates that the best law cannot explain.
    fn doubt(&mut self, slopes: &[SlopeTable], best: &Scored, noise: &LoadNoise) {
        let slope = &slopes[best.slope];
        let gains = self.gains(slope, &LoadMemory::new(&self.record, noise));
        let predicted = &slope.predicted[best.block];
        let at = (best.lane, noise.scatter);
        let squares = evidence::misses(&self.record, predicted, at, &gains);
        self.record.doubt(&squares);
        self.befores.clear();
    }

    /// Orders the noises by their evidence under the best law of each of the best few shapes.
    fn compare(&mut self, slopes: &[SlopeTable], scored: &[Scored], noises: &mut [LoadNoise]) {
        let mut chosen: Vec<Scored> = Vec::new();
        for one in scored {
            let new = |other: &Scored| (other.block, other.lane) != (one.block, one.lane);
            if chosen.iter().all(new) {
                chosen.push(*one);
            }
            if chosen.len() == COMPARED {
                break;
            }
        }
        // Those of one slope share its gains, those of one block its evaluation.
        chosen.sort_by_key(|one| (one.slope, one.block));
        for noise in noises.iter_mut() {
            let memory = LoadMemory::new(&self.record, noise);
            noise.ln_evidence = f64::NEG_INFINITY;
            for of_slope in chosen.chunk_by(|one, other| one.slope == other.slope) {
                let slope = &slopes[of_slope[0].slope];
                let gains = self.gains(slope, &memory);
                for of_block in of_slope.chunk_by(|one, other| one.block == other.block) {
                    let block = of_block[0].block;
                    let predicted = &slope.predicted[block];
                    let none = f64::NEG_INFINITY;
                    let found = weigh(&self.record, predicted, &gains, none, &mut self.room);
                    let each = of_block.iter().map(|one| {
                        found[one.lane].ln + SHAPES[BLOCKS[block].first + one.lane].ln_prior
                    });
                    noise.ln_evidence = each.fold(noise.ln_evidence, f64::max);
                }
            }
        }
        noises.sort_by(|a, b| b.ln_evidence.total_cmp(&a.ln_evidence));
    }

    /// The cells that count, with weights that sum to 1.
    fn fine(&mut self, scored: &[Scored], noises: &[LoadNoise]) -> Vec<Cell> {
        let blocks: Vec<bool> = (0..BLOCKS.len())
            .map(|block| scored.iter().any(|one| one.block == block))
            .collect();
        let slopes = || scored.iter().map(|one| one.slope);
        let (first, last) = (slopes().min().unwrap_or(0), slopes().max().unwrap_or(0));
        let best = scored.first().map_or(first, |one| one.slope);
        let at = |index: f64| {
            let share = (index / self.coarse as f64).clamp(0.0, 1.0);
            self.prior.lowest * (self.prior.highest / self.prior.lowest).powf(share)
        };
        let count = ((last - first + 3) * FINER).min(MOST_FINE_SLOPES);
        let range = (at(first as f64 - 1.0), at(last as f64 + 2.0));
        let slopes = self.slopes(range, count, &blocks);
        let likeliest = (best - first + 1) * count / (last - first + 3);
        let likely = noises[0].ln_evidence - LEFT_OUT.1;
        let likely = noises.iter().take_while(|noise| noise.ln_evidence > likely);
        let (mut cells, mut heaviest) = (Vec::new(), f64::NEG_INFINITY);
        for (rank, noise) in likely.take(MOST_NOISES).enumerate() {
            let memory = LoadMemory::new(&self.record, noise);
            for index in outwards(slopes.len(), likeliest) {
                let slope = &slopes[index];
                let gains = self.gains(slope, &memory);
                for block in (0..BLOCKS.len()).filter(|block| blocks[*block]) {
                    let predicted = &slope.predicted[block];
                    let least = heaviest - LEFT_OUT.2 - most_ln_prior(block, slope.r);
                    let found = weigh(&self.record, predicted, &gains, least, &mut self.room);
                    for (lane, evidence) in found.iter().enumerate() {
                        let cell = self.cell(BLOCKS[block].first + lane, slope, noise, evidence);
                        if cell.weight > heaviest - LEFT_OUT.2 {
                            heaviest = heaviest.max(cell.weight);
                            cells.push(((rank, index, cell.shape), cell));
                        }
                    }
                }
            }
        }
        cells.sort_by_key(|(place, _)| *place);
        normalise(cells.into_iter().map(|(_, cell)| cell).collect())
    }

    /// A cell whose weight is still the ln of what it is to be.
    fn cell(
        &self,
        shape: usize,
        slope: &SlopeTable,
        noise: &LoadNoise,
        evidence: &ShapeEvidence,
    ) -> Cell {
        Cell {
            shape,
            r: slope.r,
            sigma: noise.sigma,
            tau: noise.tau,
            ln_velocity: evidence.ln_velocity + self.record.centre,
            load: evidence.load,
            variances: (evidence.today[0].max(0.0), evidence.today[1].max(0.0)),
            covariance: evidence.today[2],
            scatter: noise.scatter,
            weight: evidence.ln + self.ln_prior(shape, slope.r, evidence),
        }
    }
}

/// The most that the prior of a shape of the block can be at a slope, whatever velocity it is found to have.
fn most_ln_prior(block: usize, r: f64) -> f64 {
    let first = BLOCKS[block].first;
    let each = SHAPES[first..first + LANES].iter();
    let most = each
        .map(|shape| shape.ln_prior)
        .fold(f64::NEG_INFINITY, f64::max);
    most - RARE * r.ln()
}

/// Every index under `count`, those next to `middle` first.
fn outwards(count: usize, middle: usize) -> Vec<usize> {
    let mut indices: Vec<usize> = (0..count).collect();
    indices.sort_by_key(|index| index.abs_diff(middle));
    indices
}

fn normalise(mut cells: Vec<Cell>) -> Vec<Cell> {
    let best = cells
        .iter()
        .map(|cell| cell.weight)
        .fold(f64::NEG_INFINITY, f64::max);
    if !best.is_finite() {
        return Vec::new();
    }
    cells.retain(|cell| cell.weight > best - LEFT_OUT.2);
    let total: f64 = cells.iter().map(|cell| (cell.weight - best).exp()).sum();
    for cell in &mut cells {
        cell.weight = (cell.weight - best).exp() / total;
    }
    cells
}

/// Every point of the grids; the middle one first, to begin with.
fn noises(rates: &[Rate]) -> Vec<LoadNoise> {
    let span = rates[rates.len() - 1].to - rates[rates.len() / 2].from;
    let mut noises = Vec::new();
    for scatter in SCATTERS {
        for sigma in SIGMAS {
            for memory in MEMORIES {
                noises.push(LoadNoise {
                    scatter,
                    sigma,
                    tau: (memory * span).max(1e-9),
                    shared: 0.0,
                    ln_evidence: 0.0,
                });
            }
        }
    }
    let middle = noises.len() / SCATTERS.len() + SIGMAS.len() * MEMORIES.len() / 2;
    noises.swap(0, middle);
    noises
}

/// Rates as logarithms. One within its noise is read as little more than "no faster than its error": half
/// of v + sqrt(v^2 + 4 s^2) is v where it is clear of its error s, and s at rest. One at rest or backward
/// whose error is not known is read as half of the slowest that moved, give or take e^1.5.
fn record(rates: &[Rate], assumed: &Assumptions) -> RateRecord {
    let now = rates.last().map_or(0.0, |rate| rate.to);
    let moving = rates.iter().map(|rate| rate.velocity).filter(|v| *v > 0.0);
    let at_rest = 0.5 * moving.fold(f64::INFINITY, f64::min);
    let forward = |rate: &Rate| {
        let clear = 0.5 * (rate.velocity + rate.velocity.hypot(2.0 * rate.sigma));
        clear.max(if rate.velocity > 0.0 { 1e-9 } else { at_rest })
    };
    let error = |rate: &Rate| {
        if rate.velocity > 0.0 {
            (rate.sigma / forward(rate)).min(AT_REST)
        } else {
            AT_REST
        }
    };
    let mut newest: Vec<f64> = rates.iter().rev().take(CENTRE).map(forward).collect();
    let centre = upper_median(&mut newest).unwrap_or(AT_REST).ln();
    let mut record = RateRecord {
        ln_velocity: rates
            .iter()
            .map(|rate| forward(rate).ln() - centre)
            .collect(),
        error: rates.iter().map(error).collect(),
        middle: rates.iter().map(|rate| now - rate.middle()).collect(),
        from: rates.iter().map(|rate| now - rate.from).collect(),
        to: rates.iter().map(|rate| now - rate.to).collect(),
        centre,
        trust: vec![1.0; rates.len()],
        is_of_ends: vec![false; rates.len()],
        white: vec![1.0; rates.len()],
        assumed: *assumed,
    };
    if assumed.follows_errors {
        follow_errors(&mut record, rates);
    }
    record
}

/// Errors by the readings that they come from. A rate within its noise of its neighbours' mean is read on a straight line about
/// that, and not by its logarithm: noise moves both ways alike, and counts for as much where it is high.
fn follow_errors(record: &mut RateRecord, rates: &[Rate]) {
    for (index, rate) in rates.iter().enumerate() {
        record.is_of_ends[index] = rate.error == ReadingError::OfEnds;
        record.white[index] = 1.0 / f64::from(rate.readings.max(1));
        let near = index.saturating_sub(NEIGHBOURS)..(index + NEIGHBOURS + 1).min(rates.len());
        let others = (near.len() - 1).max(1) as f64;
        let sum: f64 = rates[near].iter().map(|rate| rate.velocity).sum();
        let about = (sum - rate.velocity) / others;
        if rate.sigma > 0.0 && (rate.velocity - about).abs() <= STANDS_OUT * rate.sigma {
            let about = about.max(0.5 * rate.sigma);
            record.ln_velocity[index] =
                about.ln() + (rate.velocity - about) / about - record.centre;
            record.error[index] = rate.sigma / about;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_and_blocks_cover_every_shape_once() {
        let firsts: Vec<usize> = BLOCKS.iter().map(|block| block.first).collect();
        assert_eq!(firsts.len() * LANES, SHAPES.len());
        let total: f64 = SHAPES.iter().map(|shape| shape.ln_prior.exp()).sum();
        assert!((total - 1.0).abs() < 1e-12, "{total}");
    }
}

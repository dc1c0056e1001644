//! A population of laws that walks over the posterior: each is moved along the difference of two others (differential
//! evolution, ter Braak 2006), so that steps have the posterior's own shape and size.

use super::Cell;
use super::evidence::{self, StartedLaw};
use super::gains::RateRecord;
use super::modes::{Mode, modes, modes_from};
use super::search::GridSearch;
use super::space::{DrawnShape, Point, SCATTER, Space};
use super::weigher::LawWeigher;
use crate::model::Law;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// Laws in the population, and of how many about the table's laws and about the likeliest ones each is chosen.
const WALKERS: usize = 64;
const CHOSEN_FROM: usize = 3;
const CHOSEN_ABOUT_MODES: usize = 6;
/// How many where it begins again, so many of which count at least; the lowest power of the posterior that they are chosen by.
const ABOUT_MODES_AGAIN: usize = 12;
const ENOUGH_APART: f64 = 32.0;
const LEAST_POWER: f64 = 1e-4;
/// Densities of one mode, ln, and by how much a likelier law leaves no doubt that a population is not about it.
const SAME: f64 = 1e-3;
const LIKELIER: f64 = 4.0;
/// So much less likely than the best, ln, are one in a thousand of a normal posterior of seven dimensions; laws that a population goes on
/// from at least.
const FAR_BEHIND: f64 = 12.5;
const FEWEST_KEPT: usize = 16;
/// Steps along differences, over the size that is best for a normal posterior: 2.38 over the root of twice its dimensions.
const STEP: f64 = 0.636;
/// One round in this many goes the whole difference, from one mode to another.
const WHOLE: usize = 8;
/// How much the size of a step varies, and what is added to it, in standard deviations of the population.
const VARIED: f64 = 0.2;
const JITTER: f64 = 1e-3;
/// The seed: the same readings give the same laws.
const SEED: u64 = 2004;

/// One law of the population.
#[derive(Debug, Clone, Copy)]
struct Member {
    at: Point,
    ln: f64,
}

/// A law that was drawn, with where it starts.
#[derive(Debug, Clone, Copy)]
pub(super) struct DrawnLaw {
    pub(super) shape: DrawnShape,
    pub(super) started: StartedLaw,
    /// ln v less the record's centre, and its variance: of the law under today's load where that changes, or else without what
    /// the readings scatter by.
    pub(super) level: (f64, f64),
    /// Variance of a reading about the law.
    pub(super) variance: f64,
    /// A standard normal number for its velocity.
    pub(super) deviate: f64,
    /// ln of its posterior density.
    pub(super) ln: f64,
}

/// A population on its way.
pub(super) struct Population {
    scales: LawWeigher,
    members: Vec<Member>,
    generator: Pcg64,
    rounds: usize,
    /// The likeliest laws that a descent found.
    modes: Vec<Point>,
}

/// Which of those with these shares of 1 are taken, each as often as its share has it, `wanted` times in all.
fn in_proportion(shares: impl Iterator<Item = f64>, wanted: usize) -> Vec<usize> {
    let (mut reached, mut taken) = (0.0, Vec::with_capacity(wanted));
    for (index, share) in shares.enumerate() {
        reached += share;
        while (taken.len() as f64 + 0.5) < reached * wanted as f64 && taken.len() < wanted {
            taken.push(index);
        }
    }
    taken
}

/// What each has of the root of the posterior, of whose density these are the logarithms; nothing where none has any.
fn shares_of_root(lns: impl Iterator<Item = f64> + Clone) -> Vec<f64> {
    shares_of_power(lns, 0.5)
}

/// The same of another power of it.
fn shares_of_power(lns: impl Iterator<Item = f64> + Clone, power: f64) -> Vec<f64> {
    let best = lns.clone().fold(f64::NEG_INFINITY, f64::max);
    if !best.is_finite() {
        return Vec::new();
    }
    let weights = lns.map(|ln| (power * (ln - best)).exp());
    let total: f64 = weights.clone().sum();
    weights.map(|weight| weight / total).collect()
}

impl Population {
    /// A population about the laws of the table, each in proportion to its weight.
    pub(super) fn about(cells: &[Cell], search: GridSearch) -> Option<Self> {
        let GridSearch { record, prior, .. } = search;
        let mut population = Self {
            scales: LawWeigher::new(Space::new(prior, &record), record),
            members: Vec::new(),
            generator: Pcg64::seed_from_u64(SEED),
            rounds: 0,
            modes: Vec::new(),
        };
        let mut tried: Vec<Member> =
            Vec::with_capacity(WALKERS * (CHOSEN_FROM + CHOSEN_ABOUT_MODES));
        let weights = cells.iter().map(|cell| cell.weight);
        for index in in_proportion(weights, WALKERS * CHOSEN_FROM) {
            let at = population
                .scales
                .space
                .near(&cells[index], &mut population.generator);
            tried.push(population.member(at));
        }
        population.try_modes(cells, &mut tried);
        population.choose(&tried);
        (!population.members.is_empty()).then_some(population)
    }

    /// Laws about the likeliest ones, of each as many as it has of the root of the posterior.
    fn try_modes(&mut self, cells: &[Cell], tried: &mut Vec<Member>) {
        let modes = modes(cells, &mut self.scales);
        self.modes = modes.iter().map(|(_, mode)| mode.at).collect();
        let shares = shares_of_root(modes.iter().map(|(_, mode)| mode.ln));
        let chosen = in_proportion(shares.into_iter(), WALKERS * CHOSEN_ABOUT_MODES);
        for (drawn, index) in chosen.into_iter().enumerate() {
            let ((cell, mode), space) = (&modes[index], &self.scales.space);
            let mut near = space.near(cell, &mut self.generator);
            if drawn % 2 == 0 {
                near = space.without_memory(&near, &mut self.generator);
            }
            let at = mode.draw(&near, &mut self.generator);
            tried.push(self.member(at));
        }
    }

    /// A law of the population there.
    fn member(&mut self, at: Point) -> Member {
        let ln = self.scales.ln_posterior(&at, f64::NEG_INFINITY);
        Member { at, ln }
    }

    /// Chooses the population: by the root of the posterior, so that it is wider than that.
    fn choose(&mut self, tried: &[Member]) {
        let shares = shares_of_root(tried.iter().map(|one| one.ln));
        let chosen = in_proportion(shares.into_iter(), WALKERS);
        self.members = chosen.into_iter().map(|index| tried[index]).collect();
    }

    /// Begins again about the likeliest laws that a descent finds from these laws of today, from the best of the population, and from
    /// those that were found before. So many are drawn about them, and chosen by so low a power of the posterior, that the
    /// population does not begin as a few laws.
    pub(super) fn begin_again(&mut self, laws: &[Law]) {
        self.scales.record.trust.fill(1.0);
        let found = self.find_modes(laws);
        let likeliest = found.iter().max_by(|a, b| a.ln.total_cmp(&b.ln));
        let Some(likeliest) = likeliest.map(|mode| mode.at) else {
            return;
        };
        self.doubt_by(&likeliest);
        let found = self.find_modes(laws);
        self.modes = found.iter().map(|mode| mode.at).collect();
        let shares = shares_of_root(found.iter().map(|mode| mode.ln));
        let mut tried = Vec::new();
        for (drawn, index) in in_proportion(shares.into_iter(), WALKERS * ABOUT_MODES_AGAIN)
            .into_iter()
            .enumerate()
        {
            let (mode, space) = (&found[index], &self.scales.space);
            let near = if drawn % 2 == 0 {
                space.without_memory(&mode.at, &mut self.generator)
            } else {
                space.with_any_memory(&mode.at, &mut self.generator)
            };
            let at = mode.draw(&near, &mut self.generator);
            tried.push(self.member(at));
        }
        self.choose_many(&tried);
    }

    /// The modes found from these laws, from the best of the population and from the modes so far.
    fn find_modes(&mut self, laws: &[Law]) -> Vec<Mode> {
        let best = self.members.iter().max_by(|a, b| a.ln.total_cmp(&b.ln));
        let mut starts: Vec<Point> = best.map(|best| best.at).into_iter().collect();
        starts.extend(&self.modes);
        let scatter = best.map_or(0.01, |best| best.at[SCATTER].exp());
        let space = &self.scales.space;
        starts.extend(laws.iter().filter_map(|law| space.of_law(law, scatter)));
        let each = starts.iter();
        let mut found: Vec<Mode> = each
            .flat_map(|start| modes_from(start, &mut self.scales))
            .collect();
        // A law that two descents ended at counts once.
        found.sort_by(|a, b| b.ln.total_cmp(&a.ln));
        found.dedup_by(|a, b| (a.ln - b.ln).abs() < SAME);
        found
    }

    /// Chooses the population by the root of the posterior, or by as much a lower power as leaves it enough different laws.
    fn choose_many(&mut self, tried: &[Member]) {
        let mut power = 0.5;
        loop {
            let shares = shares_of_power(tried.iter().map(|one| one.ln), power);
            if shares.is_empty() {
                return;
            }
            let squares: f64 = shares.iter().map(|share| share * share).sum();
            if squares * ENOUGH_APART <= 1.0 || power < LEAST_POWER {
                let chosen = in_proportion(shares.into_iter(), WALKERS);
                self.members = chosen.into_iter().map(|index| tried[index]).collect();
                return;
            }
            power *= 0.5;
        }
    }

    /// Laws of the population that are far less likely than its best come to rest late: each is put where one of the others is.
    pub(super) fn leave_behind(&mut self) {
        let lns = self.members.iter().map(|one| one.ln);
        let least = lns.fold(f64::NEG_INFINITY, f64::max) - FAR_BEHIND;
        let kept = self.members.iter().filter(|one| one.ln >= least);
        let kept: Vec<Member> = kept.copied().collect();
        if kept.len() < FEWEST_KEPT {
            return;
        }
        for member in &mut self.members {
            if member.ln < least {
                *member = kept[self.generator.random_range(0..kept.len())];
            }
        }
    }

    /// Whether a law that a descent found is likelier than this by so much that the population cannot be about it.
    pub(super) fn knows_likelier(&mut self, ln: f64) -> bool {
        let scales = &mut self.scales;
        let mut each = self.modes.iter();
        each.any(|mode| scales.ln_posterior(mode, f64::NEG_INFINITY) > ln + LIKELIER)
    }

    /// Moves each law of the population once.
    pub(super) fn round(&mut self) {
        self.rounds += 1;
        let count = self.members.len();
        let jitter_sd = self.spread() * JITTER;
        let step = if self.rounds.is_multiple_of(WHOLE) {
            1.0
        } else {
            STEP
        };
        for index in 0..count {
            let other = |away: usize| (index + away) % count;
            let one = other(self.generator.random_range(1..count.max(2)));
            let two = other(self.generator.random_range(1..count.max(2)));
            let size: f64 = self.generator.sample(StandardNormal);
            let along = self.members[one].at - self.members[two].at;
            let jitter = Point::from_fn(|_, _| self.generator.sample::<f64, _>(StandardNormal));
            let size = if step < 1.0 {
                step * (VARIED * size).exp()
            } else {
                step
            };
            let at = self.members[index].at + along * size + jitter.component_mul(&jitter_sd);
            let ln_uniform = self.generator.random::<f64>().max(1e-300).ln();
            let least = self.members[index].ln + ln_uniform;
            let ln = self.scales.ln_posterior(&at, least);
            if ln >= least {
                self.members[index] = Member { at, ln };
            }
        }
    }

    /// Standard deviations of the population.
    fn spread(&self) -> Point {
        let count = self.members.len() as f64;
        let mean = self.members.iter().map(|one| one.at).sum::<Point>() / count;
        let squares = self
            .members
            .iter()
            .map(|one| (one.at - mean).map(|away| away * away));
        (squares.sum::<Point>() / count).map(f64::sqrt)
    }

    /// Doubts the rates that the best law so far cannot explain, and weighs the population again.
    pub(super) fn doubt(&mut self) {
        let best = self.members.iter().max_by(|a, b| a.ln.total_cmp(&b.ln));
        if let Some(at) = best.map(|best| best.at) {
            self.doubt_by(&at);
        }
    }

    /// Doubts the rates that this law cannot explain, and weighs the population again.
    fn doubt_by(&mut self, at: &Point) {
        let scales = &mut self.scales;
        let (_, gains, _) = scales.weigh(at, f64::NEG_INFINITY);
        let lane = (0, scales.space.noise(at).scatter);
        let squares = evidence::misses(&scales.record, &scales.predicted, lane, &gains);
        scales.record.doubt(&squares);
        for member in &mut self.members {
            member.ln = scales.ln_posterior(&member.at, f64::NEG_INFINITY);
        }
    }

    /// The population as it is, each law with a start and a velocity drawn.
    pub(super) fn draw(&mut self) -> Vec<DrawnLaw> {
        let mut drawn = Vec::with_capacity(self.members.len());
        for member in &self.members {
            let (_, gains, shape) = self.scales.weigh(&member.at, f64::NEG_INFINITY);
            let shares = [0; 2].map(|_| self.generator.random::<f64>());
            let noise = self.scales.space.noise(&member.at);
            let deviate = self.generator.sample(StandardNormal);
            let scales = &self.scales;
            let started = evidence::start_at(&gains, &scales.room, shares[0]);
            drawn.extend(started.map(|started| DrawnLaw {
                shape,
                level: scales.level(&gains, &started, shares[1]),
                started,
                variance: noise.scatter.powi(2) + noise.sigma.powi(2),
                deviate,
                ln: member.ln,
            }));
        }
        drawn
    }

    /// The record that the laws are weighed with.
    pub(super) fn record(&self) -> &RateRecord {
        &self.scales.record
    }

    /// Laws weighed so far.
    pub(super) fn evaluations(&self) -> usize {
        self.scales.evaluations
    }
}

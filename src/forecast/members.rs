//! The members of the panel: what each says of the time of failure, and how it has done so far on this slope.

use super::panel::measurably_moves;
use super::{HORIZON_DAYS, InverseVelocityLine};
use crate::fit::{FINEST_DAYS, LoadPosterior, Rate};

/// Rates in the trailing windows of the lines.
pub const LINES: [usize; 8] = [8, 12, 16, 24, 32, 48, 64, 96];
/// The law, the lines, and one that says that the slope will stand.
pub const MEMBERS: usize = LINES.len() + 2;
/// What the weights depend on: a constant, how sure the law is of a failure and of its time, how far the lines
/// disagree, and how many of them fall.
pub const FEATURES: usize = 5;

/// The law's passages are followed so far, days.
const FARTHEST_DAYS: f64 = 10.0 * HORIZON_DAYS;
/// A line that meets zero after more lengths of the record than this says nothing.
const FARTHEST_LENGTHS: f64 = 3.0;
/// Rates on which a line is scored: each foretold from those before it.
const SCORED: usize = 6;
/// The worst score of one rate, ln of predicted over read, which a rate beyond the line's failure gets.
const WORST: f64 = 3.0;
/// The score of what was never tried.
const UNTRIED: f64 = 1.0;
/// One of so many newest rates goes forward where the slope does: a reading of nothing must hide no failure.
const GOES_ON: usize = 3;
/// A line is heard as far as the law sees a failure possible within so many times as long as the line says.
const AS_LONG: f64 = 3.0;
/// A probability is no nearer to 0 or 1 than this.
const SURE: f64 = 0.002;
/// A spread of the law's times, ln of the ratio of their quartiles, is no wider than this.
const WIDEST: f64 = 3.0;
/// Lines disagree by no more than this, the standard deviation of ln of their times; and by this where there are
/// too few to tell.
const DISAGREEMENT: (f64, f64) = (2.0, 1.5);

/// What the members say at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Members {
    /// The law under an undeclared load: (days from now, probability), in increasing time.
    pub law: Vec<(f64, f64)>,
    /// Days from now to where each line meets zero; `None` where it says nothing.
    pub lines: [Option<f64>; LINES.len()],
    /// How far each member was off lately: mean |ln(predicted / read velocity)|, 0 for those that are not lines.
    pub misses: [f64; MEMBERS],
    /// Between the newest readings, days.
    pub interval_days: f64,
}

impl Members {
    /// What the members make of `rates`, oldest first, as seen at `now_days`; `critical` is in mm/day. `None`
    /// where the slope does not measurably move.
    pub fn of(
        rates: &[Rate],
        posterior: Option<&LoadPosterior>,
        critical: f64,
        now_days: f64,
    ) -> Option<Self> {
        let posterior = posterior?;
        if !measurably_moves(rates) {
            return None;
        }
        let length = rates.last()?.to - rates.first()?.from;
        let later = now_days - posterior.now_days;
        let mut law = posterior.passages(critical, FARTHEST_DAYS + later);
        for (days, _) in &mut law {
            *days = (*days - later).max(0.0);
        }
        law.sort_by(|a, b| a.0.total_cmp(&b.0));
        // What does not go forward now does not accelerate, whatever it did.
        let newest = &rates[rates.len().saturating_sub(GOES_ON)..];
        let goes_on = newest.iter().any(InverseVelocityLine::takes);
        let meets = |window: usize| {
            if !goes_on {
                return None;
            }
            let days = through(rates, window)?.intercept_days? - now_days;
            (days > 0.0 && days <= FARTHEST_LENGTHS * length).then_some(days)
        };
        let mut misses = [0.0; MEMBERS];
        for (miss, window) in misses[1..].iter_mut().zip(LINES) {
            *miss = missed(rates, window);
        }
        Some(Self {
            law,
            lines: LINES.map(meets),
            misses,
            interval_days: interval(rates),
        })
    }

    /// What the weights depend on.
    pub fn features(&self) -> [f64; FEATURES] {
        let passes = self.chance(HORIZON_DAYS).clamp(SURE, 1.0 - SURE);
        let total = self.chance(f64::INFINITY);
        let quartile = |share| self.quantile(share * total).max(FINEST_DAYS);
        let spread = (quartile(0.75) / quartile(0.25)).ln();
        let spread = if self.law.is_empty() { WIDEST } else { spread };
        let (disagreement, falling) = self.agreement();
        [
            1.0,
            (passes / (1.0 - passes)).ln(),
            spread.min(WIDEST),
            disagreement,
            falling,
        ]
    }

    /// What each member's weight is multiplied by: a line's, by the law's chance of a failure within three times as
    /// long as the line says. Lines through the noise of a slope at rest meet zero as soon as any.
    pub fn room(&self) -> [f64; MEMBERS] {
        let mut room = [1.0; MEMBERS];
        for (room, line) in room[1..].iter_mut().zip(&self.lines) {
            let possible = line.map_or(1.0, |days| self.chance(AS_LONG * days));
            *room = possible.clamp(SURE, 1.0);
        }
        room
    }

    /// How far the lines disagree, and the share of them that fall.
    fn agreement(&self) -> (f64, f64) {
        let times = self.lines.iter().flatten();
        let times: Vec<f64> = times.map(|days| days.max(FINEST_DAYS).ln()).collect();
        let count = times.len() as f64;
        let falling = count / LINES.len() as f64;
        if times.len() < 2 {
            return (DISAGREEMENT.1, falling);
        }
        let mean = times.iter().sum::<f64>() / count;
        let square = times.iter().map(|time| (time - mean).powi(2)).sum::<f64>();
        ((square / count).sqrt().min(DISAGREEMENT.0), falling)
    }

    fn chance(&self, days: f64) -> f64 {
        let within = self.law.iter().take_while(|(time, _)| *time <= days);
        within.map(|(_, share)| share).sum()
    }

    fn quantile(&self, share: f64) -> f64 {
        let mut reached = 0.0;
        for (days, weight) in &self.law {
            reached += weight;
            if reached >= share {
                return *days;
            }
        }
        self.law.last().map_or(0.0, |(days, _)| *days)
    }
}

/// The line through the newest `window` rates that stand clear of their noise.
fn through(rates: &[Rate], window: usize) -> Option<InverseVelocityLine> {
    let clear = |rate: &&Rate| InverseVelocityLine::takes(rate);
    let mut newest: Vec<Rate> = rates
        .iter()
        .rev()
        .filter(clear)
        .take(window)
        .copied()
        .collect();
    newest.reverse();
    InverseVelocityLine::fit(&newest)
}

/// How far the line was off on the newest rates, each foretold from those before it.
fn missed(rates: &[Rate], window: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for back in 1..=SCORED.min(rates.len()) {
        let (past, next) = (&rates[..rates.len() - back], &rates[rates.len() - back]);
        if !InverseVelocityLine::takes(next) {
            continue;
        }
        let Some(line) = through(past, window) else {
            continue;
        };
        let foretold = line.at(next.middle());
        let miss = if foretold > 0.0 {
            (foretold * next.velocity).ln().abs().min(WORST)
        } else {
            WORST
        };
        sum += miss;
        count += 1.0;
    }
    if count > 0.0 { sum / count } else { UNTRIED }
}

/// The middle one of the newest spans between rates: one gap says nothing of the sampling.
fn interval(rates: &[Rate]) -> f64 {
    let newest = &rates[rates.len().saturating_sub(5)..];
    let mut spans: Vec<f64> = newest
        .windows(2)
        .map(|pair| pair[1].to - pair[0].to)
        .collect();
    spans.sort_by(f64::total_cmp);
    spans
        .get(spans.len() / 2)
        .map_or(FINEST_DAYS, |span| span.max(1e-6))
}

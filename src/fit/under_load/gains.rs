//! The linear filter of ln v less the law, from the present into the past: how much each rate moves it.
//!
//! The state is the load f, the level l of ln v about the law, and two things of today that stay: ln v and
//! f. Variances do not depend on what is read, so a table of gains serves every shape.

use super::assumptions::Assumptions;
use nalgebra::Matrix3;

/// The rates as the filter sees them.
#[derive(Debug, Clone)]
pub(super) struct RateRecord {
    /// ln of the velocity less `centre`, oldest first, and its standard error.
    pub(super) ln_velocity: Vec<f64>,
    pub(super) error: Vec<f64>,
    /// Days before the present: middle, start and end of each rate.
    pub(super) middle: Vec<f64>,
    pub(super) from: Vec<f64>,
    pub(super) to: Vec<f64>,
    pub(super) centre: f64,
    /// Weight of each rate, 1 but for outliers.
    pub(super) trust: Vec<f64>,
    /// Whether the error comes from the readings at the two ends, of which each may be the neighbour's too.
    pub(super) is_of_ends: Vec<bool>,
    /// The scatter's share of variance that is left in a rate that is a mean of several.
    pub(super) white: Vec<f64>,
    pub(super) assumed: Assumptions,
}

/// One guess at the load and at the scatter of the readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LoadNoise {
    pub(super) scatter: f64,
    pub(super) sigma: f64,
    /// LoadMemory of the load, days.
    pub(super) tau: f64,
    /// How much of the variance of a difference of readings is theirs, and so shared with its neighbours.
    pub(super) shared: f64,
    pub(super) ln_evidence: f64,
}

/// Prior variance of a level of ln v.
pub(super) const LEVEL_VARIANCE: f64 = 4.0;

/// What one rate moves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gain {
    /// The share of the load that is left from the rate after it, and how much of the load at its middle its mean shows.
    pub(super) keep: f64,
    pub(super) sees: f64,
    /// What the error of the reading at its end moves it by, where the rate after it begins with that reading; and what it
    /// moves of the error of the reading at its start.
    pub(super) shared: f64,
    pub(super) end: f64,
    pub(super) load: f64,
    pub(super) level: f64,
    pub(super) velocity_now: f64,
    pub(super) load_now: f64,
    /// One over the variance of the innovation.
    pub(super) precision: f64,
}

/// Gains for every rate, newest first.
#[derive(Debug, Clone)]
pub(super) struct Gains {
    pub(super) steps: Vec<Gain>,
    /// What the evidence of a law that starts at each rate has beside its misses, ln: the sum of -ln(variance)/2 up to it,
    /// and the evidence of what came before it.
    pub(super) outside: Vec<f64>,
    /// The highest of these at each rate and all older ones.
    pub(super) most_outside: Vec<f64>,
    /// Variances of ln v and f of today, and their covariance, after each rate.
    pub(super) today: Vec<[f64; 3]>,
    /// The covariance of level, load and error of the reading at the start of each rate, after it; where errors are followed.
    pub(super) at_start: Vec<Matrix3<f64>>,
}

/// Degrees of freedom of an outlier's error.
const STUDENT: f64 = 4.0;

impl RateRecord {
    /// Doubts the rates that miss by these squares of standard deviations.
    pub(super) fn doubt(&mut self, squares: &[f64]) {
        let undoubted = self.assumed.undoubted;
        for (trust, square) in self.trust.iter_mut().zip(squares) {
            *trust = ((STUDENT + undoubted) / (STUDENT + square)).min(1.0);
        }
    }

    /// The variance of a rate's error, and of its scatter.
    pub(super) fn variance(&self, index: usize, scatter: f64) -> f64 {
        (self.error[index].powi(2) + scatter * scatter * self.white[index]) / self.trust[index]
    }

    /// The same but for what is of the readings at its two ends, and how much the error of each of those moves it.
    pub(super) fn own_and_ends(&self, index: usize, noise: &LoadNoise) -> (f64, f64) {
        let all = self.variance(index, noise.scatter);
        if noise.shared > 0.0 && self.is_of_ends[index] {
            let of_ends = noise.shared * self.error[index].powi(2) / self.trust[index];
            (all - of_ends, (0.5 * of_ends).sqrt())
        } else {
            (all, 0.0)
        }
    }

    /// Whether the rate ends with the reading that the one after it begins with.
    pub(super) fn ends_where_next_begins(&self, index: usize) -> bool {
        let next = self.from.get(index + 1);
        next.is_some_and(|next| next.to_bits() == self.to[index].to_bits())
    }
}

#[cfg(test)]
impl RateRecord {
    /// Five differences of six readings, but for a gap before the newest two.
    pub(super) fn of_five() -> Self {
        Self {
            ln_velocity: vec![0.6, -0.2, 0.15, 0.4, -0.1],
            error: vec![0.2, 0.3, 0.25, 0.2, 0.4],
            middle: vec![5.5, 4.5, 3.5, 1.5, 0.5],
            from: vec![6.0, 5.0, 4.0, 2.0, 1.0],
            to: vec![5.0, 4.0, 3.0, 1.0, 0.0],
            centre: 0.0,
            trust: vec![1.0, 1.0, 0.5, 1.0, 1.0],
            is_of_ends: vec![true; 5],
            white: vec![1.0; 5],
            assumed: Assumptions::CONSTANT_LOAD,
        }
    }
}

/// What a noise makes of the times of a record, whatever the law: newest rate first.
#[derive(Debug, Clone)]
pub(super) struct LoadMemory {
    noise: LoadNoise,
    /// The share of the load that is left from the rate after it.
    keep: Vec<f64>,
    /// What the load's variance loses in the mean over each rate, beyond how much of the load at its middle that shows.
    smoothed: Vec<f64>,
    sees: Vec<f64>,
}

impl LoadMemory {
    /// The scatter of the readings that goes with it.
    pub(super) fn scatter(&self) -> f64 {
        self.noise.scatter
    }

    pub(super) fn noise(&self) -> &LoadNoise {
        &self.noise
    }

    /// For one rate, by its index from the newest: the share of the load that is left from the rate after it, how much of the
    /// load at its middle its mean shows, and what that lacks of the mean's variance.
    pub(super) fn of_rate(&self, from_newest: usize) -> (f64, f64, f64) {
        let at = |of: &[f64]| of.get(from_newest).copied().unwrap_or_default();
        (at(&self.keep), at(&self.sees), -at(&self.smoothed))
    }

    pub(super) fn new(record: &RateRecord, noise: &LoadNoise) -> Self {
        let variance = noise.sigma * noise.sigma;
        let mut ago = 0.0;
        let (mut keep, mut smoothed, mut sees) = (Vec::new(), Vec::new(), Vec::new());
        for index in (0..record.middle.len()).rev() {
            let days = (record.middle[index] - ago).max(0.0);
            ago = record.middle[index];
            keep.push((-days / noise.tau).exp());
            let width = (record.from[index] - record.to[index]) / noise.tau;
            if record.assumed.follows_errors {
                // A filter that took the mean for the load at its middle would have negative variances in the end.
                let seen = middle_in_mean(width);
                sees.push(seen);
                smoothed.push(variance * (seen * seen - variance_of_mean(width)));
            } else {
                sees.push(1.0);
                smoothed.push(variance * (1.0 - variance_of_mean(width)));
            }
        }
        Self {
            noise: *noise,
            keep,
            smoothed,
            sees,
        }
    }
}

impl Gains {
    /// `u`: ln(1 + |r| t) at the middle of each rate, oldest first; `before`: the evidence of what came before each rate, ln.
    pub(super) fn new(record: &RateRecord, memory: &LoadMemory, u: &[f64], before: &[f64]) -> Self {
        let noise = &memory.noise;
        let count = record.middle.len();
        let variance = noise.sigma * noise.sigma;
        let mut filter = FilterCovariance::of_today(variance);
        let mut gains = Self {
            steps: Vec::with_capacity(count),
            outside: Vec::with_capacity(count),
            most_outside: Vec::new(),
            today: Vec::with_capacity(count),
            at_start: Vec::new(),
        };
        let (mut u_before, mut normaliser) = (0.0, 0.0);
        let of_time = memory.keep.iter().zip(&memory.smoothed).zip(&memory.sees);
        for (index, ((keep, smoothed), sees)) in (0..count).rev().zip(of_time) {
            let e_folds = (u[index] - u_before).max(0.0);
            u_before = u[index];
            filter.go_back(*keep, variance, record.assumed.drift.powi(2) * e_folds);
            let is_shared = record.ends_where_next_begins(index);
            if !is_shared {
                filter.at_a_new_reading();
            }
            let (error, ends) = record.own_and_ends(index, noise);
            let (gain, s) = filter.read(error, *smoothed, ends, *sees);
            normaliser -= 0.5 * s.ln();
            gains.steps.push(Gain {
                keep: *keep,
                sees: *sees,
                shared: if is_shared { gain.shared } else { 0.0 },
                ..gain
            });
            gains.outside.push(normaliser + before[index]);
            gains
                .today
                .push([filter.velocity, filter.now, filter.velocity_now]);
            if record.assumed.follows_errors {
                gains.at_start.push(filter.at_start());
            }
        }
        let mut most = f64::NEG_INFINITY;
        gains.most_outside = gains.outside.clone();
        for slot in gains.most_outside.iter_mut().rev() {
            most = most.max(*slot);
            *slot = most;
        }
        gains
    }
}

/// The covariance of the load f, the level l, of today's ln v and load, and of the error of the reading at the start of the
/// rate taken last: what is not named of the symmetric matrix is not needed.
struct FilterCovariance {
    load: f64,
    load_level: f64,
    load_velocity: f64,
    load_now: f64,
    level: f64,
    level_velocity: f64,
    level_now: f64,
    velocity: f64,
    velocity_now: f64,
    now: f64,
    end: f64,
    end_load: f64,
    end_level: f64,
    end_velocity: f64,
    end_now: f64,
}

impl FilterCovariance {
    /// Before anything is read: ln v of today is the level and the load together.
    fn of_today(variance: f64) -> Self {
        Self {
            load: variance,
            load_level: 0.0,
            load_velocity: variance,
            load_now: variance,
            level: LEVEL_VARIANCE,
            level_velocity: LEVEL_VARIANCE,
            level_now: 0.0,
            velocity: LEVEL_VARIANCE + variance,
            velocity_now: variance,
            now: variance,
            end: 1.0,
            end_load: 0.0,
            end_level: 0.0,
            end_velocity: 0.0,
            end_now: 0.0,
        }
    }

    /// To the rate before: `keep` of the load is left, and the level drifts by the variance `drifted`.
    fn go_back(&mut self, keep: f64, variance: f64, drifted: f64) {
        self.load = keep * keep * self.load + variance * (1.0 - keep * keep);
        self.load_level *= keep;
        self.load_velocity *= keep;
        self.load_now *= keep;
        self.end_load *= keep;
        self.level += drifted;
    }

    /// The next rate ends with a reading that no rate so far has begun with.
    fn at_a_new_reading(&mut self) {
        self.end = 1.0;
        self.end_load = 0.0;
        self.end_level = 0.0;
        self.end_velocity = 0.0;
        self.end_now = 0.0;
    }

    /// Of level, load and the error of the reading at the start of the rate taken last.
    fn at_start(&self) -> Matrix3<f64> {
        Matrix3::new(
            self.level,
            self.load_level,
            self.end_level,
            self.load_level,
            self.load,
            self.end_load,
            self.end_level,
            self.end_load,
            self.end,
        )
    }

    /// Takes a rate of that variance of its error, whose mean `sees` so much of the load at its middle, over which the load's
    /// variance loses `smoothed`, and which the readings at its two ends move by `ends` each: its gain, all but what is kept of
    /// the load, and the variance of the innovation.
    fn read(&mut self, error: f64, smoothed: f64, ends: f64, sees: f64) -> (Gain, f64) {
        let load = sees * self.load + self.load_level + ends * self.end_load;
        let level = sees * self.load_level + self.level + ends * self.end_level;
        let velocity = sees * self.load_velocity + self.level_velocity + ends * self.end_velocity;
        let now = sees * self.load_now + self.level_now + ends * self.end_now;
        let of_ends = ends * (sees * self.end_load + self.end_level + ends * (self.end + 1.0));
        let s = (sees * load + level + (error + of_ends) - smoothed)
            .max(error)
            .max(1e-12);
        let precision = 1.0 / s;
        let gain = Gain {
            keep: 1.0,
            sees,
            shared: ends,
            end: -ends * precision,
            load: load * precision,
            level: level * precision,
            velocity_now: velocity * precision,
            load_now: now * precision,
            precision,
        };
        self.load -= load * gain.load;
        self.load_level -= load * gain.level;
        self.load_velocity -= load * gain.velocity_now;
        self.load_now -= load * gain.load_now;
        self.level -= level * gain.level;
        self.level_velocity -= level * gain.velocity_now;
        self.level_now -= level * gain.load_now;
        self.velocity -= velocity * gain.velocity_now;
        self.velocity_now -= velocity * gain.load_now;
        self.now -= now * gain.load_now;
        self.end_load = -gain.end * load;
        self.end_level = -gain.end * level;
        self.end_velocity = -gain.end * velocity;
        self.end_now = -gain.end * now;
        self.end = 1.0 + gain.end * ends;
        (gain, s)
    }
}

/// The variance of the mean of an Ornstein-Uhlenbeck process over `width` memories, over its variance.
fn variance_of_mean(width: f64) -> f64 {
    if width > 1e-3 {
        2.0 * (width - 1.0 + (-width).exp()) / (width * width)
    } else {
        1.0
    }
}

/// How much of an Ornstein-Uhlenbeck process at the middle of `width` memories its mean over them shows.
fn middle_in_mean(width: f64) -> f64 {
    if width > 1e-3 {
        -2.0 * (-0.5 * width).exp_m1() / width
    } else {
        1.0
    }
}

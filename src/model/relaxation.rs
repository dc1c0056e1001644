//! The law beside its steady state, for as long as it stays there: for ever, if the state attracts.
//!
//! With z = `y/y_s` and E = `E_0` exp(-lambda t), the relaxing mode carried beyond first order,
//! z(E) solves E dz/dE = bc(z; p): a power series in E that depends on p alone. Velocity and slip follow
//! from it at any time, and what matters beside the steady state, z - 1, is never a difference.

use super::coefficients::Coefficients;
use super::taylor::{BlockPoint, MAX_ORDER, TaylorSeries, radius, step_fraction};

/// Beyond this |z - 1| max(1, |p - 1|) the series is not worth trying.
const FARTHEST_DISTANCE: f64 = 0.4;

/// Steps of Newton's method, of which from within 0.4 the fifth changes nothing any more.
const MOST_NEWTON: usize = 8;

/// The law from `start` until `end`, beside its steady state.
#[derive(Debug, Clone, Copy)]
pub(super) struct Relaxation {
    pub(super) start: f64,
    /// Infinite where the steady state attracts.
    pub(super) end: f64,
    /// Of the departure from the steady state, 1/day; negative where the state repels.
    rate: f64,
    y_steady: f64,
    departure: f64,
    slip: f64,
    order: usize,
    z: TaylorSeries,
    u: TaylorSeries,
}

impl Relaxation {
    /// From where the block is `at` at `start`; `None` where the steady state is far or is not.
    pub(super) fn new(
        law: &Coefficients,
        order: usize,
        start: f64,
        at: BlockPoint,
    ) -> Option<Self> {
        if law.kappa == 0.0 {
            return None;
        }
        let ln_y_steady = law.ln_y_steady();
        let stretch = (law.p - 1.0).abs().max(1.0);
        let ln_z = at.y.ln() - ln_y_steady;
        // NaN, where there is no steady state.
        let distance = ln_z.abs() * stretch;
        if distance.is_nan() || distance >= FARTHEST_DISTANCE {
            return None;
        }
        let (z, u) = series(law.p, order);
        let reach = step_fraction(order) * radius(&z, order).min(radius(&u, order));
        let departure = departure(&z, order, ln_z.exp_m1());
        if departure.is_nan() || departure.abs() >= reach {
            return None;
        }
        let rate = -(law.kappa * ((law.p - 1.0) * ln_y_steady).exp());
        let room = (reach / departure.abs()).ln() / -rate;
        let stays = rate >= 0.0 || departure == 0.0;
        Some(Self {
            start,
            end: if stays { f64::INFINITY } else { start + room },
            rate,
            y_steady: ln_y_steady.exp(),
            departure,
            slip: at.slip,
            order,
            z,
            u,
        })
    }

    /// Where the block is at time `t`, days.
    pub(super) fn at(&self, t: f64) -> BlockPoint {
        let days = t - self.start;
        let decay = (-self.rate) * days;
        let departure = self.departure * decay.exp();
        // E_0^k - E^k from E_0 - E, without a difference of powers.
        let first = -(self.departure * decay.exp_m1());
        let mut lost = first;
        let mut power = departure;
        let mut y = self.z[0] + self.z[1] * departure;
        let mut gained = self.u[1] * lost;
        for k in 2..=self.order {
            lost = self.departure * lost + power * first;
            power *= departure;
            y += self.z[k] * power;
            gained += self.u[k] * lost * (1.0 / k as f64);
        }
        let slip = self.slip + (days + gained / self.rate) / self.y_steady;
        BlockPoint {
            y: y * self.y_steady,
            slip,
        }
    }
}

/// z(E) and u = 1/z: k (k - 1) `z_k` is the sum over 0 < i < k of i (p (k - i) - i) `z_i z_(k-i)`.
fn series(p: f64, order: usize) -> (TaylorSeries, TaylorSeries) {
    let mut z = [0.0; MAX_ORDER + 1];
    let mut u = [0.0; MAX_ORDER + 1];
    (z[0], z[1], u[0], u[1]) = (1.0, 1.0, 1.0, -1.0);
    for k in 2..=order {
        let (mut with_p, mut without) = (0.0, 0.0);
        let mut product = z[1] * u[k - 1];
        for i in 1..k {
            let pair = z[i] * z[k - i];
            with_p += pair * (i * (k - i)) as f64;
            without += pair * (i * i) as f64;
            if i > 1 {
                product += z[i] * u[k - i];
            }
        }
        z[k] = (p * with_p - without) * (1.0 / (k * (k - 1)) as f64);
        u[k] = -(product + z[k]);
    }
    (z, u)
}

/// E with z(E) - 1 = `offset`, by Newton's method, which takes one step more than shows.
fn departure(z: &TaylorSeries, order: usize, offset: f64) -> f64 {
    let step = |e: f64| {
        let (mut sum, mut slope) = (0.0, 0.0);
        for k in (1..=order).rev() {
            slope = slope * e + k as f64 * z[k];
            sum = (sum + z[k]) * e;
        }
        (offset - sum) / slope
    };
    let mut e = offset;
    for _ in 0..MOST_NEWTON {
        let by = step(e);
        e += by;
        if by.abs() <= 1e-16 * e.abs() {
            break;
        }
    }
    e + step(e)
}

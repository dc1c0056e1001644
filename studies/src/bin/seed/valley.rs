//! How poorly La Clapière's displacement tells m and `x_i`: the valley of the rms about its least.

use slipwatch::fit::Exponent;
use slipwatch::inversion::{Inversion, InversionOptions};
use slipwatch::reading::Series;

/// An rms this much above the least, relative, is as good.
pub(crate) const AS_GOOD: f64 = 0.05;
/// And one this much above it nearly so.
pub(crate) const NEARLY: f64 = 0.2;
/// The m that are imposed.
const IMPOSED: [f64; 12] = [
    0.2, 0.4, 0.6, 0.8, 0.85, 0.9, 0.94, 0.96, 0.97, 0.98, 0.99, 0.999,
];

/// The best fit with m imposed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ValleyPlace {
    pub(crate) m: f64,
    pub(crate) x_i: Option<f64>,
    pub(crate) t_days: Option<f64>,
    pub(crate) d: Option<f64>,
    pub(crate) rms: f64,
}

/// The valley, from the lowest m to the highest.
#[derive(Debug, Clone)]
pub(crate) struct Valley {
    pub(crate) least_rms: f64,
    pub(crate) places: Vec<ValleyPlace>,
}

impl Valley {
    /// The places whose rms is within a share of the least.
    fn within(&self, share: f64) -> impl Iterator<Item = &ValleyPlace> {
        let highest = (1.0 + share) * self.least_rms;
        self.places.iter().filter(move |place| place.rms <= highest)
    }

    /// Lowest and highest m whose rms is within a share of the least.
    pub(crate) fn m(&self, share: f64) -> Option<(f64, f64)> {
        ends(self.within(share).map(|place| place.m))
    }

    /// Lowest and highest `x_i` there.
    pub(crate) fn x_i(&self, share: f64) -> Option<(f64, f64)> {
        ends(self.within(share).filter_map(|place| place.x_i))
    }
}

fn ends(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |ends, value| {
        let (low, high) = ends.unwrap_or((value, value));
        Some((f64::min(low, value), f64::max(high, value)))
    })
}

/// The fits of `series` with m imposed, beside the least rms of all.
pub(crate) fn valley(series: &Series) -> Option<Valley> {
    let best = |exponent| {
        let options = InversionOptions {
            exponent,
            ..InversionOptions::default()
        };
        let fit = Inversion::new(series, &options).least_squares();
        fit.best().copied()
    };
    let place = |m: f64| {
        let fit = best(Exponent::Fixed(m))?;
        let paper = fit.law.paper();
        Some(ValleyPlace {
            m,
            x_i: paper.x_i,
            t_days: paper.t_unit_days,
            d: paper.d,
            rms: fit.rms,
        })
    };
    Some(Valley {
        least_rms: best(Exponent::Free)?.rms,
        places: IMPOSED.into_iter().filter_map(place).collect(),
    })
}

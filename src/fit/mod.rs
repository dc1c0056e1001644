//! The inversion of the law: from readings to velocities with errors, the best fit, and the posterior.

mod least_squares;
mod posterior;
mod quasi_random;
mod rates;

pub use posterior::{Curvature, Ensemble, Posterior, Sample as LawSample};
pub(crate) use rates::displacement_sigma;
pub use rates::{Observation, Observations, Rate, RateOptions};

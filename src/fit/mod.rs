//! The inversion of the law: from readings to velocities with errors, the best fit, and the posterior.

mod chart;
mod compaction;
mod constant_load;
mod global_search;
mod least_squares;
mod posterior;
mod projection;
mod quasi_random;
mod rates;
mod simplex;
mod under_load;

pub use constant_load::{ConstantLoad, Exponent, Outcome, Place, Solution};
pub use posterior::{Ensemble, Onset, OtherPrior, P_PRIOR, Posterior, Sample as LawSample};
pub use projection::PointReadings;
pub(crate) use rates::displacement_sigma;
pub use rates::{FINEST_DAYS, Observation, Observations, Rate, RateOptions, ReadingError};
pub use under_load::LoadPosterior;

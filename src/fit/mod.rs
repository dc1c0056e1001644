//! The inversion of the law: from readings to velocities with errors, the best fit, and the posterior.

mod chart;
mod compaction;
mod constant_load;
mod curve;
mod damped;
mod descent;
mod global_search;
mod lattice;
mod newest_slope;
mod point_readings;
mod quasi_random;
mod rates;
mod record;
mod solution;
mod under_load;
mod unit_m;

pub use constant_load::{ConstantLoad, FitOutcome};
pub(crate) use damped::{Damping, Descendable, StepOutcome, descend};
pub use lattice::Lattice;
pub use point_readings::PointReadings;
pub use rates::{FINEST_DAYS, Observation, Observations, Rate, RateOptions, ReadingError};
pub(crate) use rates::{displacement_sigma, velocity_sigma, widen_merged};
pub use solution::{EndOfSearch, Exponent, Solution};
pub use under_load::{
    Assumptions, Ensemble, LawDraws, LawSample, LoadPosterior, Onset, OtherPrior, P_PRIOR,
};

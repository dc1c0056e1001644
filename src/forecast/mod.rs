//! When a slope will collapse and when it will pass a critical velocity: distributions, and the inverse-velocity line.

mod collapse;
mod dependence;
mod evidence;
mod excursions;
mod free_exponent;
mod held_step;
mod intervals;
mod isolated_step;
mod law_passages;
mod learned;
mod line;
mod members;
mod network;
mod panel;
mod passage;
mod past_event;
mod scales;
mod sessions;
mod spans;
mod sudden;
mod surprise;
mod together;

pub use collapse::{Collapse, Indicators};
pub use dependence::Dependence;
pub use law_passages::HORIZON_DAYS;
pub(crate) use law_passages::measurably_moves;
pub(crate) use line::FARTHEST_INTERCEPT;
pub use line::InverseVelocityLine;
pub use members::Members;
pub use network::{INPUTS, Network, UNITS};
pub use panel::{FEWEST_READINGS, LawForecaster, Outlook, by_the_law};
pub(crate) use panel::{of_motion, outlook};
pub use passage::Passage;
pub use past_event::PastEvent;
pub use scales::{Scale, Scales, VelocityChange};
pub use together::{FailureTimeLikelihood, Group, Snapshot, groups};

//! When a slope will collapse and when it will pass a critical velocity: distributions, the inverse-velocity line, and
//! the simulated slopes that forecasts learn from and are judged by.

mod collapse;
mod dependence;
mod evidence;
mod learned;
mod life;
mod line;
mod members;
mod network;
mod panel;
mod passage;
mod scales;
mod surprise;
mod together;
mod world;

pub use collapse::{Collapse, Indicators};
pub use dependence::Dependence;
pub use evidence::RATE_PER_YEAR;
pub use life::{Corpus, Fate, Life};
pub use line::InverseVelocityLine;
pub use members::Members;
pub use network::{HIDDEN, INPUTS, Network};
pub use panel::{FEWEST_READINGS, HORIZON_DAYS, LawForecaster, Outlook, by_the_law};
pub(crate) use panel::{measurably_moves, outlook};
pub use passage::Passage;
pub use scales::{Change, Scale, Scales};
pub use together::{FailureTimeLikelihood, Group, Snapshot, groups};
pub use world::{Family, GaugeKind, Simulated};

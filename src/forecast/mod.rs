//! When the critical velocity will be passed: the distribution, the inverse-velocity line, the panel.

mod dependence;
mod life;
mod line;
mod panel;
mod passage;
mod surprise;
mod together;

pub use dependence::Dependence;
pub use life::{Fate, Life};
pub use line::InverseVelocityLine;
pub use panel::{FEWEST_READINGS, HORIZON_DAYS, Outlook, Panel};
pub(crate) use panel::{measurably_moves, outlook};
pub use passage::Passage;
pub use together::{Group, Look, Opinion, groups};

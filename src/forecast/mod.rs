//! When the critical velocity will be passed: the distribution, the inverse-velocity line, the panel.

mod filter;
mod line;
mod panel;
mod passage;
mod surprise;

pub use line::InverseVelocityLine;
pub use panel::{FEWEST_READINGS, HORIZON_DAYS, Outlook, Panel, seed_of};
pub use passage::Passage;

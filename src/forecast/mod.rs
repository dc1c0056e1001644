//! When the critical velocity will be passed: the distribution, the inverse-velocity line, the panel.

mod filter;
mod line;
mod panel;
mod passage;

pub use line::InverseVelocityLine;
pub use panel::{Outlook, Panel};
pub use passage::Passage;

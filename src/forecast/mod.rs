//! When the critical velocity will be passed: the distribution, the inverse-velocity line, the panel.

mod dependence;
mod learned;
mod life;
mod line;
mod members;
mod panel;
mod passage;
mod surprise;
mod together;
mod weighing;

pub use dependence::Dependence;
pub use learned::LEARNED;
pub use life::{Corpus, Fate, Life};
pub use line::InverseVelocityLine;
pub use members::{FEATURES, LINES, MEMBERS, Members};
pub use panel::{FEWEST_READINGS, HORIZON_DAYS, Outlook, Panel, members};
pub(crate) use panel::{measurably_moves, outlook};
pub use passage::Passage;
pub use together::{Group, Look, Opinion, groups};
pub use weighing::{LEVELS, LINE_SPREAD, SITUATIONS, Weighing, situation};

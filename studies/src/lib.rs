//! What only studies of the monitor need: simulated slopes whose end is known, which forecasts learn from and are judged by, and
//! where the project and measured series lie. The programs in `src/bin` write the project's tables.

mod folders;
mod healing;
mod life;
pub mod random;
mod world;

pub use folders::{measured, project};
pub use healing::law_from_healing;
pub use life::{Corpus, Fate, Life};
pub use world::{Family, GaugeKind, Simulated};

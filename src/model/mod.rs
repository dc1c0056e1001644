//! The slider-block friction law of Helmstetter et al. (2004): parameters, exact solution, failure time.
//!
//! In the inverse velocity `y = v_i/v` and p = 1 - 1/m the law is one regular equation,
//! `dy/dt = -r + kappa (y^p - 1)/p`, finite and smooth through m = 1.

mod accuracy;
mod box_cox;
mod coefficients;
mod driven;
mod law;
mod law_in_time;
mod load;
mod loaded;
mod path;
mod relaxation;
mod tail;
mod taylor;
mod trajectory;

pub use accuracy::Accuracy;
pub use driven::{Drive, Driven, LoadEvent};
pub use law::{Law, LawError, PaperParameters, StateSense};
pub use load::Load;
pub use loaded::LoadedLaw;
pub use trajectory::{Motion, Trajectory};

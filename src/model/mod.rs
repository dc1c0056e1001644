//! The slider-block friction law of Helmstetter et al. (2004): parameters, exact solution, failure time.
//!
//! In the inverse velocity `y = v_i/v` and p = 1 - 1/m the law is one regular equation,
//! `dy/dt = -r + kappa (y^p - 1)/p`, finite and smooth through m = 1.
//!
//! It is solved in these ways, each where none of the others is exact or fast enough:
//!
//! | solution | load | accuracy | serves |
//! |---|---|---|---|
//! | [`Trajectory`] | constant | f64's | `simulate`, failure times, the reference of the others |
//! | [`LoadedLaw`] | a function of time | f64's, Taylor steps | `simulate` with a load, the reference of the next |
//! | [`Driven`] | answers to the motion; friction and state change | within 1 % of slip, 5 % of velocity at the worst (its tests) | refits of effects |
//! | `fit/curve` | constant | that of its nodes, coarse or fine | the search for all minima under a constant load |
//! | `fit/under_load/past` | constant, seen backwards from the present | 1e-4 | what the posterior predicts of the past readings |
//! | `fit/under_load/shape` | the same, in tables | 5 % of ln v | the coarse search of that posterior |
//! | `effects/linear` | a small change of it | first order | which effect to refit first |

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
pub use law::{Law, LawError, PaperParameters};
pub use load::Load;
pub use loaded::LoadedLaw;
pub use trajectory::{Motion, Trajectory};

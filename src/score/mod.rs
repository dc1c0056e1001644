//! Forecasts of the time of failure scored as they were made: what was known at the time, against what came.

mod known;
mod method;
mod rivals;

pub use known::{History, Known};
pub use method::{METHODS, Method};

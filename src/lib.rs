//! slipwatch: a streaming early-warning monitor for landslides.
//!
//! The map, from the ground up; arrows go one way, and a test holds them:
//!
//! ```text
//! main -> cli -> runtime -> config, store -> monitor -> alert, effects -> forecast -> fit -> model -> regime
//!         cli -> inversion, score -> forecast
//!         cli -> figures -> effects, monitor, plot, score
//! alert, effects, forecast, fit, inversion, score -> reading
//! ```
//!
//! Everything from `monitor` down is pure: no clock, no files, no network, no ambient randomness.

pub mod alert;
pub mod cli;
pub mod config;
pub mod effects;
pub mod figures;
pub mod fit;
pub mod forecast;
pub mod inversion;
pub mod model;
pub mod monitor;
pub mod plot;
pub mod reading;
pub mod regime;
pub mod runtime;
pub mod score;
pub mod store;

//! Forecasts of the time of failure scored as they were made: what was known at the time, against what came.

mod card;
mod compare;
mod known;
mod measure;
mod method;
mod rivals;

pub use card::{Card, Evaluation, LEADS_DAYS, Lead, Score, Truth, card};
pub use compare::{Interval, Sum, mean, ratio};
pub use known::{Known, WholeRecord};
pub use measure::{
    LONGEST_SCORED_DAYS, Outcome, RECORDS_SCORED, crps_days, is_covered, log_score, scored_days,
};
pub use method::{METHODS, Method};

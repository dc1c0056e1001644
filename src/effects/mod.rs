//! From the residual to the effect that the law lacks: the search, the joint refit, before and after.

mod act;
mod backward;
mod beside;
mod blur;
mod by_clock;
mod calendar;
mod candidates;
mod clock;
mod companions;
mod daily;
mod dated;
mod declared;
mod definition;
mod delay;
mod diagnosis;
mod explain;
mod explanation;
mod faults;
mod filled;
mod findings;
mod forms;
mod frame;
mod free_delay;
mod fresh;
mod gain_interval;
mod given;
mod inverted;
mod judge;
mod kind;
mod known;
mod known_load;
mod options;
mod out_of_sample;
mod outlook;
mod own_event;
mod pair;
mod partition;
pub mod remarks;
mod together;

mod channels;
mod choice;
mod late;
mod linear;
mod margin;
mod noise;
mod objection;
mod prior;
mod problem;
mod quantiles;
mod ready;
mod refit;
mod refits;
mod response;
mod rise;
mod rival;
mod search;
mod shifts;
mod slip_alike;
mod slow;
mod surrogate;
mod term;
mod trials;
mod upslope;
mod velocity_factor;
mod verdict;
mod watch;
mod weights;
mod whole;

pub use act::Act;
pub use by_clock::ByClock;
pub use declared::explain_given;
pub use definition::{
    EffectDefinition, EffectSize, FittedCoefficients, LiesIn, SearchedRecord, SizeInWords, Support,
    Trying,
};
pub use explain::{TOO_FEW, explain};
pub use explanation::{
    Candidate, Change, Curves, DeclaredEffect, Effect, ErrorChange, Explained, Explanation, Fault,
    ForecastChange, NoiseReport, ResidualTests, SettingsReport, Structure,
};
pub use faults::{Inspected, inspect, is_code};
pub use given::{Cause, error_given};
pub use kind::{FaultKind, Form, Kind};
pub use known::EFFECTS;
pub use known_load::{Filtered, KnownLoad, Part, Wave};
pub use options::Options;
pub use outlook::EXPLAINED_DAYS;
pub use partition::{Partition, partition, partition_candidate};
pub use remarks::may_be_slip;
pub use response::MOST_SAMPLES;
pub use rival::Rival;
pub use together::{Together, explain_together};
pub use watch::{Residual, residual_structure};

#[cfg(test)]
mod fixture;

//! What the library does, within this process: laws, fits, forecasts, effects, the monitor and the readers of files.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod alerts_by_crisis;
mod crises;
mod crisis;
mod declared;
mod earlier_events;
mod effects_faults;
mod effects_groups;
mod effects_measured;
mod effects_monitor;
mod effects_searches;
mod effects_table;
mod few_readings;
mod first_start;
mod global_minimum;
mod hostile;
mod ingest;
mod ingest_mcap;
mod ingest_ndjson;
mod ingest_toa5;
mod invariance;
mod inversion;
mod late;
mod law;
mod law_limits;
mod loaded;
mod made_up;
mod measured;
mod monitor;
mod mutated_files;
mod orders;
mod other_unit;
mod parallel;
mod queue;
mod recordings;
mod refit_policy;
mod score_methods;
mod silent_slope;
mod site_level;
mod site_together;
mod slopes;
mod steady_creep;
mod text_formats;
mod together;
mod under_load;

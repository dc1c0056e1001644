//! What the library does, within this process: laws, fits, forecasts, effects, the monitor and the readers of files.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod alerts_by_crisis;
mod calibration;
mod crises;
mod crisis;
mod declared;
mod earlier_events;
mod effects_faults;
mod effects_groups;
mod effects_lives;
mod effects_measured;
mod effects_monitor;
mod effects_put_in;
mod effects_searches;
mod first_start;
#[path = "../../examples/loop/found_again.rs"]
#[expect(dead_code, reason = "the document shows more than is claimed here")]
mod found_again;
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
mod law_sensitivities;
mod loaded;
mod made_up;
mod measured;
mod monitor;
mod mutated_files;
mod orders;
mod parallel;
#[path = "../../examples/loop/put_in.rs"]
#[expect(dead_code, reason = "the document shows more than is claimed here")]
mod put_in;
mod queue;
mod reconstructions;
mod recordings;
mod refit_policy;
mod score_methods;
mod seed;
mod silent_slope;
mod site_level;
mod site_together;
mod slopes;
mod steady_creep;
mod text_formats;
mod together;
mod under_load;

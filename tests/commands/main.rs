//! The program from outside, command by command.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod check_files;
mod cli;
mod config;
mod demo;
mod doctor;
mod doubts;
mod drill;
mod explain_cli;
mod first_day;
mod first_site;
mod init_flags;
mod logger_exports;
mod misread;
mod office;
#[cfg(feature = "parquet")]
mod parquet;
mod plot_cli;
mod progress;
mod readme;
mod record;
mod replay_config;
mod report_cli;
mod schema;
mod score_cli;
mod windows;

//! The program from outside, command by command.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod cli;
mod config;
mod demo;
mod doctor;
mod drill;
mod explain_cli;
mod first_day;
mod first_site;
mod office;
mod plot_cli;
mod record;
mod report_cli;
mod schema;
mod score_cli;

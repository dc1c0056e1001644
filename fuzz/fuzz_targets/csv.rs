#![no_main]
//! `cargo +nightly fuzz run csv`: any bytes as a CSV file of readings, whole and line by line.

#[path = "../entry.rs"]
mod entry;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry::csv(bytes));

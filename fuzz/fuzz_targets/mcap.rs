#![no_main]
//! `cargo +nightly fuzz run mcap`: any bytes as an MCAP file of readings, whole and record by record.

#[path = "../entry.rs"]
mod entry;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry::mcap(bytes));

#![no_main]
//! `cargo +nightly fuzz run ndjson`: any bytes as an NDJSON file, whole and line by line.

#[path = "../entry.rs"]
mod entry;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry::ndjson(bytes));

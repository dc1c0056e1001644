#![no_main]
//! `cargo +nightly fuzz run toa5`: any bytes as a Campbell TOA5 file, whole and line by line.

#[path = "../entry.rs"]
mod entry;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry::toa5(bytes));

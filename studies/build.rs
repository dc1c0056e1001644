//! Whether measured series are here that may not be redistributed. A test of them is ignored where they are absent.
//!
//! An absent path cannot be watched: after adding the folder, `touch studies/build.rs`.

use std::env;
use std::path::PathBuf;

/// Their folder, where `SLIPWATCH_MEASURED` names no other one.
const MEASURED: &str = "../../shared/data";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(measured_data)");
    println!("cargo::rerun-if-env-changed=SLIPWATCH_MEASURED");
    let measured = env::var_os("SLIPWATCH_MEASURED");
    let measured = measured.map_or_else(|| PathBuf::from(MEASURED), PathBuf::from);
    if measured.is_dir() {
        println!("cargo::rerun-if-changed={}", measured.display());
        println!("cargo::rustc-cfg=measured_data");
    }
}

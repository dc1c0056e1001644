//! Whether measured series are here that may not be redistributed. A test of them is ignored where they are absent.
//!
//! An absent path cannot be watched: after adding the folder, `touch studies/build.rs`.

use std::path::Path;

const MEASURED: &str = "../../shared/data";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(measured_data)");
    if Path::new(MEASURED).is_dir() {
        println!("cargo::rerun-if-changed={MEASURED}");
        println!("cargo::rustc-cfg=measured_data");
    }
}

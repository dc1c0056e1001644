//! What this machine has that some tests need. A test of what is absent is ignored, with the reason, instead of passed.
//!
//! Nothing of the program depends on it. What is found here is looked for again when it changes or goes. A path that is
//! absent cannot be watched (cargo would build everything anew each time): after installing a tool or adding the
//! measured series, `touch build.rs`.

use std::env;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Series that may be read here but not redistributed: their folder, where `SLIPWATCH_MEASURED` names no other one.
const MEASURED: &str = "../shared/data";

/// The name of a condition, and commands of which one must succeed.
const TOOLS: [(&str, &[&[&str]]); 14] = [
    (
        "has_alertmanager",
        &[&["prometheus-alertmanager", "--version"]],
    ),
    (
        "has_cargo_deb",
        &[&["sh", "-c", "cargo-deb --version && dpkg-deb --version"]],
    ),
    ("has_cc", &[&["cc", "--version"]]),
    // pip install axe-core-python
    ("has_axe", &[&["python3", "-c", "import axe_core_python"]]),
    ("has_curl", &[&["curl", "--version"]]),
    ("has_dev_shm", &[&["test", "-d", "/dev/shm"]]),
    (
        "has_landlock",
        &[&["grep", "-q", "landlock_create_ruleset", "/proc/kallsyms"]],
    ),
    (
        "has_own_mounts",
        &[
            &["unshare", "-m", "mount", "-t", "tmpfs", "tmpfs", "/mnt"],
            &["unshare", "-Urm", "mount", "-t", "tmpfs", "tmpfs", "/mnt"],
        ],
    ),
    ("has_prlimit", &[&["prlimit", "--version"]]),
    ("has_promtool", &[&["promtool", "--version"]]),
    ("has_python3", &[&["python3", "--version"]]),
    // pip install mcap
    (
        "has_python_mcap",
        &[&["python3", "-c", "import mcap.reader"]],
    ),
    ("has_strace", &[&["strace", "-o", "/dev/null", "true"]]),
    ("has_systemd_analyze", &[&["systemd-analyze", "--version"]]),
];

/// The name of a condition, and places of which one must hold the file.
const FILES: [(&str, &[&str]); 2] = [
    (
        "has_chromium",
        &["/usr/bin/chromium", "/usr/bin/chromium-browser"],
    ),
    (
        "has_faketime",
        &[
            "/usr/lib/x86_64-linux-gnu/faketime/libfaketime.so.1",
            "/usr/lib/aarch64-linux-gnu/faketime/libfaketime.so.1",
        ],
    ),
];

const BROKERS: [&str; 3] = [
    "/usr/sbin/mosquitto",
    "/usr/bin/mosquitto",
    "/usr/local/sbin/mosquitto",
];
const BROKER_PLUGIN: &str = "mosquitto_dynamic_security.so";
const LIBRARIES: [&str; 3] = [
    "/usr/lib/x86_64-linux-gnu",
    "/usr/lib/aarch64-linux-gnu",
    "/usr/lib",
];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=PATH");
    println!("cargo::rerun-if-env-changed=MOSQUITTO");
    println!("cargo::rerun-if-env-changed=SLIPWATCH_MEASURED");
    let measured = env::var_os("SLIPWATCH_MEASURED");
    let measured = measured.map_or_else(|| PathBuf::from(MEASURED), PathBuf::from);
    condition("measured_data", watched(&measured));
    for (name, commands) in TOOLS {
        condition(name, commands.iter().any(|words| succeeds(words)));
    }
    for (name, places) in FILES {
        condition(name, places.iter().any(|file| watched(Path::new(file))));
    }
    let named = env::var_os("MOSQUITTO").map(PathBuf::from);
    let brokers = BROKERS.map(PathBuf::from);
    let has_mosquitto = named.iter().chain(&brokers).any(|file| watched(file));
    condition("has_mosquitto", has_mosquitto);
    let named = env::var("LD_LIBRARY_PATH").unwrap_or_default();
    let mut libraries = named.split(':').chain(LIBRARIES);
    let has_plugin = libraries.any(|folder| watched(&Path::new(folder).join(BROKER_PLUGIN)));
    condition("has_mosquitto_plugin", has_mosquitto && has_plugin);
    // The schema is OASIS's and is not redistributed here.
    println!("cargo::rerun-if-env-changed=SLIPWATCH_CAP_SCHEMA");
    let schema = env::var_os("SLIPWATCH_CAP_SCHEMA").map(PathBuf::from);
    let has_schema = schema.is_some_and(|file| watched(&file));
    let has_xmllint = succeeds(&["xmllint", "--version"]);
    condition("has_cap_schema", has_schema && has_xmllint);
    let is_root = fs::metadata("/proc/self").is_ok_and(|process| process.uid() == 0);
    condition("is_root", is_root);
    // Whether a tracer may attach to a process that it has not started.
    let scope = fs::read_to_string("/proc/sys/kernel/yama/ptrace_scope").unwrap_or_default();
    condition("may_attach", is_root || ["", "0"].contains(&scope.trim()));
}

fn condition(name: &str, is_met: bool) {
    println!("cargo::rustc-check-cfg=cfg({name})");
    if is_met {
        println!("cargo::rustc-cfg={name}");
    }
}

/// Whether it exists; if so, this is run again when it changes.
fn watched(path: &Path) -> bool {
    let exists = path.exists();
    if exists {
        println!("cargo::rerun-if-changed={}", path.display());
    }
    exists
}

fn succeeds(words: &[&str]) -> bool {
    let status = Command::new(words[0])
        .args(&words[1..])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|status| status.success())
}

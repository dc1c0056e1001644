//! Whether something keeps this machine's clock right.

use super::{CheckVerdict, Finding};
use std::path::Path;
use std::process::{Command, Stdio};

const CHECK: &str = "clock";
/// systemd-timesyncd makes it once the clock has been set.
const SYNCED: &str = "/run/systemd/timesync/synchronized";

/// As systemd says, which asks the kernel.
pub(super) fn finding() -> Finding {
    let said = Command::new("timedatectl")
        .args(["show", "--property=NTPSynchronized", "--value"])
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .output();
    let said = said.ok().filter(|output| output.status.success());
    let said = said.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    match said.as_deref() {
        Some("yes") => Finding::new(CHECK, CheckVerdict::Good, "synchronized"),
        Some("no") => Finding::new(
            CHECK,
            CheckVerdict::Wrong,
            "not synchronized: a slow clock takes right readings for ones from the future; \
             install chrony or systemd-timesyncd",
        ),
        _ if Path::new(SYNCED).exists() => Finding::new(CHECK, CheckVerdict::Good, "synchronized"),
        _ => Finding::new(
            CHECK,
            CheckVerdict::Unknown,
            "timedatectl does not say whether it is synchronized; see that it is",
        ),
    }
}

//! Whether this machine can run a site.

mod clock_sync;
mod daemon;
mod disk;
mod feeds;
mod hooks;
mod recordings;
mod watches;

use crate::config::Config;
pub use hooks::unstartable;
use schemars::JsonSchema;
use serde::Serialize;

/// How something stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, JsonSchema, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CheckVerdict {
    /// As it should be.
    Good,
    /// The daemon copes, at a price.
    Doubtful,
    /// Alerts or readings would be lost.
    Wrong,
    /// It cannot be distinguished from here.
    Unknown,
}

impl CheckVerdict {
    /// The word in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Doubtful => "doubtful",
            Self::Wrong => "wrong",
            Self::Unknown => "unknown",
        }
    }
}

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Eq, JsonSchema, Serialize)]
pub struct Finding {
    /// What: `user`, `state`, `token`, `listen`, `inotify`, `file-system`, `clock`, `fsync`, `hook`, `webhook`, `cap`, `mqtt_out`, `sandbox`, `source`, `recording`.
    pub check: &'static str,
    /// How it stands.
    pub verdict: CheckVerdict,
    /// One line for a person, with what to do about it.
    pub text: String,
}

impl Finding {
    fn new(check: &'static str, verdict: CheckVerdict, text: impl Into<String>) -> Self {
        Self {
            check,
            verdict,
            text: text.into(),
        }
    }
}

/// Looks at everything that `config` needs; runs no hook and leaves nothing behind.
pub fn examine(config: &Config) -> Vec<Finding> {
    let mut findings = daemon::findings(config);
    findings.push(watches::finding(config));
    findings.extend(disk::file_systems(config));
    findings.push(disk::fsync(&config.site.state_dir));
    findings.extend(config.site.record.iter().map(disk::record));
    findings.push(clock_sync::finding());
    findings.extend(config.hooks.iter().map(hooks::finding));
    findings.extend(hooks::write_limits(&config.hooks));
    findings.extend(feeds::findings(config));
    findings.extend(recordings::findings(&config.sources));
    findings
}

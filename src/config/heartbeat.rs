//! `[[heartbeat]]`: whom the daemon reports to that it watches, so that its silence is an alarm elsewhere.

use super::table::Section;
use super::{address, value};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How often, where the file does not say it.
const EVERY: Duration = Duration::from_secs(60);
/// More often is of no use to anybody.
const SHORTEST: Duration = Duration::from_secs(1);

/// `[[heartbeat]]`: an address that is asked for as long as the daemon watches.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Heartbeat {
    /// Where to, by `http` or `https`.
    pub address: hyper::Uri,
    /// How often.
    pub every: Duration,
    /// The certificate authorities that are trusted instead of the machine's own, PEM.
    pub ca_file: Option<PathBuf>,
}

/// All of them.
pub(super) fn heartbeats(root: &mut Section<'_>, base: &Path) -> Vec<Heartbeat> {
    let mut taken = BTreeSet::new();
    let tables = root.tables("heartbeat", "heartbeat").into_iter();
    tables
        .filter_map(|section| heartbeat(section, base, &mut taken))
        .collect()
}

fn heartbeat(
    mut section: Section<'_>,
    base: &Path,
    taken: &mut BTreeSet<String>,
) -> Option<Heartbeat> {
    let url = section.required("url", "\"https://monitor.example.org/ping/slope\"");
    let address = url.as_ref().and_then(|url| address::of(&section, url));
    let every = section.parsed("every", |text| {
        let every = value::duration(text)?.unsigned_abs();
        if every < SHORTEST {
            return Err("write a second or more, such as \"1m\"".to_owned());
        }
        Ok(every)
    });
    let ca_file = address::ca_file(&mut section, address.as_ref());
    if let Some(url) = &url
        && !taken.insert(url.value.clone())
    {
        section.error(
            &url.at,
            format!("there are two heartbeats to {:?}", url.value),
            "leave one of them out",
        );
    }
    section.finish();
    Some(Heartbeat {
        address: address?,
        every: every.map_or(EVERY, |given| given.value),
        ca_file: ca_file.map(|given| base.join(given)),
    })
}

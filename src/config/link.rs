//! `site.public_url`: where people reach the daemon from outside, for the links in messages by which an alert is acknowledged.

use super::table::{Placed, Section};
use super::{address, value};
use jiff::SignedDuration;
use std::path::{Path, PathBuf};

/// For how long a link can be used, where the file does not say it.
const WITHIN: SignedDuration = SignedDuration::from_hours(24);
/// Of the file in the state folder.
const SECRET_FILE: &str = "link.secret";

/// What links in messages are made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Links {
    /// Where people reach the daemon, without a slash at its end.
    pub public_url: String,
    /// For how long a link can be used after its message was made.
    pub within: SignedDuration,
    /// The file with the secret that signs them; the daemon makes it.
    pub secret_file: PathBuf,
}

impl Links {
    /// The host of the address, with the port where it states one.
    pub fn authority(&self) -> &str {
        let (_, rest) = self.public_url.split_once("://").unwrap_or_default();
        rest.split_once('/')
            .map_or(rest, |(authority, _)| authority)
    }

    /// Scheme, host and port of the address, as a browser names who asks.
    pub fn origin(&self) -> String {
        let scheme = self.public_url.split_once("://").map_or("", |(one, _)| one);
        format!("{scheme}://{}", self.authority())
    }
}

/// Whether `listen` is there.
pub(super) fn links(
    section: &mut Section<'_>,
    listens: bool,
    state_dir: Option<&Path>,
) -> Option<Links> {
    let within = section.parsed("acknowledge_within", value::duration);
    let Some(given) = section.text("public_url") else {
        if let Some(within) = within {
            section.warning(
                &within.at,
                "site.acknowledge_within without site.public_url: no message has a link".to_owned(),
                "add public_url = \"https://slope.example.org\", or leave it out",
            );
        }
        return None;
    };
    let address = address::of_key(section, "public_url", &given)?;
    refuse_unused(section, &given, &address, listens);
    Some(Links {
        public_url: given.value.trim_end_matches('/').to_owned(),
        within: within.map_or(WITHIN, |given| given.value),
        secret_file: state_dir?.join(SECRET_FILE),
    })
}

fn refuse_unused(
    section: &Section<'_>,
    given: &Placed<String>,
    address: &hyper::Uri,
    listens: bool,
) {
    let what = |why: &str| format!("site.public_url = {:?} {why}", given.value);
    if address.query().is_some() || given.value.contains('#') {
        section.error(
            &given.at,
            what("has more than a path"),
            "leave out what begins with ? or #",
        );
    }
    if !listens {
        section.error(
            &given.at,
            what("without site.listen: nobody would answer there"),
            "add listen = \"127.0.0.1:8642\", and have a proxy pass the address on to it",
        );
    }
    let host = address.host().unwrap_or_default();
    let is_here = host == "localhost" || host.starts_with("127.") || host == "[::1]";
    if address.scheme_str() == Some("http") && !is_here {
        section.warning(
            &given.at,
            what("without TLS: whoever reads a link on the way can acknowledge by it"),
            "put a proxy with TLS before the daemon, and write https",
        );
    }
}

//! `[[source]]` of kind mqtt: a broker, and the topics that readings come on.

use super::table::Section;
use crate::reading::Conventions;
use std::path::{Path, PathBuf};

/// Topics of an MQTT broker, on which NDJSON lines come.
#[derive(Debug, Clone, PartialEq)]
pub struct Broker {
    /// What benchmarks call it.
    pub id: String,
    /// Where it is.
    pub address: BrokerAddress,
    /// The certificate authorities that are trusted instead of the machine's own, PEM.
    pub ca_file: Option<PathBuf>,
    /// The filter of topics: `site/+/displacement`.
    pub topic: String,
    /// How times and missing values are written in the messages.
    pub conventions: Conventions,
}

/// Where a broker is, and as whom to connect to it.
#[derive(Clone, PartialEq, Eq)]
pub struct BrokerAddress {
    /// A name or an address.
    pub host: String,
    /// Its port.
    pub port: u16,
    /// Whether the connection is over TLS.
    pub is_secured: bool,
    /// User and password.
    pub login: Option<(String, String)>,
}

/// A password does not belong in a log.
impl std::fmt::Debug for BrokerAddress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}", self.host, self.port)
    }
}

impl BrokerAddress {
    /// Parses `mqtt://[USER:PASSWORD@]HOST[:PORT]`, or `mqtts://` for TLS.
    pub(super) fn parse(url: &str) -> Result<Self, String> {
        let fix = || {
            "write it as in \"mqtt://127.0.0.1:1883\", or \"mqtts://broker.example.org:8883\" for TLS"
                .to_owned()
        };
        let (rest, is_secured) = match url.strip_prefix("mqtts://") {
            Some(rest) => (rest, true),
            None => (url.strip_prefix("mqtt://").ok_or_else(fix)?, false),
        };
        let rest = rest.strip_suffix('/').unwrap_or(rest);
        let (login, place) = match rest.rsplit_once('@') {
            None => (None, rest),
            Some((login, place)) => (Some(login.split_once(':').ok_or_else(fix)?), place),
        };
        let is_port = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        let (host, port) = match place.rsplit_once(':') {
            Some((host, port)) if is_port(port) => (host, port.parse().map_err(|_| fix())?),
            Some(_) | None => (place, if is_secured { 8883 } else { 1883 }),
        };
        if host.is_empty() || host.contains(['/', ' ']) {
            return Err(fix());
        }
        Ok(Self {
            host: host.to_owned(),
            port,
            is_secured,
            login: login.map(|(user, password)| (user.to_owned(), password.to_owned())),
        })
    }
}

/// The keys of a broker; `id` and `conventions` are those that every source has.
pub(super) fn broker(
    section: &mut Section<'_>,
    id: Option<String>,
    conventions: Conventions,
    base: &Path,
) -> Option<Broker> {
    let address = section
        .required("url", "\"mqtt://127.0.0.1:1883\"")
        .and_then(|_| section.parsed("url", BrokerAddress::parse));
    let topic = section
        .required("topic", "\"site/+/displacement\"")
        .and_then(|_| section.parsed("topic", topic));
    let ca_file = section.text("ca_file");
    if let Some(given) = &ca_file
        && address.as_ref().is_some_and(|one| !one.value.is_secured)
    {
        section.error(
            &given.at,
            "source.ca_file is not used without TLS".to_owned(),
            "leave it out, or write url = \"mqtts://...\"",
        );
    }
    Some(Broker {
        id: id?,
        ca_file: ca_file.map(|given| base.join(given.value)),
        address: address?.value,
        topic: topic?.value,
        conventions,
    })
}

/// A filter as MQTT has it: `+` for one level, `#` for all that follow.
fn topic(text: &str) -> Result<String, String> {
    let levels: Vec<&str> = text.split('/').collect();
    let (last, before) = levels.split_last().unwrap_or((&"", &[]));
    let plain = |level: &str| !level.contains(['+', '#']) || level == "+";
    if before.iter().all(|level| plain(level)) && (plain(last) || *last == "#") {
        Ok(text.to_owned())
    } else {
        Err(
            "write + for one whole level, and # only as the last one: \"site/+/displacement\""
                .to_owned(),
        )
    }
}

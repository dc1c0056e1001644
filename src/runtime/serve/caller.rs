//! Under which names the daemon is asked, and by whose page: a foreign page in a browser reads nothing and orders nothing.

use crate::config::{Links, Token};
use crate::runtime::view::SiteReader;
use axum::http::{HeaderMap, HeaderName, header};
use std::net::IpAddr;
use std::sync::{Arc, PoisonError, RwLock};

/// What whoever asks for something else is answered.
pub(super) const NO_SUCH_PAGE: &str = "no such page\n";

/// The names under which a daemon is reached.
#[derive(Debug, Clone, Default)]
pub(super) struct OwnNames {
    reader: Option<Arc<SiteReader>>,
    host_name: Option<String>,
}

impl OwnNames {
    /// Those of this machine, and that of `site.public_url` where the config in force has one.
    pub(super) fn new(reader: Option<Arc<SiteReader>>) -> Self {
        let host_name = nix::unistd::gethostname().ok();
        Self {
            reader,
            host_name: host_name.and_then(|name| name.into_string().ok()),
        }
    }

    /// Whether the request names this daemon. Another name that leads here belongs to somebody else, whose page could ask
    /// under it (DNS rebinding); an address in figures cannot be rebound.
    pub(super) fn is_our_host(&self, headers: &HeaderMap) -> bool {
        text(headers, &header::HOST).is_none_or(|host| self.is_ours(host))
    }

    /// Whether no page of another site asks; programs that are no browsers do not name a page.
    pub(super) fn is_our_page(&self, headers: &HeaderMap) -> bool {
        let host = text(headers, &header::HOST).unwrap_or("localhost");
        text(headers, &header::ORIGIN).is_none_or(|origin| {
            let (_, name) = origin.split_once("://").unwrap_or_default();
            let is_public =
                (self.links()).is_some_and(|links| origin.eq_ignore_ascii_case(&links.origin()));
            is_public || name == host && self.is_ours(host)
        })
    }

    /// As the config in force has them.
    fn links(&self) -> Option<Links> {
        self.reader.as_ref()?.links()
    }

    fn is_ours(&self, host: &str) -> bool {
        let name = name(host);
        let is_machine = (self.host_name.as_deref()).is_some_and(|own| {
            let local = name.get(own.len()..).unwrap_or_default();
            let is_local = local.is_empty() || local.eq_ignore_ascii_case(".local");
            is_local && (name.get(..own.len())).is_some_and(|name| name.eq_ignore_ascii_case(own))
        });
        let is_public =
            (self.links()).is_some_and(|links| host.eq_ignore_ascii_case(links.authority()));
        is_machine || is_public || is_this_machine(host) || name.parse::<IpAddr>().is_ok()
    }
}

/// What callers must know by the config in force; `None`: nothing.
#[derive(Debug, Clone)]
pub(super) struct SharedToken(Arc<RwLock<Option<Arc<Token>>>>);

impl SharedToken {
    pub(super) fn new(token: Option<Token>) -> Self {
        Self(Arc::new(RwLock::new(token.map(Arc::new))))
    }

    pub(super) fn in_force(&self) -> Option<Arc<Token>> {
        (self.0.read().unwrap_or_else(PoisonError::into_inner)).clone()
    }

    pub(super) fn change(&self, token: Option<Token>) {
        *(self.0.write()).unwrap_or_else(PoisonError::into_inner) = token.map(Arc::new);
    }
}

/// Whether a host, with its port or without, is a name that only the machine itself uses.
pub(super) fn is_this_machine(host: &str) -> bool {
    let name = name(host);
    let is_loopback = |ip: IpAddr| ip.is_loopback();
    name.eq_ignore_ascii_case("localhost") || name.parse().is_ok_and(is_loopback)
}

/// A host without its port and the brackets of IPv6.
fn name(host: &str) -> &str {
    let name = host.rsplit_once(':').map_or(
        host,
        |(name, port)| {
            if port.ends_with(']') { host } else { name }
        },
    );
    name.trim_start_matches('[').trim_end_matches(']')
}

/// A header's text; empty where it is none.
fn text<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    let value = headers.get(name)?;
    Some(value.to_str().unwrap_or_default())
}

//! What somebody who follows the link in an alert's message is shown, and the acknowledgement that follows from it.

use super::order::LONGEST_NAME;
use super::{AlertLife, AlertView, SiteReader};
use crate::config::{EXERCISE, Links};
use crate::monitor::{EventKind, Given, Order, OrderKind, OrderedBy};
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::clock;
use crate::runtime::hook::Status;
use crate::runtime::link::{self, AskedLink, SignedLink};
use crate::store::StoreError;
use jiff::SignedDuration;
use jiff::tz::TimeZone;

/// What a good link is of.
#[derive(Debug)]
pub enum LinkTarget {
    /// An alert that is in force, and that nobody has acknowledged.
    Alert(Box<AlertView>),
    /// A drill, with its status: there is nothing to acknowledge but the drill.
    Drill(Status),
}

/// What there is to show.
#[derive(Debug)]
pub enum LinkPage {
    /// It can be used.
    Open(LinkTarget),
    /// It has just been used.
    Taken(LinkTarget),
    /// It is none of ours, or was changed on the way.
    Forged,
    /// It was good until then.
    Expired(Timestamp),
    /// It has been used before.
    Used(Option<Box<AlertView>>),
    /// Its alert has been acknowledged in another way.
    Seen(Box<AlertView>),
    /// Its alert has ended, or a higher level has taken its place.
    Over(Box<AlertView>),
    /// This state knows no such alert.
    Foreign,
    /// The name of whoever acknowledges cannot be kept.
    WrongName,
}

impl SiteReader {
    /// What following the link leads to; it changes nothing, because scanners of mail follow links.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn link(&self, asked: &AskedLink) -> Result<LinkPage, StoreError> {
        let Some(signed) = self.signed(asked)? else {
            return Ok(LinkPage::Forged);
        };
        if signed.until < clock::now() {
            return Ok(LinkPage::Expired(signed.until));
        }
        let is_used = self.store.is_used(&name(&signed))?;
        if signed.status != Status::Actual {
            return Ok(if is_used {
                LinkPage::Used(None)
            } else {
                LinkPage::Open(LinkTarget::Drill(signed.status))
            });
        }
        let alert = self.alert(&signed.key)?.map(Box::new);
        if is_used {
            return Ok(LinkPage::Used(alert));
        }
        Ok(match alert {
            // A key that only begins alike is another alert's.
            Some(alert) if alert.key != signed.key => LinkPage::Foreign,
            Some(alert) if alert.state != AlertLife::Firing => LinkPage::Over(alert),
            Some(alert) if alert.is_acknowledged => LinkPage::Seen(alert),
            Some(alert) => LinkPage::Open(LinkTarget::Alert(alert)),
            None => LinkPage::Foreign,
        })
    }

    /// Acknowledges the link's alert, and nothing else at its place; a link that cannot be used changes nothing. The daemon takes
    /// it within a second.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn acknowledge(&self, asked: &AskedLink, by: &str) -> Result<LinkPage, StoreError> {
        let found = self.link(asked)?;
        let LinkPage::Open(meant) = found else {
            return Ok(found);
        };
        let by = by.trim();
        if by.len() > LONGEST_NAME || by.chars().any(char::is_control) {
            return Ok(LinkPage::WrongName);
        }
        let Some(signed) = self.signed(asked)? else {
            return Ok(LinkPage::Forged);
        };
        let now = clock::now();
        let place = match &meant {
            LinkTarget::Alert(alert) => Some(alert.benchmark.clone()),
            // The drill, which waits for it, finds it in the site's log.
            LinkTarget::Drill(Status::Exercise) => Some(Some(BenchmarkId::new(EXERCISE))),
            LinkTarget::Drill(_) => None,
        };
        let order = place.map(|benchmark| Order::Acknowledge {
            benchmark,
            alert: Some(signed.key.clone()),
            given: Given {
                by: (!by.is_empty()).then(|| by.to_owned()),
                why: None,
                door: Some(OrderedBy::Link),
                given_at: Some(now),
                called_since: Vec::new(),
            },
        });
        // Other messages of the same alert have links that are good for longer.
        let within = (self.links()).map_or(SignedDuration::ZERO, |one| one.within);
        let forgotten = now.saturating_add(within).unwrap_or(signed.until);
        let name = name(&signed);
        let until = forgotten.max(signed.until);
        tracing::warn!(key = signed.key, by, "somebody acknowledges by a link");
        Ok(if self.store.use_link(&name, until, now, order.as_ref())? {
            LinkPage::Taken(meant)
        } else {
            LinkPage::Used(match meant {
                LinkTarget::Alert(alert) => Some(alert),
                LinkTarget::Drill(_) => None,
            })
        })
    }

    /// What links are made of; `None` where messages have none.
    pub fn links(&self) -> Option<Links> {
        self.facts().links.clone()
    }

    /// The zone that people there live in.
    pub fn zone(&self) -> TimeZone {
        TimeZone::get(&self.facts().time_zone).unwrap_or(TimeZone::UTC)
    }

    fn signed(&self, asked: &AskedLink) -> Result<Option<SignedLink>, StoreError> {
        let Some(links) = self.links() else {
            return Ok(None);
        };
        Ok(link::verified(&links.secret_file, asked)?)
    }
}

/// All links of one alert are one: whoever comes second is shown that somebody has come before.
fn name(signed: &SignedLink) -> String {
    format!("{}\n{}", signed.status.name(), signed.key)
}

impl AlertView {
    /// The newest acknowledgement: when, by the host's clock, and by whom.
    pub fn acknowledged(&self) -> Option<(Option<Timestamp>, Option<&str>)> {
        self.audit.iter().rev().find_map(|event| {
            let EventKind::Order { order, given, .. } = &event.kind else {
                return None;
            };
            let acknowledged = (given.given_at, given.by.as_deref());
            (*order == OrderKind::Acknowledge).then_some(acknowledged)
        })
    }
}

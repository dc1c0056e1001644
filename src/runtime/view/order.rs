//! An order that was given on the page, and whether it is taken.

use super::SiteReader;
use crate::config::EXERCISE;
use crate::monitor::{EventKind, Given, Order, OrderedBy};
use crate::reading::BenchmarkId;
use crate::runtime::clock;
use crate::runtime::standing::silence_of_the_site;
use crate::store::{EARLIEST, StoreError};
use jiff::SignedDuration;
use schemars::JsonSchema;
use serde::Deserialize;

/// Longest name of whoever gives an order, bytes.
pub(super) const LONGEST_NAME: usize = 100;
/// Longest reason, bytes.
const LONGEST_REASON: usize = 500;

/// What is asked for.
#[derive(Debug, Clone, JsonSchema, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Asked {
    /// `acknowledge`, `shelve`, `silence`, `resolve` or `unsilence`.
    pub order: String,
    /// Where; the whole site without one.
    pub benchmark: Option<String>,
    /// Who asks.
    pub by: String,
    /// Why.
    pub why: Option<String>,
    /// For how long, of a shelve or a silence.
    pub seconds: Option<i64>,
    /// `newest_event` of the view that whoever asks looked at: the order is not of what was called later. Without it, of nothing that is called
    /// after it.
    #[serde(default)]
    pub seen: Option<i64>,
}

/// Why an order is not taken.
#[derive(Debug, thiserror::Error)]
pub enum OrderError {
    /// The site has no token.
    #[error("orders are taken here only where site.token_file is set: use `slipwatch alerts`")]
    NotHere,
    /// It cannot be meant.
    #[error("{0}")]
    Wrong(String),
    /// The state cannot be written to.
    #[error("the order could not be kept: {0}")]
    Store(#[from] StoreError),
}

impl SiteReader {
    /// Leaves the order for the daemon, which takes it within a second.
    ///
    /// # Errors
    /// [`OrderError`].
    pub fn ask(&self, asked: &Asked) -> Result<Order, OrderError> {
        if !self.facts().takes_orders {
            return Err(OrderError::NotHere);
        }
        let order = self.order(asked)?;
        // A drill waits for the acknowledgement of its own benchmark.
        let is_of_a_drill = self.facts().has_drills && order.acknowledges(EXERCISE);
        if let Some(benchmark) = order.benchmark()
            && !self.known()?.contains(benchmark)
            && !is_of_a_drill
        {
            return wrong(format!("there is no benchmark {benchmark}"));
        }
        let now = self.now()?;
        if let Some(silence) = silence_of_the_site(&self.store, &order, now)? {
            let EventKind::Order { until, given, .. } = &silence.kind else {
                return wrong("the whole site is silenced".to_owned());
            };
            let until = until.map_or_else(String::new, |until| format!(" until {until}"));
            let by = given.by.as_deref();
            let by = by.map_or_else(String::new, |by| format!(" by {by}"));
            return wrong(format!(
                "benchmark: the whole site is silenced{until}{by}, which unsilence without a benchmark ends"
            ));
        }
        tracing::warn!(?order, "an order came over the network");
        self.store.ask(&order, asked.seen)?;
        Ok(order)
    }

    fn order(&self, asked: &Asked) -> Result<Order, OrderError> {
        let name = asked.by.trim();
        if name.is_empty() || name.len() > LONGEST_NAME || name.chars().any(char::is_control) {
            return wrong(format!("by: a name of 1 to {LONGEST_NAME} bytes is needed"));
        }
        let why = asked.why.as_deref().map(str::trim);
        let why = why.filter(|why| !why.is_empty());
        if why.is_some_and(|why| why.len() > LONGEST_REASON || why.chars().any(char::is_control)) {
            return wrong(format!("why: one line of {LONGEST_REASON} bytes at most"));
        }
        let given = Given {
            by: Some(name.to_owned()),
            why: why.map(str::to_owned),
            door: Some(OrderedBy::Http),
            given_at: Some(clock::now()),
            called_since: Vec::new(),
        };
        let benchmark = asked.benchmark.as_ref().map(BenchmarkId::new);
        let until = |longest: SignedDuration| {
            let span = asked.seconds.map(SignedDuration::from_secs);
            let span = span.filter(|span| *span > SignedDuration::ZERO && *span <= longest);
            let now = self.now()?.max(EARLIEST);
            match span.and_then(|span| now.checked_add(span).ok()) {
                Some(until) => Ok(until),
                None => wrong(format!("seconds: 1 to {} are needed", longest.as_secs())),
            }
        };
        Ok(match (asked.order.as_str(), benchmark) {
            ("acknowledge", benchmark) => Order::Acknowledge {
                benchmark,
                alert: None,
                given,
            },
            ("resolve", Some(benchmark)) if given.why.is_some() => Order::Resolve {
                benchmark: Some(benchmark),
                given,
            },
            ("resolve", Some(_)) => {
                return wrong("why: an alert is resolved for a reason".to_owned());
            }
            ("resolve", None) => {
                return wrong("benchmark: one at a time is resolved here".to_owned());
            }
            ("unsilence", benchmark) => Order::Unsilence { benchmark, given },
            ("silence", benchmark) => {
                let until = until(Order::LONGEST_SILENCE)?;
                Order::Silence {
                    benchmark,
                    until,
                    given,
                }
            }
            ("shelve", Some(benchmark)) => {
                let until = until(Order::LONGEST_SHELVE)?;
                Order::Shelve {
                    benchmark,
                    until,
                    given,
                }
            }
            ("shelve", None) => return wrong("benchmark: only one can be shelved".to_owned()),
            _ => {
                let known = "acknowledge, shelve, silence, resolve or unsilence";
                return wrong(format!("order: {known} is needed"));
            }
        })
    }
}

fn wrong<T>(what: String) -> Result<T, OrderError> {
    Err(OrderError::Wrong(what))
}

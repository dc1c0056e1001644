//! What the page shows: the site and its benchmarks at any moment, as they were known then.

mod alert;
mod benchmark;
mod link;
mod order;
mod site;
mod thin;

pub use alert::{AlertLife, AlertView, alert};
pub use benchmark::{BenchmarkView, TimeWindow};
pub use link::{LinkPage, LinkTarget};
pub use order::{Asked, OrderError};
pub use site::{SiteView, Standing};

use super::clock;
use super::vitals::Vitals;
use crate::config::{Config, Links};
use crate::monitor::{Declared, SiteLevel, Watched};
use crate::reading::{BenchmarkId, Timestamp};
use crate::store::{EARLIEST, Heads, LATEST, Store, StoreError};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, PoisonError, RwLock};

/// What time it is on the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Now {
    /// The host's clock.
    Wall,
    /// Data time of the last step: a recording is being played.
    Data,
}

/// What the config says of a site, as the page needs it.
#[derive(Debug, Clone)]
pub struct Facts {
    /// The site's name.
    pub name: String,
    /// The zone that people there live in.
    pub time_zone: String,
    /// Benchmarks that the config names, and whether there are others, which show once they have given a reading.
    pub watched: Watched,
    /// How the benchmarks' levels make that of the site.
    pub level: SiteLevel,
    /// What people declare.
    pub declared: Vec<Declared>,
    /// Where each stands, m.
    pub positions: BTreeMap<BenchmarkId, Vec<f64>>,
    /// Whether orders are taken: whoever gives one must know a secret.
    pub takes_orders: bool,
    /// Whether there are drills, which somebody may acknowledge.
    pub has_drills: bool,
    /// By which links in the messages alerts are acknowledged; `None`: by none.
    pub links: Option<Links>,
    /// What time it is.
    pub now: Now,
    /// In a replay: how it ended.
    pub ending: Option<Ending>,
    /// What is to be said of the positions, where they are not surveyed.
    pub positions_are: Option<&'static str>,
}

/// How a crisis ended that is played.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ending {
    /// When the slope collapsed.
    pub collapse: Timestamp,
    /// The last that was measured before it.
    pub last_reading: Timestamp,
}

impl Facts {
    /// Of a site that is watched.
    pub fn of(config: &Config) -> Self {
        let benchmarks = config.benchmarks.iter();
        Self {
            name: config.site.name.clone(),
            time_zone: config
                .site
                .time_zone
                .iana_name()
                .unwrap_or("UTC")
                .to_owned(),
            watched: config.settings.watched.clone(),
            level: config.settings.site.unwrap_or(SiteLevel::Worst),
            declared: config.settings.declared.clone(),
            positions: benchmarks
                .filter_map(|one| Some((one.id.clone(), one.position.clone()?)))
                .collect(),
            takes_orders: config.site.token_file.is_some(),
            has_drills: config.drill.is_some(),
            links: config.site.links.clone(),
            now: Now::Wall,
            ending: None,
            positions_are: None,
        }
    }
}

/// Answers what the page asks, from the state on the disk.
#[derive(Debug)]
pub struct SiteReader {
    /// A connection of its own: a long answer keeps the work loop from nothing.
    store: Store,
    facts: RwLock<Arc<Facts>>,
    /// What the daemon that shows it knows of itself; nothing where none does.
    vitals: Option<Arc<Vitals>>,
}

impl SiteReader {
    /// Opens the state in `folder`, which is there already.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn open(folder: &Path, facts: Facts) -> Result<Self, StoreError> {
        let store = Store::look(folder)?;
        let facts = RwLock::new(Arc::new(facts));
        Ok(Self {
            store,
            facts,
            vitals: None,
        })
    }

    /// The same, beside the daemon whose health this is: while it cannot write the state, the levels that it has called are shown.
    #[must_use]
    pub fn of_daemon(self, vitals: Arc<Vitals>) -> Self {
        Self {
            vitals: Some(vitals),
            ..self
        }
    }

    /// What it shows from here on is by another config.
    pub fn follow(&self, facts: Facts) {
        *(self.facts.write()).unwrap_or_else(PoisonError::into_inner) = Arc::new(facts);
    }

    /// What the config in force says.
    fn facts(&self) -> Arc<Facts> {
        Arc::clone(&self.facts.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// How far the state has grown.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn heads(&self) -> Result<Heads, StoreError> {
        self.store.heads()
    }

    /// The next events after number `after`, as (number, JSON).
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn events_after(&self, after: i64) -> Result<Vec<(i64, String)>, StoreError> {
        self.store.events(after, None, None)
    }

    /// When the slope collapsed, as far as that was known at `at`; without it, once all has been played.
    fn collapse(&self, at: Option<Timestamp>, now: Timestamp) -> Option<Timestamp> {
        let ending = self.facts().ending?;
        let is_known = at.map_or(now >= ending.last_reading, |at| at >= ending.collapse);
        is_known.then_some(ending.collapse)
    }

    fn now(&self) -> Result<Timestamp, StoreError> {
        Ok(match self.facts().now {
            Now::Wall => clock::now(),
            Now::Data => (self.store.newest_step()?).unwrap_or_else(clock::now),
        })
    }
}

/// As the state can hold it.
fn held(time: Timestamp) -> Timestamp {
    time.clamp(EARLIEST, LATEST)
}

fn read<T: serde::de::DeserializeOwned>(body: &str) -> Result<T, StoreError> {
    serde_json::from_str(body).map_err(|error| StoreError::Unreadable(error.to_string()))
}

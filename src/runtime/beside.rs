//! What works beside the work loop for as long as a config holds: heartbeats, drills, the record.

use super::record::live::{EventWords, LiveRecord};
use super::shutdown::Shutdown;
use super::vitals::Vitals;
use super::{drill, heartbeat};
use crate::config::Config;
use crate::store::Store;
use std::sync::Arc;
use std::time::Duration;
use tokio::task::JoinSet;

/// How long a reload waits for a record that is to be kept no longer.
const RECORD_LIMIT: Duration = Duration::from_secs(2);

/// The tasks, and what they need.
#[derive(Debug)]
pub(super) struct SideTasks {
    config: Config,
    store: Arc<Store>,
    vitals: Arc<Vitals>,
    shutdown: Shutdown,
    heartbeats: JoinSet<()>,
    drills: JoinSet<()>,
    record: Option<LiveRecord>,
    words: EventWords,
}

impl SideTasks {
    /// Starts what `config` asks for; it ends with the shutdown.
    pub(super) fn start(
        config: &Config,
        store: &Arc<Store>,
        vitals: &Arc<Vitals>,
        shutdown: &Shutdown,
        words: EventWords,
    ) -> Self {
        Self {
            config: config.clone(),
            store: Arc::clone(store),
            vitals: Arc::clone(vitals),
            shutdown: shutdown.clone(),
            heartbeats: heartbeat::start(&config.heartbeats, vitals, shutdown),
            drills: drill::start(config, store, vitals, shutdown),
            record: LiveRecord::start(config, store, vitals, words),
            words,
        }
    }

    /// Goes by another config: what it changes ends and begins again. A drill that is under way is broken off, and held again.
    pub(super) async fn follow(&mut self, config: &Config) {
        let (vitals, shutdown) = (&self.vitals, &self.shutdown);
        if config.heartbeats != self.config.heartbeats {
            self.heartbeats.shutdown().await;
            self.heartbeats = heartbeat::start(&config.heartbeats, vitals, shutdown);
        }
        if config.drill != self.config.drill || config.hooks != self.config.hooks {
            self.drills.shutdown().await;
            self.drills = drill::start(config, &self.store, vitals, shutdown);
        }
        if config.site.record != self.config.site.record {
            self.follow_record(config).await;
        }
        self.config = config.clone();
    }

    async fn follow_record(&mut self, config: &Config) {
        match (&self.record, &config.site.record) {
            (Some(record), Some(files)) => record.follow(files),
            (Some(_), None) => {
                if let Some(record) = self.record.take() {
                    record.close(RECORD_LIMIT).await;
                }
                self.vitals.update(|health| health.record = None);
            }
            (None, _) => {
                self.record = LiveRecord::start(config, &self.store, &self.vitals, self.words);
            }
        }
    }

    /// Ends it all but the record, which has the last to come.
    pub(super) async fn stop(mut self) -> Option<LiveRecord> {
        self.heartbeats.shutdown().await;
        self.drills.shutdown().await;
        self.record
    }
}

//! The daemon takes up another config.

use super::{DRAIN_LIMIT, Daemon, TICK, dispatcher};
use crate::config;
use crate::runtime::link;
use crate::runtime::sandbox::OURSELVES;
use crate::runtime::shutdown::Shutdown;
use crate::runtime::sources::Sources;
use crate::runtime::view::Facts;
use crate::store::StoreError;
use std::path::Path;

impl Daemon {
    /// Waits for the hooks to finish. Were others notified of the same meanwhile, people would be notified twice.
    async fn close_hooks(&mut self) {
        let Some(former) = self.site.unhook() else {
            return;
        };
        let mut closing = std::pin::pin!(former.close(DRAIN_LIMIT));
        loop {
            tokio::select! {
                _ = &mut closing => return,
                // Bounded, so it is no way of keeping a daemon that stands still alive.
                () = tokio::time::sleep(TICK) => self.pulse.turn(),
            }
        }
    }

    /// Goes by the config file as it is now, all of it or nothing.
    pub(super) async fn reload(&mut self, shutdown: &Shutdown) -> Result<(), StoreError> {
        let fresh = match config::load(&self.config.file) {
            Ok(mut fresh) => {
                fresh.wall_in_hooks(Path::new(OURSELVES));
                fresh
            }
            Err(error) => {
                tracing::error!(%error, "the config is not taken: the old one stays in force");
                return Ok(());
            }
        };
        if fresh.site.state_dir != self.config.site.state_dir
            || fresh.site.listen != self.config.site.listen
        {
            tracing::error!("the config is not taken: another state_dir or listen needs a restart");
            return Ok(());
        }
        let token = match fresh.site.token() {
            Ok(token) => token,
            Err(error) => {
                tracing::error!(%error, "the config is not taken: the old one stays in force");
                return Ok(());
            }
        };
        self.pulse.service.reloading();
        // What has been read already is taken under the old config.
        self.sources.stop();
        while let Some(batch) = self.sources.batches.recv().await {
            tokio::task::block_in_place(|| self.take_batch(batch, shutdown))?;
            // Cut short half-way: what lies behind must not move the files' positions beyond it.
            if shutdown.is_requested() {
                return Ok(());
            }
        }
        // The page takes what the messages hold from here on.
        link::make_secret_of(&fresh);
        self.pulse.follow(token, Facts::of(&fresh));
        let events = self.site.change_settings(fresh.settings.clone());
        self.pulse.vitals.note(&events);
        self.site.show(&self.pulse.vitals);
        self.commit()?;
        self.close_hooks().await;
        self.site.rehook(dispatcher(&fresh, &self.store))?;
        self.note_closed()?;
        self.sources = Sources::start(&fresh, &self.store)?;
        if let Some(beside) = &mut self.beside {
            beside.follow(&fresh).await;
        }
        (self.is_up_to_date, self.config) = (false, fresh);
        self.pulse.service.ready("watching");
        tracing::info!(file = %self.config.file.display(), "the config is taken");
        Ok(())
    }
}

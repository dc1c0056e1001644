//! The daemon takes up another config.

use super::{DRAIN_LIMIT, Daemon};
use crate::config::{self, Config, HookConfig, Token};
use crate::monitor::Input;
use crate::runtime::inherited::InheritedReadings;
use crate::runtime::link;
use crate::runtime::reloaded::{ConfigRefusal, new_sources_without_files};
use crate::runtime::sandbox::{self, OURSELVES};
use crate::runtime::service_faults::ServiceFaults;
use crate::runtime::shutdown::Shutdown;
use crate::runtime::sources::Sources;
use crate::runtime::tail::Arrival;
use crate::runtime::view::Facts;
use crate::store::StoreError;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

/// What stands in the files that ways out for alerts take when they are set up, as one number; a file that cannot be read counts as empty.
pub(super) fn read_by_hooks(config: &Config) -> u64 {
    let mut hasher = DefaultHasher::new();
    let ways_out = config.hooks.iter().filter_map(|hook| hook.to.as_ref());
    for file in ways_out.flat_map(|to| to.reads()) {
        std::fs::read(file).unwrap_or_default().hash(&mut hasher);
    }
    hasher.finish()
}

/// Says in the log what limits the hooks of `config`; faults of others are over.
pub(super) fn announce_hooks(config: &Config, faults: &ServiceFaults) {
    sandbox::announce(&config.hooks);
    let names: Vec<String> = config.hooks.iter().map(HookConfig::name).collect();
    faults.keep_hooks(&names);
}

impl Daemon {
    /// Notifies the hooks of `fresh` from here on; `read` is what stands in the files that they take when they are set up. Those that are in the config
    /// already go on, so no red waits until a hook that runs has ended.
    fn change_hooks(&mut self, fresh: &Config, read: u64) -> Result<(), StoreError> {
        let is_reread = read != self.read_by_hooks;
        if !is_reread && fresh.hooks == self.config.hooks {
            return Ok(());
        }
        announce_hooks(fresh, self.reporting.vitals.faults());
        self.read_by_hooks = read;
        (self.site).change_hooks(&fresh.hooks, is_reread, DRAIN_LIMIT)
    }

    /// The config file as it is now with its token, or why it cannot be taken.
    fn fresh_config(&self) -> Result<(Config, Option<Token>), String> {
        let mut fresh = config::load(&self.config.file).map_err(|error| error.to_string())?;
        fresh.sandbox_hooks(Path::new(OURSELVES));
        let (there, here) = (&fresh.site, &self.config.site);
        let changed = [
            ("state_dir", there.state_dir != here.state_dir),
            ("listen", there.listen != here.listen),
            ("name", there.name != here.name),
        ];
        if let Some((key, _)) = changed.iter().find(|(_, is_other)| *is_other) {
            return Err(format!(
                "{}: site.{key} is another than the daemon was started with: it needs a restart",
                self.config.file.display()
            ));
        }
        let token = fresh.site.token().map_err(|error| error.to_string())?;
        Ok((fresh, token))
    }

    /// The old config stays in force; nothing else says so than this.
    fn refuse_config(&mut self, why: String) -> Result<(), StoreError> {
        tracing::error!(error = %why, "the config is not taken: the old one stays in force");
        let text =
            format!("the config file is not taken, and the one before stays in force: {why}");
        self.show_refusal(&ConfigRefusal {
            refused: Some(why),
            since: Some((self.host_time)()),
        });
        self.report("config-refused", text)
    }

    fn show_refusal(&self, refusal: &ConfigRefusal) {
        if let Err(error) = refusal.write(&self.config.site.state_dir) {
            tracing::warn!(%error, "that cannot be kept for slipwatch status");
        }
        // Last, so that whoever sees it here finds it in the status too.
        (self.reporting.vitals).update(|health| health.config_refused.clone_from(&refusal.refused));
    }

    /// What is in force now is the config file as it is.
    pub(in crate::runtime) fn config_is_taken(&self) {
        if ConfigRefusal::read(&self.config.site.state_dir).is_some() {
            self.show_refusal(&ConfigRefusal::default());
        }
    }

    /// A fault that concerns the whole site, among the events.
    pub(super) fn report(&mut self, kind: &str, text: String) -> Result<(), StoreError> {
        let (time, kind) = ((self.host_time)(), kind.to_owned());
        let input = Input::Trouble { kind, text };
        let events = self.site.take(&Arrival { time, input }, time)?;
        self.reporting.vitals.note(&events);
        self.commit()
    }

    /// Says in the log where the state holds readings of files that `config` does not read; where it holds no others, that is
    /// reported too, once the files have been read.
    pub(in crate::runtime) fn note_inherited(&mut self, config: &Config) -> Result<(), StoreError> {
        let Some(inherited) = InheritedReadings::in_store(&self.store, config)? else {
            return Ok(());
        };
        let text = inherited.text(config);
        tracing::warn!("{text}");
        self.inherited = inherited.is_all.then_some(text);
        Ok(())
    }

    pub(super) fn report_inherited(&mut self) -> Result<(), StoreError> {
        match self.inherited.take() {
            Some(text) => self.report("inherited-readings", text),
            None => Ok(()),
        }
    }

    /// Goes by the config file as it is now, all of it or nothing.
    pub(super) async fn reload(&mut self, shutdown: &Shutdown) -> Result<(), StoreError> {
        let (fresh, token) = match self.fresh_config() {
            Ok(fresh) => fresh,
            Err(why) => return self.refuse_config(why),
        };
        self.reporting.service.reloading();
        // What has been read already is taken under the old config.
        self.sources.stop();
        // A file system that does not answer is not waited for: what has not been taken is read again.
        while let Ok(Some(batch)) =
            tokio::time::timeout(DRAIN_LIMIT, self.sources.batches.recv()).await
        {
            tokio::task::block_in_place(|| self.take_batch(batch, shutdown))?;
            // Cut short half-way: what lies behind must not move the files' positions beyond it.
            if shutdown.is_requested() {
                return Ok(());
            }
        }
        // The page takes what the messages hold from here on.
        link::make_secret_of(&fresh);
        self.reporting.follow(token, Facts::of(&fresh));
        let events = self.site.change_settings(fresh.settings.clone());
        self.reporting.vitals.note(&events);
        self.site.show(&self.reporting.vitals);
        (self.reporting.vitals).retain(|benchmark| self.site.shows(benchmark));
        self.commit()?;
        // Before they are set up: what changes meanwhile is seen at the next reload.
        let read = read_by_hooks(&fresh);
        self.change_hooks(&fresh, read)?;
        self.note_closed()?;
        self.note_inherited(&fresh)?;
        self.sources = Sources::start(&fresh, &self.store, self.reporting.vitals.faults())?;
        if let Some(beside) = &mut self.beside {
            beside.follow(&fresh).await;
        }
        for warning in &fresh.warnings {
            tracing::warn!("{warning}");
        }
        let has_lost_hooks = fresh.hooks.is_empty() && !self.config.hooks.is_empty();
        (self.files_are_read, self.is_up_to_date) = (false, false);
        let former = std::mem::replace(&mut self.config, fresh);
        self.reporting.service.ready("watching");
        tracing::info!(file = %self.config.file.display(), "the config is taken");
        self.config_is_taken();
        self.report_inherited()?;
        if has_lost_hooks {
            // Perhaps it was read while it was being written.
            let text =
                "the config that was taken has no hook any more: nobody is notified".to_owned();
            tracing::error!("{text}");
            self.report("no-hooks", text)?;
        }
        for line in new_sources_without_files(&self.config, &former) {
            tracing::warn!("{line}");
            self.report("no-file", line)?;
        }
        Ok(())
    }
}

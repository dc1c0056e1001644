//! The hook, as the people behind it see it: what they have received, and when the hook works.

use slipwatch::alert::Level;
use slipwatch::config::HookConfig;
use slipwatch::runtime::deliver::{Run, Runner};
use slipwatch::runtime::hook::{Alert, HookOutcome, MessageState};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// How long a run takes.
const RUN: Duration = Duration::from_millis(300);

/// What the hook does.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) enum Mood {
    #[default]
    Works,
    Fails,
    Hangs,
    /// For alerts of this benchmark alone.
    HangsAt(&'static str),
    /// It says that it took what it did not: a fault that the properties are to find.
    LosesRed,
}

/// What people have received, and the hook between.
#[derive(Debug, Default)]
pub(crate) struct People {
    pub(crate) mood: Mood,
    /// Between troubles.
    pub(crate) usual: Mood,
    /// By benchmark (none: the site, its clock) and level, the keys that are in force.
    in_force: BTreeMap<(Option<String>, Level), BTreeSet<String>>,
    pub(crate) notified: u64,
    pub(crate) failed: u64,
}

impl People {
    /// Whether they know of this level at the benchmark.
    pub(crate) fn know(&self, benchmark: Option<&str>, level: Level) -> bool {
        let place = (benchmark.map(str::to_owned), level);
        self.in_force
            .get(&place)
            .is_some_and(|keys| !keys.is_empty())
    }

    fn receive(&mut self, alert: &Alert) {
        self.notified += 1;
        let benchmark = alert.event.benchmark.as_ref().map(ToString::to_string);
        let keys = self.in_force.entry((benchmark, alert.level)).or_default();
        match alert.state {
            MessageState::Firing => keys.insert(alert.key.clone()),
            MessageState::Resolved => keys.remove(&alert.key),
            MessageState::Correction => false,
        };
    }

    fn does(&self, alert: &Alert) -> Mood {
        match &self.mood {
            Mood::HangsAt(name)
                if alert
                    .event
                    .benchmark
                    .as_ref()
                    .is_none_or(|one| one.as_str() != *name) =>
            {
                Mood::Works
            }
            Mood::HangsAt(_) => Mood::Hangs,
            Mood::LosesRed if alert.level == Level::Red => Mood::LosesRed,
            Mood::LosesRed => Mood::Works,
            other @ (Mood::Works | Mood::Fails | Mood::Hangs) => other.clone(),
        }
    }
}

/// Runs the hook.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hook(pub(crate) Arc<Mutex<People>>);

impl Runner for Hook {
    fn run(&self, hook: Arc<HookConfig>, alert: Alert, _attempt: u32) -> Run {
        let people = Arc::clone(&self.0);
        Box::pin(async move {
            tokio::time::sleep(RUN).await;
            let mood = people.lock().unwrap().does(&alert);
            match mood {
                Mood::Works => {
                    people.lock().unwrap().receive(&alert);
                    HookOutcome::Done
                }
                Mood::LosesRed => HookOutcome::Done,
                Mood::Fails => {
                    people.lock().unwrap().failed += 1;
                    HookOutcome::Failed(1)
                }
                Mood::Hangs | Mood::HangsAt(_) => {
                    tokio::time::sleep(hook.timeout).await;
                    people.lock().unwrap().failed += 1;
                    HookOutcome::TimedOut
                }
            }
        })
    }
}

//! How a hook is run: by the table of the ways out, or by whoever simulates one.

use crate::config::HookConfig;
use crate::runtime::hook::{Alert, HookOutcome};
use crate::runtime::way_out::{DeliveryAttempt, Run, WayOut};
use crate::runtime::ways_out::WAYS_OUT;
use std::fmt::Debug;
use std::sync::Arc;

/// Runs hooks.
pub trait Runner: Debug + Send + Sync {
    /// Runs `hook` for `alert`; `attempt` counts from 1.
    fn run(&self, hook: Arc<HookConfig>, alert: Alert, attempt: u32) -> Run;

    /// Sends `alerts` again to a hook that forgets them; `None` where nothing is sent again, as in a drill.
    fn repeat(&self, _hook: &Arc<HookConfig>, _alerts: Vec<Alert>) -> Option<Run> {
        None
    }
}

/// Each by the way out of its table of the config: a program as a process of its own.
#[derive(Debug, Clone, Copy)]
pub struct Processes;

impl Runner for Processes {
    fn run(&self, hook: Arc<HookConfig>, alert: Alert, attempt: u32) -> Run {
        sent(&WAYS_OUT, hook, alert, attempt)
    }

    fn repeat(&self, hook: &Arc<HookConfig>, alerts: Vec<Alert>) -> Option<Run> {
        let repeat = way_of(&WAYS_OUT, hook)?.repeat?;
        Some(repeat(Arc::clone(hook), alerts))
    }
}

/// Each by one of these ways out.
#[derive(Debug, Clone)]
pub struct Senders(pub Vec<&'static WayOut>);

impl Runner for Senders {
    fn run(&self, hook: Arc<HookConfig>, alert: Alert, attempt: u32) -> Run {
        sent(&self.0, hook, alert, attempt)
    }
}

fn way_of<'a>(ways: &[&'a WayOut], hook: &HookConfig) -> Option<&'a WayOut> {
    let table = hook.table();
    ways.iter().copied().find(|way| way.table == table)
}

fn sent(ways: &[&WayOut], hook: Arc<HookConfig>, alert: Alert, attempt: u32) -> Run {
    let Some(way) = way_of(ways, &hook) else {
        let why = format!("no way out is called {}", hook.table());
        return Box::pin(std::future::ready(HookOutcome::NotStarted(why)));
    };
    (way.send)(DeliveryAttempt {
        hook,
        alert,
        attempt,
    })
}

/// Runs `hook` for `alert`, or sends or writes it where it is no program; `attempt` counts from 1.
pub async fn run(hook: &HookConfig, alert: &Alert, attempt: u32) -> HookOutcome {
    let hook = Arc::new(hook.clone());
    Processes.run(hook, alert.clone(), attempt).await
}

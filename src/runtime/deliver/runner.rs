//! How a hook is run: as a process, or by whoever simulates one.

use crate::config::HookConfig;
use crate::runtime::hook::{self, Alert, Outcome};
use crate::runtime::webhook;
use std::fmt::Debug;
use std::pin::Pin;
use std::sync::Arc;

/// A run of a hook that is under way.
pub type Run = Pin<Box<dyn Future<Output = Outcome> + Send>>;

/// Runs hooks.
pub trait Runner: Debug + Send + Sync {
    /// Runs `hook` for `alert`; `attempt` counts from 1.
    fn run(&self, hook: Arc<HookConfig>, alert: Alert, attempt: u32) -> Run;
}

/// Each as a process of its own.
#[derive(Debug, Clone, Copy)]
pub struct Processes;

impl Runner for Processes {
    fn run(&self, hook: Arc<HookConfig>, alert: Alert, attempt: u32) -> Run {
        Box::pin(async move { run(&hook, &alert, attempt).await })
    }
}

/// Runs `hook` for `alert`, or sends it where it is a webhook; `attempt` counts from 1.
pub async fn run(hook: &HookConfig, alert: &Alert, attempt: u32) -> Outcome {
    let Some(to) = &hook.webhook else {
        return hook::run_program(hook, alert, attempt).await;
    };
    let outcome = match alert.body(attempt) {
        Ok(body) => webhook::send(to, alert, (body, hook.timeout)).await,
        Err(error) => Outcome::NotStarted(error.to_string()),
    };
    tracing::info!(
        webhook = to.name,
        key = alert.key,
        attempt,
        ?outcome,
        "webhook ended"
    );
    outcome
}

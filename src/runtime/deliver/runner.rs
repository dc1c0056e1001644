//! How a hook is run: as a process, or by whoever simulates one.

use crate::config::{HookConfig, WebhookFormat};
use crate::runtime::hook::{self, Alert, HookOutcome};
use crate::runtime::{alertmanager, cap, link, mqtt, webhook};
use std::fmt::Debug;
use std::pin::Pin;
use std::sync::Arc;

/// A run of a hook that is under way.
pub type Run = Pin<Box<dyn Future<Output = HookOutcome> + Send>>;

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

/// Runs `hook` for `alert`, or sends or writes it where it is a webhook or a folder; `attempt` counts from 1.
pub async fn run(hook: &HookConfig, alert: &Alert, attempt: u32) -> HookOutcome {
    if let Some(folder) = hook.cap.clone() {
        let (name, key, alert) = (hook.name(), alert.key.clone(), alert.clone());
        // A disk may hang: the worker does not wait with it.
        let writing = tokio::task::spawn_blocking(move || cap::write(&folder, &alert));
        let outcome = match tokio::time::timeout(hook.timeout, writing).await {
            Ok(written) => {
                written.unwrap_or_else(|error| HookOutcome::NotStarted(error.to_string()))
            }
            Err(_elapsed) => HookOutcome::TimedOut,
        };
        tracing::info!(hook = name, key, attempt, ?outcome, "CAP message ended");
        return outcome;
    }
    let link = link::of(hook, alert).await;
    if let Some(to) = &hook.mqtt {
        let outcome = match alert.body(attempt, link.as_deref()) {
            Ok(body) => mqtt::publish(to, body, hook.timeout).await,
            Err(error) => HookOutcome::NotStarted(error.to_string()),
        };
        let (name, key) = (&to.name, &alert.key);
        tracing::info!(name, key, attempt, ?outcome, "MQTT message ended");
        return outcome;
    }
    let Some(to) = &hook.webhook else {
        return hook::run_program(hook, alert, attempt, link.as_deref()).await;
    };
    let body = match to.format {
        WebhookFormat::Slipwatch => alert.body(attempt, link.as_deref()),
        WebhookFormat::Alertmanager => alertmanager::body(alert, &hook.levels, link.as_deref()),
    };
    let outcome = match body {
        Ok(body) => webhook::send(to, alert, body, hook.timeout).await,
        Err(error) => HookOutcome::NotStarted(error.to_string()),
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

//! How a hook is run: as a process, or by whoever simulates one.

use crate::config::HookConfig;
use crate::runtime::hook::{self, Alert, Outcome};
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
        Box::pin(async move { hook::run(&hook, &alert, attempt).await })
    }
}

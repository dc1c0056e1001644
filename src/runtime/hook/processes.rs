//! The processes of one run of a hook: what it has started, and how that is ended.

use crate::runtime::descendants::kill_descendants;
use nix::sys::signal::{Signal, kill, killpg};
use nix::unistd::Pid;
use std::sync::atomic::{AtomicU64, Ordering};
use tokio::process::Child;

/// The variable by which a run's processes are known.
pub(super) const RUN: &str = "SLIPWATCH_RUN";
/// How often the processes are looked through for those of a run.
const MOST_LOOKS: usize = 4;

/// What a run's processes have in their environment, and no others.
pub(super) fn run_name() -> String {
    static RUNS: AtomicU64 = AtomicU64::new(0);
    let number = RUNS.fetch_add(1, Ordering::Relaxed);
    format!("{}-{number}", std::process::id())
}

/// Ends what a run has started and what has left its group, as by `setsid`.
pub(super) fn kill_all_of(run: &str) {
    // What is started while we look is seen the next time.
    for _ in 0..MOST_LOOKS {
        if kill_those_of(run) == 0 {
            return;
        }
    }
}

/// Ends what is seen of a run; how many processes.
fn kill_those_of(run: &str) -> usize {
    let mark = format!("{RUN}={run}");
    let is_of_it = |environment: &[u8]| {
        environment
            .split(|byte| *byte == 0)
            .any(|one| one == mark.as_bytes())
    };
    let mut killed = 0;
    let Ok(processes) = std::fs::read_dir("/proc") else {
        return killed;
    };
    for process in processes.flatten() {
        let number = process
            .file_name()
            .to_str()
            .and_then(|name| name.parse().ok());
        let Some(number) = number else { continue };
        // It may have ended meanwhile, or be another user's.
        let environment = std::fs::read(process.path().join("environ"));
        if environment.is_ok_and(|environment| is_of_it(&environment)) {
            killed += usize::from(kill(Pid::from_raw(number), Signal::SIGKILL).is_ok());
        }
    }
    killed
}

/// A hook's process group and what has left it, killed when the run is given up half-way.
#[derive(Debug)]
pub(super) struct ProcessGroup {
    group: Option<Pid>,
    run: String,
}

impl ProcessGroup {
    pub(super) fn of(child: &Child, run: &str) -> Self {
        let id = child.id().and_then(|id| i32::try_from(id).ok());
        Self {
            group: id.map(Pid::from_raw),
            run: run.to_owned(),
        }
    }

    /// The hook has ended by itself; its number may soon be another process's.
    pub(super) fn leave(&mut self) {
        self.group = None;
    }

    pub(super) fn kill(&mut self) {
        if let Some(group) = self.group.take() {
            kill_descendants(group);
            let _ = killpg(group, Signal::SIGKILL);
            kill_all_of(&self.run);
        }
    }
}

impl Drop for ProcessGroup {
    fn drop(&mut self) {
        self.kill();
    }
}

//! Limits where a hook may write (Landlock, of Linux); it may read everything.
//!
//! Landlock binds the process that asks for it and its children, so the daemon does not start a
//! hook itself: it starts this program again, which limits itself, starts the hook and waits for its
//! end. What the hook has left at work is this one's meanwhile, whatever it has done to be nobody's.

use super::descendants::kill_descendants;
use crate::config::HookConfig;
use landlock::{
    ABI, Access, AccessFs, Ruleset, RulesetAttr, RulesetCreatedAttr, RulesetError, RulesetStatus,
    path_beneath_rules,
};
use nix::sys::prctl::set_child_subreaper;
use nix::sys::signal::{SigSet, Signal, raise};
use nix::unistd::Pid;
use std::convert::Infallible;
use std::ffi::{OsStr, OsString};
use std::io;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};

/// Linux 6.2: files can be kept from being truncated. Later ones would also bind devices' controls.
const KERNEL: ABI = ABI::V3;
/// This program, even after an upgrade has put another one in its place.
pub const OURSELVES: &str = "/proc/self/exe";
/// Where every hook may write.
const ALWAYS_WRITABLE: [&str; 2] = ["/tmp", "/dev/null"];

/// How far the kernel limits where a hook may write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WriteLimits {
    /// All of them.
    Full,
    /// Some: an old kernel knows not every kind of write.
    Partial,
    /// None: the kernel has no landlock, or it is switched off.
    Unsupported,
}

/// A hook cannot be run: what the process ends with that was to run it, as a shell does.
pub const CANNOT_RUN: u8 = 126;
/// What its last line on stderr begins with then: a hook may end with that code too.
pub const CANNOT_RUN_BECAUSE: &str = "the hook cannot be run: ";

/// Why the sandbox of a hook could not be set up, or the hook not started.
#[derive(Debug, thiserror::Error)]
pub enum SandboxError {
    /// The kernel refused.
    #[error("{CANNOT_RUN_BECAUSE}the sandbox cannot be set up: {0}")]
    Refused(#[from] RulesetError),
    /// The program cannot be run.
    #[error("{CANNOT_RUN_BECAUSE}{}: {source}", .program.display())]
    NotStarted {
        /// The program.
        program: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// Limits this thread and its children; a writable path that is not there is passed over.
///
/// # Errors
/// When a kernel that has landlock refuses.
fn limit_writes(writable: &[PathBuf]) -> Result<WriteLimits, RulesetError> {
    let always = ALWAYS_WRITABLE.iter().map(Path::new);
    let writable = always.chain(writable.iter().map(PathBuf::as_path));
    let status = Ruleset::default()
        .handle_access(AccessFs::from_all(KERNEL))?
        .create()?
        .add_rules(path_beneath_rules(["/"], AccessFs::from_read(KERNEL)))?
        .add_rules(path_beneath_rules(writable, AccessFs::from_all(KERNEL)))?
        .restrict_self()?;
    Ok(match status.ruleset {
        RulesetStatus::FullyEnforced => WriteLimits::Full,
        RulesetStatus::PartiallyEnforced => WriteLimits::Partial,
        RulesetStatus::NotEnforced => WriteLimits::Unsupported,
    })
}

/// How far this kernel would limit that; tried on a thread that then ends.
pub fn probe() -> WriteLimits {
    let tried = std::thread::spawn(|| limit_writes(&[])).join();
    tried
        .ok()
        .and_then(Result::ok)
        .unwrap_or(WriteLimits::Unsupported)
}

/// Says in the log how far `hooks` are kept from writing elsewhere.
pub fn announce(hooks: &[HookConfig]) {
    if hooks.iter().all(|hook| hook.launcher.is_none()) {
        return;
    }
    match probe() {
        WriteLimits::Full => tracing::info!("hooks can write only where they are allowed to"),
        WriteLimits::Partial => {
            tracing::warn!(
                "an old kernel: hooks are kept from most writes elsewhere, not from all"
            );
        }
        WriteLimits::Unsupported => {
            tracing::warn!("no landlock in this kernel: hooks can write wherever the daemon can");
        }
    }
}

/// The command that runs `hook`, limited where it has a launcher.
pub(super) fn command(hook: &HookConfig) -> tokio::process::Command {
    let (program, arguments) = (from_anywhere(&hook.program()), hook.run.iter().skip(1));
    let Some(launcher) = &hook.launcher else {
        let mut command = tokio::process::Command::new(program);
        command.args(arguments);
        return command;
    };
    let mut command = tokio::process::Command::new(launcher);
    command.args(["hook", "exec", "--writable", "."]);
    for path in &hook.writable {
        command.arg("--writable").arg(from_anywhere(path));
    }
    command.arg("--").arg(program).args(arguments);
    command
}

/// The path as it can be used from the hook's folder too, where the hook is started; a bare name
/// is looked up in `PATH`.
fn from_anywhere(path: &Path) -> PathBuf {
    if path.components().count() > 1 {
        std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
    } else {
        path.to_owned()
    }
}

/// Runs `program`, which may write below `writable`, in `/tmp` and to `/dev/null`, without limits where the kernel has none, and
/// ends as it does. What it leaves at work goes on where it went well, and is ended where not.
///
/// # Errors
/// [`SandboxError`]; on success this does not return.
pub fn become_hook(
    writable: &[PathBuf],
    program: &OsStr,
    arguments: &[OsString],
) -> Result<Infallible, SandboxError> {
    limit_writes(writable)?;
    // A kernel that refuses it leaves what detaches itself to others, as before.
    let _ = set_child_subreaper(true);
    // A hook that signals its own group does not signal this process.
    let started = Command::new(program)
        .args(arguments)
        .process_group(0)
        .spawn();
    // Not before the start: the hook would inherit the mask. What asks every process of the service to end is for the hook to take,
    // and this process ends after it.
    let asked = [
        Signal::SIGHUP,
        Signal::SIGINT,
        Signal::SIGQUIT,
        Signal::SIGTERM,
    ];
    let _ = SigSet::from_iter(asked).thread_block();
    let ended = started.and_then(|mut hook| hook.wait());
    let status = ended.map_err(|source| SandboxError::NotStarted {
        program: program.into(),
        source,
    })?;
    if !status.success() {
        kill_descendants(Pid::this());
    }
    end_as(status)
}

/// Ends as another process has.
fn end_as(status: ExitStatus) -> ! {
    let signal = status.signal().unwrap_or_default();
    if let Ok(signal) = Signal::try_from(signal) {
        let _ = SigSet::all().thread_unblock();
        let _ = raise(signal);
    }
    std::process::exit(status.code().unwrap_or(128 + signal))
}

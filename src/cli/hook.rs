//! `hook exec`: what the daemon starts to run a hook within walls.

use crate::runtime::sandbox;
use std::ffi::OsString;
use std::path::PathBuf;

/// About hooks
#[derive(Debug, clap::Subcommand)]
#[command(hide = true)]
pub(super) enum Command {
    /// Become a program that can write only where it is allowed to
    Exec(Exec),
}

#[derive(Debug, clap::Args)]
pub(super) struct Exec {
    /// Where it may write, beside /tmp and /dev/null
    #[arg(long, value_name = "PATH")]
    writable: Vec<PathBuf>,
    /// The program and its arguments
    #[arg(required = true, last = true, value_name = "PROGRAM")]
    run: Vec<OsString>,
}

/// Becomes the hook.
pub(super) fn run(command: &Command) -> anyhow::Result<()> {
    let Command::Exec(Exec { writable, run }) = command;
    if let Some((program, arguments)) = run.split_first() {
        match sandbox::become_hook(writable, program, arguments)? {}
    }
    Ok(())
}

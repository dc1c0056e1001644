//! `completions SHELL`: what a shell needs to complete our commands and flags.

use clap::CommandFactory;
use clap_complete::Shell;
use std::io::Write;

/// Print the completions for a shell, to be put where that shell looks for them
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Which shell
    #[arg(value_enum, value_name = "SHELL")]
    shell: Shell,
}

/// Prints them.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let mut text = Vec::new();
    clap_complete::generate(
        args.shell,
        &mut super::Cli::command(),
        "slipwatch",
        &mut text,
    );
    std::io::stdout().lock().write_all(&text)?;
    Ok(())
}

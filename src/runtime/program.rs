//! Programs as a way out: whether one could be run, and the run.

use super::hook::run_program;
use super::link;
use super::way_out::{DeliveryAttempt, WayOut};
use nix::unistd::{AccessFlags, access};
use std::ffi::OsStr;
use std::fs::File;
use std::io::Read;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

/// A program of the machine, as a process of its own.
pub(super) static PROGRAM: WayOut = WayOut {
    table: "hook",
    send: |delivery| {
        Box::pin(async move {
            let DeliveryAttempt {
                hook,
                alert,
                attempt,
            } = delivery;
            let link = link::of(&hook, &alert).await;
            run_program(&hook, &alert, attempt, link.as_deref()).await
        })
    },
    repeat: None,
    ready: |hook| runnable(&hook.program()),
};

/// The kernel reads no more of a script's first line.
const FIRST_LINE_BYTES: u64 = 256;

/// Is it there, can it be executed, is its interpreter there.
fn runnable(program: &Path) -> Result<String, String> {
    let found = find(program).ok_or_else(|| format!("there is no {}", program.display()))?;
    let name = found.display();
    access(&found, AccessFlags::X_OK)
        .map_err(|error| format!("{name} cannot be executed ({error}); chmod +x it"))?;
    let words = match start(&found).map_err(|error| format!("{name}: {error}"))? {
        HookStart::Binary => return Ok(format!("{name} can be run")),
        HookStart::Windows => {
            return Err(format!(
                "{name}: its lines end as on Windows, so that the kernel finds no such interpreter; \
                 write them again with sed -i 's/\\r$//' {name}"
            ));
        }
        HookStart::Text => {
            return Err(format!(
                "{name}: its first line names no interpreter, and the kernel runs no text without one; begin it with #!/bin/sh"
            ));
        }
        HookStart::Script(words) => words,
    };
    for word in &words {
        let there = find(word).filter(|path| access(path, AccessFlags::X_OK).is_ok());
        there.ok_or_else(|| format!("{name}: its interpreter {} is not there", word.display()))?;
    }
    Ok(format!("{name} can be run"))
}

/// A bare name is looked up in `PATH`.
fn find(program: &Path) -> Option<PathBuf> {
    if program.components().count() > 1 {
        return program.is_file().then(|| program.to_owned());
    }
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .map(|folder| folder.join(program))
        .find(|path| path.is_file())
}

/// How a program begins.
enum HookStart {
    Binary,
    /// What its first line names, and for `env` what that would start.
    Script(Vec<PathBuf>),
    /// Text without such a line, or nothing.
    Text,
    /// A first line that ends in a carriage return, which the kernel takes for a part of the name.
    Windows,
}

fn start(program: &Path) -> std::io::Result<HookStart> {
    let mut start = Vec::new();
    File::open(program)?
        .take(FIRST_LINE_BYTES)
        .read_to_end(&mut start)?;
    let Some(line) = start.strip_prefix(b"#!") else {
        // Programs of every kind have bytes of no text at their beginning.
        let is_text = start
            .iter()
            .all(|byte| !byte.is_ascii_control() || byte.is_ascii_whitespace());
        return Ok(if is_text {
            HookStart::Text
        } else {
            HookStart::Binary
        });
    };
    let line = line.split(|byte| *byte == b'\n').next().unwrap_or(line);
    if line.ends_with(b"\r") {
        return Ok(HookStart::Windows);
    }
    let mut words = line
        .split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
        .map(|word| PathBuf::from(OsStr::from_bytes(word)));
    let first: Vec<PathBuf> = words.by_ref().take(1).collect();
    let is_env = first.iter().any(|path| path.ends_with("env"));
    let options = |word: &PathBuf| word.as_os_str().as_bytes().starts_with(b"-");
    let second = words.find(|word| is_env && !options(word));
    Ok(HookStart::Script(first.into_iter().chain(second).collect()))
}

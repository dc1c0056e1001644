//! Whether the hooks could be run; none is.

use super::{CheckVerdict, Finding};
use crate::config::{HookConfig, Secret};
use crate::runtime::sandbox::{self, Walls};
use crate::runtime::tls;
use nix::unistd::{AccessFlags, access};
use std::ffi::OsStr;
use std::fs::File;
use std::io::Read;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

/// The kernel reads no more of a script's first line.
const FIRST_LINE_BYTES: u64 = 256;

/// Is it there, can it be executed, is its interpreter there.
pub(super) fn finding(hook: &HookConfig) -> Finding {
    if let Some(webhook) = &hook.webhook {
        let name = &webhook.name;
        let secret = webhook.secret_file.as_deref().map(Secret::read).transpose();
        let secret = secret.map_err(|error| error.to_string());
        let trusted = webhook.ca_file.as_deref().map(tls::own).transpose();
        let (verdict, text) = match secret.and(trusted) {
            Ok(_) => (
                CheckVerdict::Good,
                format!("{name} has what it needs; hook test sends to it"),
            ),
            Err(error) => (
                CheckVerdict::Wrong,
                format!("{name}: {error}: alerts would go nowhere"),
            ),
        };
        return Finding::new("webhook", verdict, text);
    }
    if let Some(topic) = &hook.mqtt {
        let trusted = topic.ca_file.as_deref().map(tls::own).transpose();
        let name = &topic.name;
        let (verdict, text) = match trusted {
            Ok(_) => (
                CheckVerdict::Good,
                format!("{name} has what it needs; hook test publishes to it"),
            ),
            Err(error) => (
                CheckVerdict::Wrong,
                format!("{name}: {error}: alerts would go nowhere"),
            ),
        };
        return Finding::new("mqtt_out", verdict, text);
    }
    if let Some(cap) = &hook.cap {
        let folder = cap.folder.display();
        let (verdict, text) = match writable(&cap.folder) {
            Ok(()) => (
                CheckVerdict::Good,
                format!("{folder} can be written to; hook test writes a message"),
            ),
            Err(error) => (
                CheckVerdict::Wrong,
                format!("{folder}: {error}: alerts would go nowhere"),
            ),
        };
        return Finding::new("cap", verdict, text);
    }
    let (verdict, text) = match runnable(&hook.program()) {
        Ok(text) => (CheckVerdict::Good, text),
        Err(text) => (
            CheckVerdict::Wrong,
            format!("{text}: alerts would go nowhere"),
        ),
    };
    Finding::new("hook", verdict, text)
}

/// Whether a message could be written there, or the folder be made.
fn writable(folder: &Path) -> nix::Result<()> {
    // The last ancestor of a relative path is empty, and is the folder one is in.
    let is_here = |folder: &Path| folder.as_os_str().is_empty();
    let each = folder.ancestors();
    let mut each = each.map(|one| if is_here(one) { Path::new(".") } else { one });
    access(
        each.find(|folder| folder.is_dir()).unwrap_or(folder),
        AccessFlags::W_OK | AccessFlags::X_OK,
    )
}

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
    /// A first line that ends in a carriage return, which the kernel takes for a part of the name.
    Windows,
}

fn start(program: &Path) -> std::io::Result<HookStart> {
    let mut start = Vec::new();
    File::open(program)?
        .take(FIRST_LINE_BYTES)
        .read_to_end(&mut start)?;
    let Some(line) = start.strip_prefix(b"#!") else {
        return Ok(HookStart::Binary);
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

/// Whether the kernel would hold the walls, where a hook is to have some.
pub(super) fn walls(hooks: &[HookConfig]) -> Option<Finding> {
    let is_needed = hooks.iter().any(|hook| hook.sandbox);
    let finding = |verdict, text: &str| Finding::new("sandbox", verdict, text);
    is_needed.then(|| match sandbox::probe() {
        Walls::Whole => finding(
            CheckVerdict::Good,
            "hooks can write only where they are allowed to",
        ),
        Walls::Partial => finding(
            CheckVerdict::Doubtful,
            "an old kernel keeps hooks from most writes elsewhere, not from all",
        ),
        Walls::Missing => finding(
            CheckVerdict::Doubtful,
            "the kernel has no landlock: hooks can write wherever the daemon can",
        ),
    })
}

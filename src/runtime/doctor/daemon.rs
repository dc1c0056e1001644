//! Whether the daemon could start as this user: its state, its token, its address; and whether this is its user.

use super::{CheckVerdict, Finding};
use crate::config::Config;
use crate::runtime::inherited::InheritedReadings;
use crate::store::Store;
use nix::unistd::geteuid;
use std::fs::File;
use std::net::TcpListener;
use std::path::Path;

const STATE: &str = "state";
const LISTEN: &str = "listen";

/// What a start would meet.
pub(super) fn findings(config: &Config) -> Vec<Finding> {
    let site = &config.site;
    let mut findings = vec![user()];
    findings.extend(database(&site.state_dir));
    findings.extend(inherited(config));
    findings.extend(site.token_file.as_deref().map(|_| token(config)));
    findings.extend(site.listen.map(|_| listen(config)));
    findings
}

/// Whoever may do everything shows nothing of what the daemon may do.
fn user() -> Finding {
    if geteuid().is_root() {
        let text = "looked at as root, who may do everything: what the daemon's own user may do is shown by \
                    slipwatch doctor --user NAME";
        return Finding::new("user", CheckVerdict::Doubtful, text);
    }
    let text = format!("checked as user {}, as the daemon must run", geteuid());
    Finding::new("user", CheckVerdict::Good, text)
}

/// A state that another user began may not be this one's to write.
fn database(folder: &Path) -> Option<Finding> {
    let files = [Store::file(folder), folder.join("lock")];
    let there: Vec<_> = files.iter().filter(|file| file.exists()).collect();
    if there.is_empty() {
        return None;
    }
    let tried = there.iter().find_map(|file| {
        let opened = File::options().read(true).write(true).open(file);
        Some((file, opened.err()?))
    });
    let Some((file, error)) = tried else {
        let text = format!("the state in {} can be written", folder.display());
        return Some(Finding::new(STATE, CheckVerdict::Good, text));
    };
    let text = format!(
        "{} cannot be written as this user: {error}; give the state folder to the daemon's user with chown -R",
        file.display()
    );
    Some(Finding::new(STATE, CheckVerdict::Wrong, text))
}

/// A state may have been begun by another site, of another config in the same folder.
fn inherited(config: &Config) -> Option<Finding> {
    let inherited = InheritedReadings::of(config)?;
    Some(Finding::new(
        STATE,
        CheckVerdict::Doubtful,
        inherited.text(config),
    ))
}

fn token(config: &Config) -> Finding {
    match config.site.token() {
        Ok(_) => Finding::new("token", CheckVerdict::Good, "the token can be read"),
        Err(error) => Finding::new("token", CheckVerdict::Wrong, error.to_string()),
    }
}

fn listen(config: &Config) -> Finding {
    let Some(address) = config.site.listen else {
        return Finding::new(LISTEN, CheckVerdict::Unknown, "nothing to listen on");
    };
    if Store::is_held(&config.site.state_dir) {
        let text = format!("{address} is not tried while the daemon runs");
        return Finding::new(LISTEN, CheckVerdict::Unknown, text);
    }
    match TcpListener::bind(address) {
        Ok(_) => Finding::new(LISTEN, CheckVerdict::Good, format!("{address} is free")),
        Err(error) => {
            let text = format!("{address} cannot be listened on: {error}");
            Finding::new(LISTEN, CheckVerdict::Wrong, text)
        }
    }
}

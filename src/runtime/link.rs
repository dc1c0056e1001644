//! The link in an alert's own message by which it is acknowledged: what it names is signed, and nobody else can make one.
//!
//! It holds the alert's key, whether it is meant, and until when it is good, under HMAC-SHA256 with a secret that the daemon
//! makes and keeps in its state folder. That it is used once only the state says (`Store::use_link`).

use super::clock;
use super::hook::{Alert, MessageState, Status};
use crate::config::{Config, HookConfig, Links};
use crate::reading::Timestamp;
use base64::Engine;
use base64::engine::general_purpose::{STANDARD, URL_SAFE_NO_PAD};
use hmac::{Hmac, KeyInit, Mac};
use serde::Deserialize;
use sha2::Sha256;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, Read, Write as _};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

/// What is signed begins with it, so that no other signature under the same secret could ever be taken for one.
const PURPOSE: &str = "slipwatch acknowledge 1";
/// Of the secret, bytes.
const SECRET_BYTES: usize = 32;

/// What a link asks for, as it came.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AskedLink {
    /// The alert's key.
    pub alert: String,
    /// Whether the alert is meant; a word of [`Status`].
    pub status: String,
    /// Until when it is good, Unix seconds by the host's clock.
    pub until: i64,
    /// The signature of all this.
    pub signature: String,
}

/// A link that is one of ours.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SignedLink {
    pub(super) key: String,
    pub(super) status: Status,
    pub(super) until: Timestamp,
}

/// The link for a message of `hook` about `alert`; `None` where there is nothing to acknowledge by one: it has ended, or reports
/// many benchmarks at once. A link that cannot be made is logged: the message goes out without it.
pub(super) async fn of(hook: &HookConfig, alert: &Alert) -> Option<String> {
    let links = hook.links.clone()?;
    if alert.state != MessageState::Firing || alert.is_flood() {
        return None;
    }
    let (key, status) = (alert.key.clone(), alert.status);
    // A disk may hang: no alert waits with it for longer than its hook may take.
    let making = tokio::task::spawn_blocking(move || url(&links, &key, status));
    let made = match tokio::time::timeout(hook.timeout, making).await {
        Ok(made) => made.unwrap_or_else(|error| Err(io::Error::other(error))),
        Err(_elapsed) => Err(io::ErrorKind::TimedOut.into()),
    };
    made.inspect_err(|error| tracing::error!(%error, "a message has no link to acknowledge it by"))
        .ok()
}

fn url(links: &Links, key: &str, status: Status) -> io::Result<String> {
    let until = clock::now().as_second() + links.within.as_secs();
    let mac = mac(&secret(&links.secret_file)?, key, status, until)?;
    let signature = URL_SAFE_NO_PAD.encode(mac.finalize().into_bytes());
    Ok(format!(
        "{}/acknowledge?alert={}&status={}&until={until}&signature={signature}",
        links.public_url,
        percent_encoded(key),
        status.name(),
    ))
}

/// What a link names, where it is one of ours; `None` where it is not.
///
/// # Errors
/// When the secret cannot be read.
pub(super) fn verified(file: &Path, asked: &AskedLink) -> io::Result<Option<SignedLink>> {
    let known = [Status::Actual, Status::Exercise, Status::Test].into_iter();
    let status = known.into_iter().find(|one| one.name() == asked.status);
    let signature = URL_SAFE_NO_PAD.decode(&asked.signature);
    let (Some(status), Ok(signature)) = (status, signature) else {
        return Ok(None);
    };
    let mac = mac(&secret(file)?, &asked.alert, status, asked.until)?;
    let until = Timestamp::from_second(asked.until);
    Ok(match (mac.verify_slice(&signature), until) {
        (Ok(()), Ok(until)) => Some(SignedLink {
            key: asked.alert.clone(),
            status,
            until,
        }),
        (Ok(()) | Err(_), _) => None,
    })
}

/// The key comes last: it alone could hold a line's end.
fn mac(secret: &[u8], key: &str, status: Status, until: i64) -> io::Result<Hmac<Sha256>> {
    let mut mac = Hmac::<Sha256>::new_from_slice(secret).map_err(io::Error::other)?;
    mac.update(format!("{PURPOSE}\n{}\n{until}\n{key}", status.name()).as_bytes());
    Ok(mac)
}

/// Makes the secret that links by `config` need. Alerts go out in any case, then without a link.
pub(super) fn make_secret_of(config: &Config) {
    if let Some(links) = &config.site.links
        && let Err(error) = make_secret(&links.secret_file)
    {
        tracing::error!(%error, "no message will have a link to acknowledge it by");
    }
}

/// Makes the secret where there is none yet, for nobody else to read.
///
/// # Errors
/// When it cannot be written, or what is there cannot be used.
fn make_secret(file: &Path) -> io::Result<()> {
    if file.try_exists()? {
        return secret(file).map(drop);
    }
    let folder = file.parent().unwrap_or(Path::new("."));
    let mut bytes = [0_u8; SECRET_BYTES];
    File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    // Its mode is 0600, and nobody sees half of it.
    let mut partial = tempfile::NamedTempFile::new_in(folder)?;
    writeln!(partial, "{}", STANDARD.encode(bytes))?;
    partial.as_file().sync_all()?;
    partial.persist_noclobber(file)?;
    File::open(folder)?.sync_all()
}

fn secret(file: &Path) -> io::Result<Vec<u8>> {
    let fail = |why: String| io::Error::other(format!("{}: {why}", file.display()));
    let metadata = fs::metadata(file).map_err(|error| fail(error.to_string()))?;
    if metadata.permissions().mode() & 0o077 != 0 {
        return Err(fail(
            "others on this machine can read the secret: chmod 600".to_owned(),
        ));
    }
    let text = fs::read_to_string(file).map_err(|error| fail(error.to_string()))?;
    let bytes = STANDARD.decode(text.trim()).ok();
    bytes
        .filter(|bytes| bytes.len() == SECRET_BYTES)
        .ok_or_else(|| fail("this is no secret of ours: move it away".to_owned()))
}

fn percent_encoded(text: &str) -> String {
    let mut out = String::new();
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            out.push(char::from(byte));
        } else {
            // Writing to a string cannot fail.
            let _ = write!(out, "%{byte:02X}");
        }
    }
    out
}

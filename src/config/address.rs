//! Addresses that the daemon connects to over HTTP, and whom it trusts there.

use super::table::{Placed, Section};
use std::fs::File;
use std::path::Path;

/// The address in `url`.
pub(super) fn of(section: &Section<'_>, url: &Placed<String>) -> Option<hyper::Uri> {
    of_key(section, "url", url)
}

/// The address under `key`.
pub(super) fn of_key(section: &Section<'_>, key: &str, url: &Placed<String>) -> Option<hyper::Uri> {
    let refuse = |why: &str, fix: &str| {
        let what = format!("{} = {:?} {why}", section.path(key), url.value);
        section.error(&url.at, what, fix);
        None
    };
    let Ok(address) = url.value.parse::<hyper::Uri>() else {
        return refuse("is no address", "write it as in \"http://host:port/path\"");
    };
    if !matches!(address.scheme_str(), Some("http" | "https")) {
        let fix = "write it as in \"https://host/path\" or \"http://host:port/path\"";
        return refuse("is neither http nor https", fix);
    }
    let has_user = (address.authority()).is_some_and(|one| one.as_str().contains('@'));
    if address.host().is_none_or(str::is_empty) {
        return refuse("names no host", "write it as in \"http://host:port/path\"");
    }
    if has_user {
        return refuse("holds a password, which logs would show", "leave it out");
    }
    Some(address)
}

/// `ca_file`, as it stands there; refused where the address has no TLS.
pub(super) fn ca_file(section: &mut Section<'_>, address: Option<&hyper::Uri>) -> Option<String> {
    let is_plain = address.and_then(hyper::Uri::scheme_str) == Some("http");
    ca_file_where(section, !is_plain)
}

/// The same, where it is known whether the address has TLS.
pub(super) fn ca_file_where(section: &mut Section<'_>, is_secured: bool) -> Option<String> {
    let given = section.text("ca_file")?;
    if !is_secured {
        section.error(
            &given.at,
            format!("{} is not used without TLS", section.path("ca_file")),
            "leave it out, or write an address with TLS: https:// or mqtts://",
        );
    }
    Some(given.value)
}

/// Why the certificate authorities in `file` cannot be read.
pub(super) fn unreadable(file: &Path) -> Option<String> {
    let error = File::open(file).err()?;
    Some(format!(
        "cannot read the ca_file {}: {error}",
        file.display()
    ))
}

//! Who may use a state: what is said where the system does not let this user.

use super::{FILE, StoreError};
use nix::unistd::{Uid, User};
use rusqlite::ErrorCode;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// The error itself or, where it comes of what this user may not do in the state folder, one that says what to do.
pub(super) fn explained(error: StoreError, folder: &Path) -> StoreError {
    let is_denied = if let StoreError::Sqlite(error) = &error {
        matches!(
            error.sqlite_error_code(),
            Some(ErrorCode::ReadOnly | ErrorCode::CannotOpen | ErrorCode::PermissionDenied)
        )
    } else {
        matches!(&error, StoreError::Io(error) if error.kind() == io::ErrorKind::PermissionDenied)
    };
    if !is_denied {
        return error;
    }
    let file = folder.join(FILE);
    let (path, what) = if file.metadata().is_err() {
        (folder, "looked into")
    } else if File::open(&file).is_err() {
        (file.as_path(), "read")
    } else if OpenOptions::new().write(true).open(&file).is_err() {
        (file.as_path(), "written to")
    } else {
        (folder, "written to")
    };
    StoreError::Denied {
        path: path.to_owned(),
        what,
        us: name_of(Uid::effective()),
        owner: owner_of(folder),
    }
}

/// Whom the folder belongs to.
fn owner_of(folder: &Path) -> String {
    let metadata = folder.metadata();
    metadata.map_or_else(
        |_| "the daemon's user".to_owned(),
        |metadata| name_of(Uid::from_raw(metadata.uid())),
    )
}

fn name_of(user: Uid) -> String {
    let known = User::from_uid(user).ok().flatten();
    known.map_or_else(|| format!("'#{user}'"), |user| user.name)
}

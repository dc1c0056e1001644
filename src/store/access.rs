//! Who may use a state: what is said where the system does not let this user.

use super::{FILE, StoreError};
use nix::errno::Errno;
use nix::fcntl::{AT_FDCWD, AtFlags};
use nix::unistd::{AccessFlags, Uid, User, faccessat};
use rusqlite::ErrorCode;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// What the name of the database ends with, and those of the files beside it.
const FILES: [&str; 3] = ["", "-wal", "-shm"];

/// The error itself or, where it comes of what the system does not let this user do in the state folder, one that says what
/// to do.
pub(super) fn explained(error: StoreError, folder: &Path) -> StoreError {
    let may_be_refused = if let StoreError::Sqlite(error) = &error {
        matches!(
            error.sqlite_error_code(),
            Some(ErrorCode::ReadOnly | ErrorCode::CannotOpen | ErrorCode::PermissionDenied)
        )
    } else {
        matches!(&error, StoreError::Io(error) if error.kind() == io::ErrorKind::PermissionDenied)
    };
    if !may_be_refused {
        return error;
    }
    match refusal(folder) {
        Some((path, what, Errno::EACCES | Errno::EPERM)) => StoreError::Denied {
            path,
            what,
            us: name_of(Uid::effective()),
            owner: owner_of(folder),
        },
        Some((path, _, Errno::EROFS)) => StoreError::ReadOnlyDisk { path },
        // The database failed for another reason: it is a folder, say.
        Some(_) | None => error,
    }
}

/// What the system does not let us do there, and why. Nothing is opened: to close a file of a database gives up the locks
/// that this program has on it.
fn refusal(folder: &Path) -> Option<(PathBuf, &'static str, Errno)> {
    let ask = |path: &Path, what, mode| {
        let refused = faccessat(AT_FDCWD, path, mode, AtFlags::AT_EACCESS);
        let errno = refused.err().filter(|errno| *errno != Errno::ENOENT)?;
        Some((path.to_owned(), what, errno))
    };
    let each = |what, mode| {
        let mut files = FILES.iter();
        files.find_map(|end| ask(&folder.join(format!("{FILE}{end}")), what, mode))
    };
    ask(folder, "looked into", AccessFlags::X_OK)
        .or_else(|| each("read", AccessFlags::R_OK))
        .or_else(|| each("written to", AccessFlags::W_OK))
        .or_else(|| ask(folder, "written to", AccessFlags::W_OK))
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

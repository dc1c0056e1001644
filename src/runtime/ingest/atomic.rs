//! A file that is either wholly there or not at all.

use super::IngestError;
use std::fs::{File, Permissions};
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

/// Writes beside the file under another name, syncs, and renames; on failure the old file, if
/// any, stands untouched.
pub(super) fn write_atomically(
    file: &Path,
    write: impl FnOnce(&mut File) -> Result<(), IngestError>,
) -> Result<(), IngestError> {
    let fail = |source: io::Error| IngestError::Write {
        file: file.into(),
        source,
    };
    let folder = match file.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    // A temporary file is private by default; this one becomes the user's own.
    let mut temporary = tempfile::Builder::new()
        .prefix(".slipwatch-")
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(folder)
        .map_err(fail)?;
    write(temporary.as_file_mut()).map_err(|error| {
        if let IngestError::Write { source, .. } = error {
            fail(source)
        } else {
            error
        }
    })?;
    temporary.as_file().sync_all().map_err(fail)?;
    temporary.persist(file).map_err(|error| fail(error.error))?;
    Ok(())
}

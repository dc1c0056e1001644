//! Small JSON files in the state folder, beside the database: what is known over restarts and follows from no reading.

use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

/// What the file holds; `None` where there is none, or none that can be read.
pub(super) fn read<T: DeserializeOwned>(file: &Path) -> Option<T> {
    serde_json::from_str(&fs::read_to_string(file).ok()?).ok()
}

/// Writes it under its name into the folder, see [`replace`].
pub(super) fn write(folder: &Path, name: &str, value: &impl Serialize) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    replace(&folder.join(name), &serde_json::to_vec(value)?)
}

/// Writes the whole file. Nobody sees half of it, and it is on the disk when this returns.
pub(super) fn replace(file: &Path, bytes: &[u8]) -> io::Result<()> {
    let partial = file.with_extension("partial");
    let mut out = File::create(&partial)?;
    out.write_all(bytes)?;
    out.sync_all()?;
    fs::rename(&partial, file)?;
    file.parent()
        .map_or(Ok(()), |folder| File::open(folder)?.sync_all())
}

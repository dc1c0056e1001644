//! The bytes of a whole file, unpacked where its name ends in `.gz`.

use super::IngestError;
use flate2::read::MultiGzDecoder;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Most that is unpacked of one file, bytes: what packs a thousandfold must not fill the memory.
const MOST_UNPACKED: u64 = 512 << 20;

/// Whether the name says that the file is packed.
pub fn is_packed(file: &Path) -> bool {
    file.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("gz"))
}

/// The path without `.gz`.
pub fn unpacked_name(file: &Path) -> PathBuf {
    if is_packed(file) {
        file.with_extension("")
    } else {
        file.to_owned()
    }
}

/// Unpacks a file piece by piece.
///
/// # Errors
/// When it cannot be opened. Reading fails where the content is damaged or cut short, and beyond
/// 512 MiB.
pub fn unpack(file: &Path) -> io::Result<impl Read + Send + std::fmt::Debug + use<>> {
    Ok(Bounded {
        packed: MultiGzDecoder::new(File::open(file)?),
        left: MOST_UNPACKED,
    })
}

pub(super) fn read_bytes(file: &Path) -> Result<Vec<u8>, IngestError> {
    let read = || {
        if !is_packed(file) {
            return std::fs::read(file);
        }
        let mut bytes = Vec::new();
        unpack(file)?.read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    read().map_err(|source| IngestError::Read {
        file: file.into(),
        source,
    })
}

#[derive(Debug)]
struct Bounded {
    packed: MultiGzDecoder<File>,
    left: u64,
}

impl Read for Bounded {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.packed.read(buffer)?;
        self.left = self.left.checked_sub(read as u64).ok_or_else(|| {
            io::Error::other(format!("unpacks to more than {MOST_UNPACKED} bytes"))
        })?;
        Ok(read)
    }
}

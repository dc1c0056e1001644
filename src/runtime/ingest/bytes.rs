//! The bytes of a whole file, unpacked where its name ends in `.gz`.

use super::IngestError;
use flate2::read::MultiGzDecoder;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Most that is unpacked of one file, bytes: what packs a thousandfold must not fill the memory.
const MOST_UNPACKED: u64 = 512 << 20;

/// Bytes that show what a file is.
const FIRST: u64 = 64;

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

/// The name by which stdin is read as a file.
const STDIN: &str = "-";

/// Whether stdin is meant.
pub(super) fn is_stdin(file: &Path) -> bool {
    file.as_os_str() == STDIN
}

/// All of stdin: read once, as several look at a file.
pub(super) fn stdin() -> io::Result<&'static [u8]> {
    static ALL: OnceLock<Result<Vec<u8>, io::ErrorKind>> = OnceLock::new();
    let read = || {
        let mut all = Vec::new();
        let mut bounded = io::stdin().lock().take(MOST_UNPACKED);
        let read = bounded.read_to_end(&mut all);
        read.map(|_| all).map_err(|error| error.kind())
    };
    match ALL.get_or_init(read) {
        Ok(all) => Ok(all),
        Err(kind) => Err((*kind).into()),
    }
}

/// The name of a file as errors and benchmarks without an id have it, unpacked.
pub(super) fn shown_name(file: &Path) -> PathBuf {
    if is_stdin(file) {
        PathBuf::from("stdin")
    } else {
        unpacked_name(file)
    }
}

/// How the file begins, unpacked; nothing where it cannot be read: whoever reads it says why. Nothing of a pipe either, which
/// can be read but once.
pub(super) fn first_bytes(file: &Path) -> Vec<u8> {
    let mut bytes = Vec::new();
    if !file.is_file() {
        return bytes;
    }
    let read = if is_packed(file) {
        unpack(file).and_then(|packed| packed.take(FIRST).read_to_end(&mut bytes))
    } else {
        File::open(file).and_then(|plain| plain.take(FIRST).read_to_end(&mut bytes))
    };
    match read {
        Ok(_) => bytes,
        Err(_) => Vec::new(),
    }
}

pub(super) fn read_bytes(file: &Path) -> Result<Vec<u8>, IngestError> {
    let read = || {
        if is_stdin(file) {
            return stdin().map(<[u8]>::to_vec);
        }
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

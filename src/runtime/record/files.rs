//! The files of a daemon's record: `PATH-000001.mcap` and on, each started again, the oldest removed.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Digits of a number in a name; no other file is taken for one of the record.
const DIGITS: usize = 6;
const ENDING: &str = ".mcap";
/// The last bytes of a finished file.
const END: [u8; 8] = *b"\x89MCAP0\r\n";

/// Begins the next file and gives its path. No file that is there is written to.
pub(super) fn begin(path: &Path) -> io::Result<(PathBuf, File)> {
    let folder = folder(path);
    fs::create_dir_all(folder)?;
    let mut number = numbered(path)?.last().map_or(0, |(number, ..)| *number);
    loop {
        number += 1;
        let file = folder.join(format!("{}-{number:0DIGITS$}{ENDING}", stem(path)));
        match File::create_new(&file) {
            Ok(opened) => return Ok((file, opened)),
            // Somebody else begins one too.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
}

/// Removes the oldest while all of them hold more than `most` bytes; never the newest.
pub(super) fn remove_oldest(path: &Path, most: u64) -> io::Result<()> {
    let files = numbered(path)?;
    let mut bytes: u64 = files.iter().map(|(_, _, bytes)| bytes).sum();
    let Some((_, older)) = files.split_last() else {
        return Ok(());
    };
    for (_, file, own) in older {
        if bytes <= most {
            break;
        }
        fs::remove_file(file)?;
        bytes -= own;
    }
    Ok(())
}

/// Whether the file has an end, as a finished one has.
pub(super) fn is_ended(file: &Path) -> bool {
    let last = || -> io::Result<[u8; END.len()]> {
        let mut opened = File::open(file)?;
        let length = i64::try_from(END.len()).unwrap_or_default();
        // A file also begins so: it is longer than that.
        opened.seek(SeekFrom::End(-2 * length))?;
        opened.seek(SeekFrom::End(-length))?;
        let mut last = [0; END.len()];
        opened.read_exact(&mut last)?;
        Ok(last)
    };
    last().is_ok_and(|last| last == END)
}

/// The number, path and bytes of each file, the oldest first.
fn numbered(path: &Path) -> io::Result<Vec<(u64, PathBuf, u64)>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder(path))? {
        let entry = entry?;
        if let Some(number) = number(path, &entry.file_name()) {
            files.push((number, entry.path(), entry.metadata()?.len()));
        }
    }
    files.sort_unstable();
    Ok(files)
}

fn number(path: &Path, name: &OsStr) -> Option<u64> {
    let digits = name.to_str()?.strip_prefix(&*stem(path))?;
    let digits = digits.strip_prefix('-')?.strip_suffix(ENDING)?;
    let is_one = digits.len() >= DIGITS && digits.bytes().all(|byte| byte.is_ascii_digit());
    is_one.then(|| digits.parse().ok()).flatten()
}

fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

fn stem(path: &Path) -> std::borrow::Cow<'_, str> {
    path.file_stem().unwrap_or_default().to_string_lossy()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_of_the_record_go_and_no_other_file_is_touched() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/site.mcap");
        for number in 1..=4 {
            let (file, opened) = begin(&path).unwrap();
            assert!(file.ends_with(format!("site-00000{number}.mcap")));
            opened.set_len(10).unwrap();
        }
        let others = ["site.mcap", "site-2012.mcap", "site-000001.mcap.gz"];
        for other in others {
            fs::write(path.with_file_name(other), [0; 100]).unwrap();
        }
        remove_oldest(&path, 25).unwrap();
        let left = numbered(&path).unwrap();
        let left: Vec<u64> = left.iter().map(|(number, ..)| *number).collect();
        assert_eq!(left, [3, 4]);
        // Numbers are not used again, and the newest stays whatever it holds.
        assert!(begin(&path).unwrap().0.ends_with("site-000005.mcap"));
        remove_oldest(&path, 0).unwrap();
        assert_eq!(numbered(&path).unwrap().len(), 1);
        for other in others {
            assert!(path.with_file_name(other).exists(), "{other}");
        }
    }
}

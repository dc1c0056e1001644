//! Which file systems the state and the sources are on, and how long the state's takes to sync.

use super::{CheckVerdict, Finding};
use crate::config::{Config, RecordFiles};
use crate::reading::upper_median_by;
use crate::runtime::clock::Stopwatch;
use nix::sys::statfs::statfs;
use nix::sys::statvfs::statvfs;
use nix::unistd::{AccessFlags, access};
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;

const FILE_SYSTEM: &str = "file-system";
const FSYNC: &str = "fsync";
const RECORD: &str = "record";
/// Syncs that are measured.
const SYNCS: usize = 20;
/// A batch of readings costs one sync or more; a slower disk falls behind in a catch-up.
const SLOW: Duration = Duration::from_millis(100);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum DiskKind {
    Local,
    /// Changes made elsewhere raise no event, and locks may not hold.
    Network,
    /// Gone after the next start of the machine.
    Memory,
    /// Some are local, some are not.
    Unsure,
}

/// The numbers of `statfs(2)` and of the kernel's `magic.h`.
const FILE_SYSTEMS: [(i64, &str, DiskKind); 19] = [
    (0xEF53, "ext4", DiskKind::Local),
    (0x5846_5342, "xfs", DiskKind::Local),
    (0x9123_683E, "btrfs", DiskKind::Local),
    (0xF2F5_2010, "f2fs", DiskKind::Local),
    (0x2FC1_2FC1, "zfs", DiskKind::Local),
    (0x4D44, "vfat", DiskKind::Local),
    (0x2011_BAB0, "exfat", DiskKind::Local),
    (0x794C_7630, "overlayfs", DiskKind::Local),
    (0x0102_1994, "tmpfs", DiskKind::Memory),
    (0x8584_58F6, "ramfs", DiskKind::Memory),
    (0x6969, "nfs", DiskKind::Network),
    (0xFF53_4D42, "cifs", DiskKind::Network),
    (0xFE53_4D42, "smb2", DiskKind::Network),
    (0x517B, "smb", DiskKind::Network),
    (0x0102_1997, "9p", DiskKind::Network),
    (0x00C3_6400, "ceph", DiskKind::Network),
    (0x5346_414F, "afs", DiskKind::Network),
    (0x0BD0_0BD0, "lustre", DiskKind::Network),
    (0x6573_5546, "fuse", DiskKind::Unsure),
];

/// A finding for the state folder and one for each source.
pub(super) fn file_systems(config: &Config) -> Vec<Finding> {
    let mut findings = vec![state(&config.site.state_dir)];
    for source in &config.sources {
        let place = format!("source {:?}, ", source.id);
        findings.push(of_source(&place, source.pattern.folder()));
    }
    findings
}

fn state(folder: &Path) -> Finding {
    let place = format!("state folder {}", folder.display());
    let (verdict, text) = match kind(folder) {
        Err(error) => (CheckVerdict::Unknown, error.to_string()),
        Ok((name, DiskKind::Local)) => (CheckVerdict::Good, format!("on {name}")),
        Ok((name, DiskKind::Memory)) => (
            CheckVerdict::Doubtful,
            format!("on {name}, lost when the machine restarts; move it to a disk"),
        ),
        Ok((name, DiskKind::Network)) => (
            CheckVerdict::Wrong,
            format!(
                "on {name}, a network file system, whose locks and syncs cannot be relied on; \
                     move it to a local disk"
            ),
        ),
        Ok((name, DiskKind::Unsure)) => (
            CheckVerdict::Unknown,
            format!("on {name}; see that it is a local disk"),
        ),
    };
    Finding::new(FILE_SYSTEM, verdict, format!("{place}: {text}"))
}

fn of_source(place: &str, folder: &Path) -> Finding {
    let (verdict, text) = match kind(folder) {
        Err(error) => (CheckVerdict::Unknown, error.to_string()),
        Ok((name, DiskKind::Local | DiskKind::Memory)) => {
            (CheckVerdict::Good, format!("on {name}"))
        }
        Ok((name, DiskKind::Network | DiskKind::Unsure)) => (
            CheckVerdict::Doubtful,
            format!(
                "on {name}: what others write there raises no event, so the files are looked \
                     at every two seconds"
            ),
        ),
    };
    Finding::new(
        FILE_SYSTEM,
        verdict,
        format!("{place}{}: {text}", folder.display()),
    )
}

/// Of `folder`, or where it would be created.
fn kind(folder: &Path) -> nix::Result<(String, DiskKind)> {
    let magic = statfs(existing_ancestor(folder))?.filesystem_type().0;
    // 32-bit numbers, which some machines sign-extend.
    let magic = magic & 0xFFFF_FFFF;
    let known = FILE_SYSTEMS.iter().find(|(number, ..)| *number == magic);
    Ok(match known {
        Some((_, name, kind)) => ((*name).to_owned(), *kind),
        None => (
            format!("an unknown file system ({magic:#x})"),
            DiskKind::Unsure,
        ),
    })
}

/// `folder`, or the deepest of those above it that is there.
fn existing_ancestor(folder: &Path) -> &Path {
    let there = folder.ancestors().find(|path| path.exists());
    let there = there.filter(|path| !path.as_os_str().is_empty());
    there.unwrap_or(Path::new("."))
}

/// The median time to make 4 KiB durable in the state folder.
pub(super) fn fsync(folder: &Path) -> Finding {
    let place = folder.display();
    if !folder.is_dir() {
        let there = existing_ancestor(folder);
        if let Err(error) = access(there, AccessFlags::W_OK) {
            let there = there.display();
            let text = format!(
                "{place} is not there, and cannot be created in {there} as this user: {error}"
            );
            return Finding::new(FSYNC, CheckVerdict::Wrong, text);
        }
        let text = format!("{place} is not there yet; it is created at the first start");
        return Finding::new(FSYNC, CheckVerdict::Unknown, text);
    }
    match syncs(folder) {
        Err(error) => Finding::new(
            FSYNC,
            CheckVerdict::Wrong,
            format!("nothing can be written to {place}: {error}"),
        ),
        Ok(mut times) => {
            let median = upper_median_by(&mut times, Ord::cmp).unwrap_or_default();
            let milliseconds = median.as_secs_f64() * 1e3;
            let text = format!("median of {SYNCS} in {place}: {milliseconds:.2} ms");
            if median > SLOW {
                let text = format!("{text}; a catch-up on history will be slow");
                Finding::new(FSYNC, CheckVerdict::Doubtful, text)
            } else {
                Finding::new(FSYNC, CheckVerdict::Good, text)
            }
        }
    }
}

/// Whether the daemon's own record can be written where it is to be, and has room.
pub(super) fn record(files: &RecordFiles) -> Finding {
    let folder = files.path.parent().unwrap_or(Path::new("."));
    let place = folder.display();
    let there = existing_ancestor(folder);
    // What the rights promise, a file system such as /proc need not keep.
    let tried = if there == folder {
        tempfile::tempfile_in(folder).map(drop)
    } else {
        access(there, AccessFlags::W_OK).map_err(io::Error::from)
    };
    if let Err(error) = tried {
        let text = format!("nothing can be recorded in {place} as this user: {error}");
        return Finding::new(RECORD, CheckVerdict::Wrong, text);
    }
    match statvfs(there) {
        Err(error) => Finding::new(RECORD, CheckVerdict::Unknown, format!("{place}: {error}")),
        Ok(disk) => {
            let free = disk.blocks_available().saturating_mul(disk.fragment_size());
            let (free, asked) = (free / 1_000_000, files.total / 1_000_000);
            let text = format!("{place}: {free} MB free, up to {asked} MB are recorded");
            if free < asked {
                let text = format!("{text}; a full disk ends the record: lower record_total");
                Finding::new(RECORD, CheckVerdict::Doubtful, text)
            } else {
                Finding::new(RECORD, CheckVerdict::Good, text)
            }
        }
    }
}

fn syncs(folder: &Path) -> io::Result<Vec<Duration>> {
    let mut file: File = tempfile::tempfile_in(folder)?;
    let mut times = Vec::with_capacity(SYNCS);
    for _ in 0..SYNCS {
        let stopwatch = Stopwatch::start();
        file.write_all(&[0; 4096])?;
        file.sync_data()?;
        times.push(stopwatch.elapsed());
    }
    Ok(times)
}

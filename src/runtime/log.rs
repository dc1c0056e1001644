//! Where the log goes: stderr, as text or JSON, filtered by `RUST_LOG`. Writing it never fails or delays the work.
//!
//! A thread writes the lines. What stderr does not take (it is closed, or lies on a full disk), and what finds no room
//! because stderr stands still, is lost and counted.

use std::io::{self, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::time::Duration;
use tracing_subscriber::EnvFilter;

/// Lines that may wait for stderr.
const WAITING: usize = 4096;
/// At the end: how long what waits may take to be written.
const LAST_LINES: Duration = Duration::from_secs(1);

/// So many of what happens again and again are logged one by one; then each time their number has doubled.
const LOGGED: u64 = 16;
/// Lines that were not written.
static LOST: AtomicU64 = AtomicU64::new(0);
/// The way to the thread that writes.
static WRITER: OnceLock<SyncSender<LogPiece>> = OnceLock::new();

/// How a line of the log looks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum LogFormat {
    /// For people and the system's journal.
    #[default]
    Text,
    /// One JSON object a line.
    Json,
}

/// What is handed to the thread.
#[derive(Debug)]
enum LogPiece {
    LogLine(Vec<u8>),
    /// To be answered when all before it has been written.
    Flush(SyncSender<()>),
}

/// Starts logging; a second call changes nothing.
pub fn init(format: LogFormat) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("info"));
    let builder = tracing_subscriber::fmt()
        .with_writer(|| LogLine)
        .with_env_filter(filter)
        // It would say on stderr that stderr cannot be written to, and end the process where that fails.
        .log_internal_errors(false)
        .with_ansi(false);
    // An error means that someone has started it before.
    let _ = match format {
        LogFormat::Text => builder.try_init(),
        LogFormat::Json => builder.json().try_init(),
    };
}

/// Whether what happens for the `total`-th time is logged.
pub(super) fn is_logged(total: u64) -> bool {
    total <= LOGGED || total.is_power_of_two()
}

/// Lines of the log that could not be written.
pub fn lost() -> u64 {
    LOST.load(Ordering::Relaxed)
}

/// Waits, for a bounded time, until what has been logged is written.
pub fn finish() {
    let Some(writer) = WRITER.get() else { return };
    let (done, wait) = sync_channel(1);
    if writer.try_send(LogPiece::Flush(done)).is_ok() {
        // Whether in time or not, the process ends.
        let _: Result<(), RecvTimeoutError> = wait.recv_timeout(LAST_LINES);
    }
}

/// One line on its way.
#[derive(Debug)]
struct LogLine;

impl Write for LogLine {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let writer = WRITER.get_or_init(start);
        match writer.try_send(LogPiece::LogLine(plain(bytes))) {
            Ok(()) => {}
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                LOST.fetch_add(1, Ordering::Relaxed);
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The line with the control characters within it written out: a name with a line break in it forges no line.
fn plain(bytes: &[u8]) -> Vec<u8> {
    let (line, end) = match bytes.strip_suffix(b"\n") {
        Some(line) => (line, &b"\n"[..]),
        None => (bytes, &b""[..]),
    };
    if !line.iter().any(u8::is_ascii_control) {
        return bytes.to_vec();
    }
    let mut plain = Vec::with_capacity(bytes.len() + 8);
    for byte in line {
        if byte.is_ascii_control() && *byte != b'\t' {
            plain.extend(byte.escape_ascii());
        } else {
            plain.push(*byte);
        }
    }
    plain.extend(end);
    plain
}

/// The thread that writes. It is not joined: where stderr stands still it never ends, and the process must.
fn start() -> SyncSender<LogPiece> {
    let (writer, pieces) = sync_channel(WAITING);
    // Without a thread every line is lost, and counted.
    let _ = std::thread::Builder::new()
        .name("log".to_owned())
        .spawn(move || write(&pieces));
    writer
}

fn write(pieces: &Receiver<LogPiece>) {
    let mut reported = 0;
    while let Ok(piece) = pieces.recv() {
        match piece {
            LogPiece::LogLine(line) => {
                report_lost_lines(&mut reported);
                if io::stderr().write_all(&line).is_err() {
                    LOST.fetch_add(1, Ordering::Relaxed);
                }
            }
            LogPiece::Flush(done) => {
                // Whoever waited may have gone.
                let _ = done.try_send(());
            }
        }
    }
}

/// Says in the log how many lines are missing from it, once for each number.
fn report_lost_lines(reported: &mut u64) {
    let lost = lost();
    if lost > *reported
        && writeln!(
            io::stderr(),
            "{} lines of this log are lost",
            lost - *reported
        )
        .is_ok()
    {
        *reported = lost;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_break_within_a_line_is_written_out() {
        assert_eq!(plain(b"one\ntwo\x1b[0m\n"), b"one\\ntwo\\x1b[0m\n");
        assert_eq!(plain(b"one\ttwo\n"), b"one\ttwo\n");
        assert_eq!(plain("größe\n".as_bytes()), "größe\n".as_bytes());
    }
}

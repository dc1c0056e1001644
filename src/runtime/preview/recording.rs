//! What an MCAP recording holds, framed and decoded as the daemon does it.

use super::refused::RefusedRow;
use crate::runtime::ingest::{Item, decode_message};
use crate::runtime::tail::records::{
    Channels, HEADER_BYTES, MAGIC, NextRecord, RawMessage, RecordFault, frame,
};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// How much of what stands in the place of a recording is shown, bytes.
const SHOWN: usize = 40;

/// Hands every value of the recording, and what is wrong with a record, to `each`, until it says that this is enough.
///
/// # Errors
/// What is wrong with the whole file.
pub(super) fn read_recording(
    file: &Path,
    mut each: impl FnMut(Result<Item, RefusedRow>) -> bool,
) -> Result<(), String> {
    let fail = |error: io::Error| format!("cannot read {}: {error}", file.display());
    let mut reader = io::BufReader::new(File::open(file).map_err(fail)?);
    let mut left = file.metadata().map_err(fail)?.len();
    let mut start = Vec::new();
    reader
        .by_ref()
        .take(MAGIC.len() as u64)
        .read_to_end(&mut start)
        .map_err(fail)?;
    // What begins to record has written nothing yet, or half of it.
    if MAGIC.starts_with(&start) && start.len() < MAGIC.len() {
        return Ok(());
    }
    if start != MAGIC {
        reader
            .take(SHOWN as u64)
            .read_to_end(&mut start)
            .map_err(fail)?;
        return Err(not_mcap(file, &start));
    }
    left -= MAGIC.len() as u64;
    let mut channels = Channels::default();
    while left >= HEADER_BYTES as u64 {
        let mut header = [0; HEADER_BYTES];
        reader.read_exact(&mut header).map_err(fail)?;
        left -= HEADER_BYTES as u64;
        let (opcode, length) = match frame(header, left) {
            NextRecord::Wait | NextRecord::End => return Ok(()),
            NextRecord::Damaged { length } => {
                return Err(format!(
                    "{}: found a record of {length} bytes, expected one that the file has room for: it is refused",
                    file.display()
                ));
            }
            NextRecord::Skip { length } => (None, length),
            NextRecord::Read { opcode, length } => (Some(opcode), length),
        };
        left -= length;
        let Some(opcode) = opcode else {
            io::copy(&mut reader.by_ref().take(length), &mut io::sink()).map_err(fail)?;
            continue;
        };
        let mut body = Vec::new();
        reader
            .by_ref()
            .take(length)
            .read_to_end(&mut body)
            .map_err(fail)?;
        let goes_on = match channels.decode(opcode, &body) {
            Err(error) => each(Err(RefusedRow::of_text(named(file, &error)))),
            Ok(messages) => messages
                .into_iter()
                .all(|message| each_of(file, message, &mut each)),
        };
        if !goes_on {
            return Ok(());
        }
    }
    Ok(())
}

/// Passes on what one message of a chunk holds; whether more is wanted.
fn each_of(
    file: &Path,
    message: Result<RawMessage, RecordFault>,
    each: &mut dyn FnMut(Result<Item, RefusedRow>) -> bool,
) -> bool {
    let message = match message {
        Ok(message) => message,
        Err(error) => return each(Err(RefusedRow::of_text(named(file, &error)))),
    };
    match decode_message(message.channel(), message.publish_time, &message.payload) {
        Ok(item) => item.is_none_or(|item| each(Ok(item))),
        Err(error) => each(Err(RefusedRow::of_message(&error, named(file, &error)))),
    }
}

fn named(file: &Path, error: &impl std::fmt::Display) -> String {
    format!("{}: {error}", file.display())
}

fn not_mcap(file: &Path, start: &[u8]) -> String {
    let shown = String::from_utf8_lossy(start);
    let shown = shown.lines().next().unwrap_or_default();
    format!(
        "{}: found {shown:?}, expected an MCAP recording, as kind = \"mcap\" says: it is refused; is it csv, ndjson or toa5?",
        file.display()
    )
}

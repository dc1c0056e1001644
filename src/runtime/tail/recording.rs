//! A recording on its way in, record by record.

use super::file::{Content, FileTail, read_at};
use super::records::{self, HEADER_BYTES, MAGIC, NextRecord, RawMessage, RecordFault};
use super::text::guarded;
use crate::runtime::ingest::decode_message;
use crate::runtime::log::is_logged;
use std::error::Error;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

impl FileTail {
    pub(super) fn read_record(&mut self, file: &File, size: u64) -> io::Result<()> {
        if self.at == 0 {
            return self.read_magic(file, size);
        }
        if size < self.at + HEADER_BYTES as u64 {
            return Ok(());
        }
        let mut header = [0; HEADER_BYTES];
        file.read_exact_at(&mut header, self.at)?;
        let body_at = self.at + HEADER_BYTES as u64;
        match records::frame(header, size - body_at) {
            NextRecord::Wait => {}
            NextRecord::Skip { length } => self.at = body_at + length,
            NextRecord::Read { opcode, length } => {
                let body = read_at(file, body_at, length)?;
                let end = body_at + length;
                self.take_record(opcode, &body, end, end == size);
            }
            NextRecord::End => {
                tracing::info!(file = %self.path.display(), "recording complete");
                self.content = Content::Complete;
                self.look_behind_footer(file, size)?;
            }
            NextRecord::Damaged { length } => {
                let error = io::Error::other(format!("a record of {length} bytes at {}", self.at));
                self.refuse(&error);
            }
        }
        Ok(())
    }

    /// Refuses a recording of which all has been read where something stands behind its footer: nobody reads that.
    pub(super) fn look_behind_footer(&mut self, file: &File, size: u64) -> io::Result<()> {
        let body_at = self.at + HEADER_BYTES as u64;
        if self.decoder.text_rows(&self.origin).is_some() || size < body_at {
            return Ok(());
        }
        let mut header = [0; HEADER_BYTES];
        file.read_exact_at(&mut header, self.at)?;
        let length = records::footer(header);
        let end =
            length.and_then(|length| body_at.checked_add(length)?.checked_add(MAGIC.len() as u64));
        if let Some(end) = end.filter(|end| size > *end) {
            let behind = size - end;
            self.refuse(&io::Error::other(format!(
                "{behind} bytes stand behind the footer, with which a recording ends: write each recording into a file of its own"
            )));
        }
        Ok(())
    }

    fn read_magic(&mut self, file: &File, size: u64) -> io::Result<()> {
        let length = MAGIC.len() as u64;
        if size >= length {
            if read_at(file, 0, length)? == MAGIC {
                self.at = length;
            } else {
                self.refuse(&io::Error::other("not an MCAP file"));
            }
        }
        Ok(())
    }

    fn take_record(&mut self, opcode: u8, body: &[u8], end: u64, is_last: bool) {
        let Content::Mcap { channels, suspect } = &mut self.content else {
            return;
        };
        match channels.decode(opcode, body) {
            Ok(messages) => {
                self.at = end;
                for message in messages {
                    match message {
                        Ok(message) => self.take_message(&message),
                        Err(error) => self.quarantine_record(&error),
                    }
                }
            }
            Err(_) if is_last && *suspect != Some(self.at) => *suspect = Some(self.at),
            Err(error) => {
                self.quarantine_record(&error);
                self.at = end;
            }
        }
    }

    fn quarantine_record(&mut self, error: &RecordFault) {
        self.quarantined += 1;
        self.refused_rows.add(error);
        let (file, offset, total) = (self.path.display(), self.at, self.quarantined);
        if is_logged(total) {
            tracing::warn!(%file, offset, %error, total, "record quarantined");
        }
    }

    fn take_message(&mut self, message: &RawMessage) {
        let decode = || decode_message(message.channel(), message.publish_time, &message.payload);
        let error: Box<dyn Error> = match guarded(decode) {
            Ok(Ok(Some(item))) => {
                self.refused_rows.end();
                self.expect(item);
                return;
            }
            Ok(Ok(None)) => return,
            Ok(Err(error)) => error.into(),
            Err(error) => error.into(),
        };
        self.refused_rows.add(&*error);
        self.quarantined += 1;
        let (file, total) = (self.path.display(), self.quarantined);
        if is_logged(total) {
            tracing::warn!(%file, %error, total, "message quarantined");
        }
    }
}

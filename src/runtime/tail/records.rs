//! Frames the records of an MCAP file while it is being written: bytes in, messages out.
//!
//! A record is taken only when it is whole, and a chunk only after its CRC. The writer of a
//! seekable file leaves the length of the chunk it is filling at `u64::MAX` and comes back for it,
//! so nothing of an unfinished record is kept: its header is read again each time.

use crate::runtime::ingest::{JSON, MessageChannel};
use mcap::records::{Channel, ChunkHeader, Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, parse_record};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What every MCAP file begins and ends with.
pub const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";
/// Opcode and length, before every record.
pub const HEADER_BYTES: usize = 9;
/// Longest record that is read into memory, and longest content of a chunk, bytes.
const LONGEST_RECORD: u64 = 64 * 1024 * 1024;

/// No file is longer: a record that says it is, an attachment too, hides all that comes after it.
const FARTHEST: u64 = 1 << 44;

/// The header of a chunk that is still being written.
pub const OPEN_CHUNK: [u8; HEADER_BYTES] = [op::CHUNK, 255, 255, 255, 255, 255, 255, 255, 255];

/// What stands at an offset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NextRecord {
    /// Nothing whole yet.
    Wait,
    /// A whole record to be read and handed to [`Channels::decode`].
    Read {
        /// Its kind.
        opcode: u8,
        /// Bytes after the header.
        length: u64,
    },
    /// A whole record that has no messages.
    Skip {
        /// Bytes after the header.
        length: u64,
    },
    /// The footer: nothing comes after it.
    End,
    /// A length that cannot be true; what comes after it cannot be found.
    Damaged {
        /// The length.
        length: u64,
    },
}

/// Says what to do with the record whose header is given and which is followed by `available` more
/// bytes of the file.
pub fn frame(header: [u8; HEADER_BYTES], available: u64) -> NextRecord {
    let [opcode, length @ ..] = header;
    let length = u64::from_le_bytes(length);
    let needed = matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK);
    if header == OPEN_CHUNK {
        NextRecord::Wait
    } else if (needed || opcode == op::METADATA) && length > LONGEST_RECORD || length > FARTHEST {
        NextRecord::Damaged { length }
    } else if length > available {
        NextRecord::Wait
    } else if opcode == op::FOOTER {
        NextRecord::End
    } else if needed {
        NextRecord::Read { opcode, length }
    } else {
        NextRecord::Skip { length }
    }
}

/// The length of a footer, whose header this is.
pub(super) fn footer(header: [u8; HEADER_BYTES]) -> Option<u64> {
    let [opcode, length @ ..] = header;
    (opcode == op::FOOTER).then_some(u64::from_le_bytes(length))
}

/// A message with what its channel says of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RawMessage {
    /// The channel's topic.
    pub topic: String,
    /// The channel's metadata.
    pub metadata: BTreeMap<String, String>,
    /// How its messages are encoded: `json`, or it is not read.
    pub encoding: String,
    /// When it was measured, nanoseconds in the channel's time base.
    pub publish_time: u64,
    /// The message itself.
    pub payload: Vec<u8>,
}

impl RawMessage {
    /// What its channel says of it.
    pub fn channel(&self) -> MessageChannel<'_> {
        MessageChannel {
            topic: &self.topic,
            metadata: &self.metadata,
            encoding: &self.encoding,
        }
    }
}

/// A record that cannot be used; the ones after it can.
#[derive(Debug, thiserror::Error)]
pub enum RecordFault {
    /// It contradicts itself or its CRC.
    #[error("{0}")]
    Broken(#[from] McapError),
    /// A chunk that says it is larger than what is taken.
    #[error("a chunk of {bytes} bytes, more than {LONGEST_RECORD}")]
    Bomb {
        /// How large it says it is.
        bytes: u64,
    },
    /// A chunk whose header does not fit its content.
    #[error("a chunk whose lengths contradict each other")]
    Contradiction,
    /// A message on a channel that the file has not described.
    #[error("a message on the unknown channel {id}")]
    UnknownChannel {
        /// The channel's number.
        id: u16,
    },
    /// A channel's number that now means something else: its messages are not read from there on.
    #[error("channel {id} was {before} and is now {after}")]
    ChannelReused {
        /// The channel's number.
        id: u16,
        /// Its topic and metadata before.
        before: String,
        /// Its topic and metadata now.
        after: String,
    },
}

/// What the records of a chunk hold, in their order.
pub type MessagesRead = Vec<Result<RawMessage, RecordFault>>;

/// A channel's topic and metadata.
type Described = (String, BTreeMap<String, String>);

/// The channels that the file has described so far.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Channels {
    /// Shared with the position that the file goes on from.
    by_id: Arc<BTreeMap<u16, Described>>,
    /// How the messages of those are encoded that are not JSON.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    encodings: BTreeMap<u16, String>,
}

impl Channels {
    /// The messages in one whole record; where it is a chunk, each record in it that cannot be used has its fault instead.
    ///
    /// # Errors
    /// [`RecordFault`] of the whole record; the table of channels is as it was.
    pub fn decode(&mut self, opcode: u8, body: &[u8]) -> Result<MessagesRead, RecordFault> {
        if opcode != op::CHUNK {
            return Ok(self.take(opcode, body)?.into_iter().map(Ok).collect());
        }
        let records = unpack(body)?.into_iter();
        Ok(records
            .filter_map(|(opcode, body)| self.take(opcode, &body).transpose())
            .collect())
    }

    /// Takes what the file says of a channel. One that was something else before is forgotten: nobody knows what its messages are.
    fn describe(&mut self, channel: Channel) -> Result<(), RecordFault> {
        let Channel {
            id,
            topic,
            metadata,
            message_encoding,
            ..
        } = channel;
        let shown = |(topic, metadata): &Described| format!("{topic} {metadata:?}");
        let meaning = (topic, metadata);
        let channels = Arc::make_mut(&mut self.by_id);
        if let Some(before) = channels.get(&id)
            && *before != meaning
        {
            let (before, after) = (shown(before), shown(&meaning));
            channels.remove(&id);
            return Err(RecordFault::ChannelReused { id, before, after });
        }
        channels.insert(id, meaning);
        self.encodings.remove(&id);
        if message_encoding != JSON {
            self.encodings.insert(id, message_encoding);
        }
        Ok(())
    }

    /// The message, where the record is one.
    fn take(&mut self, opcode: u8, body: &[u8]) -> Result<Option<RawMessage>, RecordFault> {
        if opcode == op::CHANNEL
            && let Record::Channel(channel) = parse_record(opcode, body)?
        {
            return self.describe(channel).map(|()| None);
        } else if opcode == op::MESSAGE
            && let Record::Message { header, data } = parse_record(opcode, body)?
        {
            let id = header.channel_id;
            let Some((topic, metadata)) = self.by_id.get(&id) else {
                return Err(RecordFault::UnknownChannel { id });
            };
            return Ok(Some(RawMessage {
                topic: topic.clone(),
                metadata: metadata.clone(),
                encoding: (self.encodings.get(&id).cloned()).unwrap_or_else(|| JSON.to_owned()),
                publish_time: header.publish_time,
                payload: data.into_owned(),
            }));
        }
        Ok(None)
    }
}

/// The records in a chunk, none of them handed out before the CRC of all is right.
fn unpack(body: &[u8]) -> Result<Vec<(u8, Vec<u8>)>, RecordFault> {
    let Record::Chunk { header, data } = parse_record(op::CHUNK, body)? else {
        return Err(RecordFault::Contradiction);
    };
    distrust(&header, &data)?;
    let limit = usize::try_from(LONGEST_RECORD).unwrap_or(usize::MAX);
    let mut reader = LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(limit),
    );
    let mut input = vec![op::CHUNK];
    input.extend_from_slice(&(body.len() as u64).to_le_bytes());
    input.extend_from_slice(body);
    let mut rest = input.as_slice();
    let mut records = Vec::new();
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(wanted) => {
                let (now, later) = rest.split_at(wanted.min(rest.len()));
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                rest = later;
            }
            LinearReadEvent::Record { data, opcode } => records.push((opcode, data.to_vec())),
        }
    }
    Ok(records)
}

/// Checks what no CRC covers: the lengths in the header, before anything is allocated for them.
fn distrust(header: &ChunkHeader, data: &[u8]) -> Result<(), RecordFault> {
    if header.uncompressed_size > LONGEST_RECORD {
        return Err(RecordFault::Bomb {
            bytes: header.uncompressed_size,
        });
    }
    if !header.compression.is_empty() {
        return Ok(());
    }
    let mut rest = data;
    while let Some((start, after)) = rest.split_first_chunk::<HEADER_BYTES>() {
        let [_opcode, length @ ..] = *start;
        let length = usize::try_from(u64::from_le_bytes(length)).unwrap_or(usize::MAX);
        rest = after.get(length..).ok_or(RecordFault::Contradiction)?;
    }
    let whole = rest.is_empty() && header.uncompressed_size == data.len() as u64;
    whole.then_some(()).ok_or(RecordFault::Contradiction)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
        let length = (body.len() as u64).to_le_bytes();
        [&[opcode], length.as_slice(), body].concat()
    }

    fn text(text: &str) -> Vec<u8> {
        let length = u32::try_from(text.len()).unwrap().to_le_bytes();
        [length.as_slice(), text.as_bytes()].concat()
    }

    fn channel(id: u16, topic: &str) -> Vec<u8> {
        let (id, no_schema, no_metadata) = (id.to_le_bytes(), [0; 2], [0; 4]);
        let parts = [
            &id[..],
            &no_schema,
            &text(topic),
            &text("json"),
            &no_metadata,
        ];
        record(op::CHANNEL, &parts.concat())
    }

    fn message(id: u16, payload: &[u8]) -> Vec<u8> {
        let (id, number_and_times) = (id.to_le_bytes(), [0; 20]);
        record(op::MESSAGE, &[&id[..], &number_and_times, payload].concat())
    }

    /// The body of a chunk without compression and CRC.
    fn chunk(records: &[u8]) -> Vec<u8> {
        let length = (records.len() as u64).to_le_bytes();
        let (times, no_crc) = ([0; 16], [0; 4]);
        [&times[..], &length, &no_crc, &text(""), &length, records].concat()
    }

    #[test]
    fn one_record_of_a_chunk_that_cannot_be_used_loses_no_other() {
        let records = [
            channel(1, "/a"),
            message(1, b"first"),
            message(7, b"of nobody"),
            channel(1, "/b"),
            message(1, b"of nobody either"),
            channel(2, "/c"),
            message(2, b"last"),
        ];
        let body = chunk(&records.concat());
        let read = Channels::default().decode(op::CHUNK, &body).unwrap();
        let shown = |one: &Result<RawMessage, RecordFault>| match one {
            Ok(message) => String::from_utf8(message.payload.clone()).unwrap(),
            Err(fault) => fault.to_string(),
        };
        let shown: Vec<String> = read.iter().map(shown).collect();
        let expected = [
            "first",
            "a message on the unknown channel 7",
            "channel 1 was /a {} and is now /b {}",
            "a message on the unknown channel 1",
            "last",
        ];
        assert_eq!(shown, expected);
    }
}

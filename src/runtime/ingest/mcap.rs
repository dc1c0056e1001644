//! Reads MCAP files, whole and checked: every checksum, every length, every value.
//!
//! A file that fails a checksum is refused as a whole, since what can be read of it might be other than what was
//! measured. One that ends before its end is written, because it is still being written or its writer had no power any
//! more, is read as far as its whole records and chunks go, and that is said. Topics that are neither benchmarks nor
//! channels are left out.

use super::bytes::{is_stdin, stdin};
use super::collect::Collector;
use super::mcap_stream::{GROWING, PROVENANCE};
use super::message::{MessageChannel, MessageError, Topic, decode_message, is_said};
use super::remark::Remark;
use super::taken::BadRows;
use super::{IngestError, Item, MCAP_MAGIC as MAGIC, ReadOptions};
use crate::reading::{Disorder, Recording, Timestamp};
use ::mcap::McapError;
use ::mcap::records::{Channel, Record};
use ::mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The longest record or decompressed chunk, in bytes: a damaged length must not become an
/// allocation. Writers make chunks of about one megabyte unless set otherwise.
const RECORD_LENGTH_LIMIT: usize = 64 << 20;

/// What one file holds.
#[derive(Debug)]
pub(super) struct McapRead {
    pub(super) recording: Recording,
    pub(super) disorder: Disorder,
    /// What a person should know of it.
    pub(super) remark: Option<Remark>,
}

/// Reads one file.
pub(super) fn read_mcap(
    file: &Path,
    options: &ReadOptions,
    bad: &mut BadRows<'_>,
    progress: &mut dyn FnMut(f64),
) -> Result<McapRead, IngestError> {
    let length = file.metadata().map_or(0, |metadata| metadata.len());
    let mut done = 0;
    let fail = |source| IngestError::Read {
        file: file.into(),
        source,
    };
    let mut input: Box<dyn Read> = if is_stdin(file) {
        Box::new(stdin().map_err(fail)?)
    } else {
        Box::new(File::open(file).map_err(fail)?)
    };
    let mut reader = LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_check_finishes_after_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_validate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_record_length_limit(RECORD_LENGTH_LIMIT),
    );
    let mut contents = Contents::new(file, options);
    let mut last = Vec::new();
    while let Some(event) = reader.next_event() {
        let event = match event {
            // Where its end is there, it is a length that is wrong.
            Err(McapError::UnexpectedEof) if last != MAGIC => {
                contents.has_no_end = true;
                break;
            }
            event => event.map_err(|source| contents.damaged(source))?,
        };
        match event {
            LinearReadEvent::ReadRequest(wanted) => {
                let space = reader.insert(wanted);
                let read = input.read(space).map_err(fail)?;
                last.extend_from_slice(&space[read.saturating_sub(MAGIC.len())..read]);
                last.drain(..last.len().saturating_sub(MAGIC.len()));
                reader.notify_read(read);
                done += read;
                progress(done as f64 / length.max(1) as f64);
            }
            LinearReadEvent::Record { opcode, data } => {
                let record = ::mcap::parse_record(opcode, data);
                contents.take(record.map_err(|source| contents.damaged(source))?, bad)?;
            }
        }
    }
    contents.finish()
}

struct Contents<'a> {
    file: &'a Path,
    options: &'a ReadOptions,
    channels: BTreeMap<u16, Channel>,
    collected: Collector,
    provenance: BTreeMap<String, String>,
    /// Whether it is a record that is read while a daemon writes it.
    grows: bool,
    has_no_end: bool,
    messages: u64,
    /// The time of the last message that was taken.
    newest: Option<Timestamp>,
    taken: u64,
    counted: Option<u64>,
}

impl<'a> Contents<'a> {
    fn new(file: &'a Path, options: &'a ReadOptions) -> Self {
        Self {
            file,
            options,
            channels: BTreeMap::new(),
            collected: Collector::default(),
            provenance: BTreeMap::new(),
            grows: false,
            has_no_end: false,
            messages: 0,
            newest: None,
            taken: 0,
            counted: None,
        }
    }

    fn damaged(&self, source: McapError) -> IngestError {
        IngestError::Damaged {
            file: self.file.into(),
            source,
        }
    }

    #[expect(
        clippy::wildcard_enum_match_arm,
        reason = "records that hold no readings, among them kinds yet to be invented"
    )]
    fn take(&mut self, record: Record<'_>, bad: &mut BadRows<'_>) -> Result<(), IngestError> {
        match record {
            Record::Channel(channel) => {
                let known = self.channels.get(&channel.id);
                if known.is_some_and(|known| *known != channel) {
                    return Err(self.damaged(McapError::ConflictingChannels(channel.topic)));
                }
                let is_known = known.is_some() || is_said(&channel.topic);
                if !is_known && Topic::parse(&channel.topic).is_none() {
                    tracing::info!(file = %self.file.display(), topic = channel.topic, "left out: neither a benchmark nor a channel");
                }
                self.channels.insert(channel.id, channel);
            }
            Record::Message { header, data } => {
                self.messages += 1;
                let Some(channel) = self.channels.get(&header.channel_id) else {
                    let unknown = McapError::UnknownChannel(header.sequence, header.channel_id);
                    return Err(self.damaged(unknown));
                };
                let of = MessageChannel {
                    topic: &channel.topic,
                    metadata: &channel.metadata,
                    encoding: &channel.message_encoding,
                };
                match decode_message(of, header.publish_time, &data) {
                    Ok(None) => {}
                    Ok(Some(item)) => {
                        if let Err(fault) = self.collect(&channel.topic.clone(), item) {
                            bad.meet(fault)?;
                        }
                    }
                    Err(problem) => bad.meet(self.message(problem))?,
                }
            }
            Record::Metadata(metadata) if metadata.name == PROVENANCE => {
                self.provenance.extend(metadata.metadata);
            }
            Record::Metadata(metadata) if metadata.name == GROWING => self.grows = true,
            Record::Statistics(statistics) => self.counted = Some(statistics.message_count),
            _ => {}
        }
        Ok(())
    }

    fn collect(&mut self, topic: &str, mut item: Item) -> Result<(), IngestError> {
        if let Item::Reading {
            unit, averaging, ..
        } = &mut item
        {
            *averaging = self.options.averaging_of(*unit, *averaging);
        }
        self.taken += 1;
        self.newest = Some(item.time());
        self.collected.add(item).map_err(|odd| {
            self.message(MessageError {
                topic: topic.to_owned(),
                field: odd.field,
                value: format!("{:?}", odd.found),
                expected: odd.expected,
            })
        })
    }

    fn message(&self, problem: MessageError) -> IngestError {
        IngestError::Message {
            file: self.file.into(),
            number: self.messages,
            problem: Box::new(problem),
        }
    }

    fn finish(self) -> Result<McapRead, IngestError> {
        if let Some(expected) = self.counted
            && expected != self.messages
        {
            return Err(IngestError::MessageCount {
                file: self.file.into(),
                found: self.messages,
                expected,
            });
        }
        if self.taken == 0 && self.has_no_end && !self.grows {
            return Err(self.damaged(McapError::UnexpectedEof));
        }
        let remark = self.no_end();
        if self.taken == 0 {
            let topics = self.channels.into_values().map(|channel| channel.topic);
            return Err(IngestError::NoTopics {
                file: self.file.into(),
                topics: topics.collect(),
            });
        }
        let (recording, mut disorder) = self.collected.finish(self.provenance);
        disorder.unended = usize::from(self.has_no_end);
        Ok(McapRead {
            recording,
            disorder,
            remark,
        })
    }

    /// What there is to say of a file without an end.
    fn no_end(&self) -> Option<Remark> {
        let newest = self.newest.filter(|_| self.has_no_end)?;
        let messages = self.messages;
        Some(Remark::new(
            "has not ended".to_owned(),
            format!(
                "it is still being written, or was cut off; read up to message {messages}, the last value taken being that of {newest}"
            ),
        ))
    }
}

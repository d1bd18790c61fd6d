//! The MCAP container, written: chunks of messages packed with lz4, an index, attachments and metadata. Source: the format's
//! specification, <https://mcap.dev/spec>.

use std::collections::BTreeMap;
use std::io::{self, Write};

/// First and last bytes of a file.
pub(super) const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];
/// Messages of a chunk before packing (bytes).
const CHUNK: usize = 1 << 20;

/// Codes of records.
pub(super) mod op {
    pub(in super::super) const HEADER: u8 = 1;
    pub(in super::super) const FOOTER: u8 = 2;
    pub(in super::super) const SCHEMA: u8 = 3;
    pub(in super::super) const CHANNEL: u8 = 4;
    pub(in super::super) const MESSAGE: u8 = 5;
    pub(in super::super) const CHUNK: u8 = 6;
    pub(in super::super) const MESSAGE_INDEX: u8 = 7;
    pub(in super::super) const CHUNK_INDEX: u8 = 8;
    pub(in super::super) const ATTACHMENT: u8 = 9;
    pub(in super::super) const ATTACHMENT_INDEX: u8 = 10;
    pub(in super::super) const STATISTICS: u8 = 11;
    pub(in super::super) const METADATA: u8 = 12;
    pub(in super::super) const METADATA_INDEX: u8 = 13;
    pub(in super::super) const SUMMARY_OFFSET: u8 = 14;
    pub(in super::super) const DATA_END: u8 = 15;
}

/// Names and values of a metadata record or of a channel.
pub(super) type Pairs = BTreeMap<String, String>;

/// Content of a record.
#[derive(Debug, Default)]
struct Fields(Vec<u8>);

impl Fields {
    fn u16(mut self, value: u16) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    fn u32(mut self, value: u32) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    fn u64(mut self, value: u64) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    fn text(self, text: &str) -> Self {
        self.u32(text.len() as u32).raw(text.as_bytes())
    }

    fn raw(mut self, bytes: &[u8]) -> Self {
        self.0.extend(bytes);
        self
    }

    fn pairs(self, pairs: &Pairs) -> Self {
        let inner = pairs.iter().fold(Self::default(), |fields, (name, value)| fields.text(name).text(value));
        self.u32(inner.0.len() as u32).raw(&inner.0)
    }

    fn counts(self, counts: &BTreeMap<u16, u64>) -> Self {
        let inner = counts.iter().fold(Self::default(), |fields, (channel, count)| fields.u16(*channel).u64(*count));
        self.u32(inner.0.len() as u32).raw(&inner.0)
    }

    fn record(self, code: u8) -> Vec<u8> {
        let mut record = vec![code];
        record.extend((self.0.len() as u64).to_le_bytes());
        record.extend(self.0);
        record
    }
}

/// Messages that are not written yet.
#[derive(Debug, Default)]
struct OpenChunk {
    records: Vec<u8>,
    /// Time and place of each message, by channel.
    index: BTreeMap<u16, Vec<(u64, u64)>>,
    span: Option<(u64, u64)>,
}

/// Writes a container.
#[derive(Debug)]
pub(super) struct McapWriter<W: Write> {
    out: W,
    offset: u64,
    chunk: OpenChunk,
    schemas: Vec<Vec<u8>>,
    channels: Vec<Vec<u8>>,
    chunk_indexes: Vec<Vec<u8>>,
    attachment_indexes: Vec<Vec<u8>>,
    metadata_indexes: Vec<Vec<u8>>,
    counts: BTreeMap<u16, u64>,
    span: Option<(u64, u64)>,
}

fn widened(span: Option<(u64, u64)>, ns: u64) -> Option<(u64, u64)> {
    Some(span.map_or((ns, ns), |(first, last)| (first.min(ns), last.max(ns))))
}

impl<W: Write> McapWriter<W> {
    pub(super) fn new(out: W, library: &str) -> io::Result<Self> {
        let mut writer = Self {
            out,
            offset: 0,
            chunk: OpenChunk::default(),
            schemas: Vec::new(),
            channels: Vec::new(),
            chunk_indexes: Vec::new(),
            attachment_indexes: Vec::new(),
            metadata_indexes: Vec::new(),
            counts: BTreeMap::new(),
            span: None,
        };
        writer.put(&MAGIC)?;
        writer.put(&Fields::default().text("ros2").text(library).record(op::HEADER))?;
        Ok(writer)
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.offset += bytes.len() as u64;
        self.out.write_all(bytes)
    }

    /// Adds a schema; returns its number.
    pub(super) fn schema(&mut self, name: &str, definition: &str) -> u16 {
        let id = self.schemas.len() as u16 + 1;
        let record = Fields::default().u16(id).text(name).text("ros2msg").text(definition).record(op::SCHEMA);
        self.chunk.records.extend(&record);
        self.schemas.push(record);
        id
    }

    /// Adds a channel of CDR messages; returns its number.
    pub(super) fn channel(&mut self, schema: u16, topic: &str, metadata: &Pairs) -> u16 {
        let id = self.channels.len() as u16;
        let fields = Fields::default().u16(id).u16(schema).text(topic).text("cdr").pairs(metadata);
        let record = fields.record(op::CHANNEL);
        self.chunk.records.extend(&record);
        self.channels.push(record);
        id
    }

    /// Adds a message at a time since 1970 (ns).
    pub(super) fn message(&mut self, channel: u16, ns: u64, data: &[u8]) -> io::Result<()> {
        let sequence = *self.counts.entry(channel).and_modify(|count| *count += 1).or_insert(1);
        let place = self.chunk.records.len() as u64;
        let fields = Fields::default().u16(channel).u32(sequence as u32).u64(ns).u64(ns).raw(data);
        self.chunk.records.extend(fields.record(op::MESSAGE));
        self.chunk.index.entry(channel).or_default().push((ns, place));
        self.chunk.span = widened(self.chunk.span, ns);
        self.span = widened(self.span, ns);
        if self.chunk.records.len() >= CHUNK { self.end_chunk() } else { Ok(()) }
    }

    fn end_chunk(&mut self) -> io::Result<()> {
        let chunk = std::mem::take(&mut self.chunk);
        if chunk.records.is_empty() {
            return Ok(());
        }
        let mut packer = lz4_flex::frame::FrameEncoder::new(Vec::new());
        packer.write_all(&chunk.records)?;
        let packed = packer.finish().map_err(io::Error::other)?;
        let (first, last) = chunk.span.unwrap_or_default();
        let (size, crc) = (chunk.records.len() as u64, crc32fast::hash(&chunk.records));
        let fields = Fields::default().u64(first).u64(last).u64(size).u32(crc).text("lz4");
        let record = fields.u64(packed.len() as u64).raw(&packed).record(op::CHUNK);
        let (start, length) = (self.offset, record.len() as u64);
        self.put(&record)?;
        let mut offsets = BTreeMap::new();
        let indexes = self.offset;
        for (channel, messages) in &chunk.index {
            offsets.insert(*channel, self.offset);
            let places = messages.iter().fold(Fields::default(), |fields, (ns, place)| fields.u64(*ns).u64(*place));
            let fields = Fields::default().u16(*channel).u32(places.0.len() as u32).raw(&places.0);
            self.put(&fields.record(op::MESSAGE_INDEX))?;
        }
        let index = Fields::default().u64(first).u64(last).u64(start).u64(length).counts(&offsets);
        let index = index.u64(self.offset - indexes).text("lz4").u64(packed.len() as u64).u64(size);
        self.chunk_indexes.push(index.record(op::CHUNK_INDEX));
        Ok(())
    }

    /// Adds a file.
    pub(super) fn attachment(&mut self, ns: u64, name: &str, media_type: &str, data: &[u8]) -> io::Result<()> {
        self.end_chunk()?;
        let size = data.len() as u64;
        let fields = Fields::default().u64(ns).u64(ns).text(name).text(media_type).u64(size).raw(data);
        let crc = crc32fast::hash(&fields.0);
        let record = fields.u32(crc).record(op::ATTACHMENT);
        let index = Fields::default().u64(self.offset).u64(record.len() as u64).u64(ns).u64(ns).u64(size);
        self.attachment_indexes.push(index.text(name).text(media_type).record(op::ATTACHMENT_INDEX));
        self.put(&record)
    }

    /// Adds a metadata record.
    pub(super) fn metadata(&mut self, name: &str, pairs: &Pairs) -> io::Result<()> {
        self.end_chunk()?;
        let record = Fields::default().text(name).pairs(pairs).record(op::METADATA);
        let index = Fields::default().u64(self.offset).u64(record.len() as u64).text(name);
        self.metadata_indexes.push(index.record(op::METADATA_INDEX));
        self.put(&record)
    }

    /// Writes the summary and returns the output.
    pub(super) fn finish(mut self) -> io::Result<W> {
        self.end_chunk()?;
        self.put(&Fields::default().u32(0).record(op::DATA_END))?;
        let start = self.offset;
        let (first, last) = self.span.unwrap_or_default();
        let statistics = Fields::default()
            .u64(self.counts.values().sum())
            .u16(self.schemas.len() as u16)
            .u32(self.channels.len() as u32)
            .u32(self.attachment_indexes.len() as u32)
            .u32(self.metadata_indexes.len() as u32)
            .u32(self.chunk_indexes.len() as u32)
            .u64(first)
            .u64(last)
            .counts(&self.counts)
            .record(op::STATISTICS);
        let groups = [
            (op::SCHEMA, self.schemas.concat()),
            (op::CHANNEL, self.channels.concat()),
            (op::STATISTICS, statistics),
            (op::CHUNK_INDEX, self.chunk_indexes.concat()),
            (op::ATTACHMENT_INDEX, self.attachment_indexes.concat()),
            (op::METADATA_INDEX, self.metadata_indexes.concat()),
        ];
        let mut summary = Vec::new();
        let mut offsets = Vec::new();
        for (code, records) in groups.into_iter().filter(|(_, records)| !records.is_empty()) {
            let place = Fields(vec![code]).u64(start + summary.len() as u64).u64(records.len() as u64);
            offsets.extend(place.record(op::SUMMARY_OFFSET));
            summary.extend(records);
        }
        let offsets_start = start + summary.len() as u64;
        summary.extend(offsets);
        // The checksum covers the footer up to itself.
        summary.push(op::FOOTER);
        summary.extend(20u64.to_le_bytes());
        summary.extend(start.to_le_bytes());
        summary.extend(offsets_start.to_le_bytes());
        summary.extend(crc32fast::hash(&summary).to_le_bytes());
        self.put(&summary)?;
        self.put(&MAGIC)?;
        self.out.flush()?;
        Ok(self.out)
    }
}

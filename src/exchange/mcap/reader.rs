//! The MCAP container of any program, read from start to end. Sizes are checked before memory is asked for; a file that is
//! cut short gives what stands before the cut.

use super::container::{MAGIC, Pairs, op};
use std::io::{self, Read};

/// Largest record that is read, and largest chunk unpacked (bytes).
const LARGEST: u64 = 256 << 20;

/// A record that matters to an import.
#[derive(Debug, PartialEq)]
pub(super) enum Record<'a> {
    Schema {
        id: u16,
        name: &'a str,
        encoding: &'a str,
    },
    Channel {
        id: u16,
        schema: u16,
        topic: &'a str,
        encoding: &'a str,
        metadata: Pairs,
    },
    Message {
        channel: u16,
        ns: u64,
        data: &'a [u8],
    },
    Metadata {
        name: &'a str,
        pairs: Pairs,
    },
    /// A chunk whose content cannot be read.
    DamagedChunk,
}

/// Fault of a container.
#[derive(Debug, thiserror::Error)]
pub(super) enum ContainerFault {
    #[error("it is not an MCAP file")]
    NotMcap,
    #[error("{0}")]
    Unreadable(#[from] io::Error),
    #[error("a record of {0} bytes is longer than the limit of {LARGEST}")]
    TooLarge(u64),
    #[error("a chunk is packed with \"{0}\"; lz4, zstd and unpacked ones can be read")]
    Packing(String),
    #[error("a chunk is damaged: {0}")]
    Chunk(String),
}

/// Fields of a record, in order.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.take(2)?.try_into().ok()?))
    }

    fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        std::str::from_utf8(self.take(length)?).ok()
    }

    fn pairs(&mut self) -> Option<Pairs> {
        let length = self.u32()? as usize;
        let mut inner = Fields(self.take(length)?);
        let mut pairs = Pairs::new();
        while !inner.0.is_empty() {
            pairs.insert(inner.text()?.to_owned(), inner.text()?.to_owned());
        }
        Some(pairs)
    }
}

/// The record of a code and its content; none for others and for malformed ones.
fn parse(code: u8, content: &[u8]) -> Option<Record<'_>> {
    let mut fields = Fields(content);
    Some(match code {
        op::SCHEMA => Record::Schema { id: fields.u16()?, name: fields.text()?, encoding: fields.text()? },
        op::CHANNEL => Record::Channel {
            id: fields.u16()?,
            schema: fields.u16()?,
            topic: fields.text()?,
            encoding: fields.text()?,
            metadata: fields.pairs()?,
        },
        op::MESSAGE => {
            let (channel, _sequence, ns, _published) = (fields.u16()?, fields.u32()?, fields.u64()?, fields.u64()?);
            Record::Message { channel, ns, data: fields.0 }
        }
        op::METADATA => Record::Metadata { name: fields.text()?, pairs: fields.pairs()? },
        _ => return None,
    })
}

/// Calls `take` with every record that matters; returns whether the file is whole. An error of `take` ends it.
pub(super) fn read_records<E: From<ContainerFault>>(
    mut source: impl Read,
    mut take: impl FnMut(Record<'_>) -> Result<(), E>,
) -> Result<bool, E> {
    let unreadable = |error: io::Error| E::from(ContainerFault::Unreadable(error));
    let mut magic = [0; 8];
    match source.read_exact(&mut magic) {
        Ok(()) if magic == MAGIC => {}
        Ok(()) => return Err(ContainerFault::NotMcap.into()),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Err(ContainerFault::NotMcap.into()),
        Err(error) => return Err(unreadable(error)),
    }
    let mut content = Vec::new();
    loop {
        let mut head = [0; 9];
        if !fill(&mut source, &mut head).map_err(unreadable)? {
            return Ok(false);
        }
        let [code, length @ ..] = head;
        let length = u64::from_le_bytes(length);
        match code {
            op::DATA_END | op::FOOTER => return Ok(true),
            op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA | op::CHUNK => {
                if length > LARGEST {
                    return Err(ContainerFault::TooLarge(length).into());
                }
                content.clear();
                // Grows as bytes arrive, so that a length beyond the end asks for no memory.
                source.by_ref().take(length).read_to_end(&mut content).map_err(unreadable)?;
                if (content.len() as u64) < length {
                    return Ok(false);
                }
                if code == op::CHUNK {
                    match unpack(&content, &mut take)? {
                        Ok(()) => {}
                        Err(ContainerFault::Chunk(_)) => take(Record::DamagedChunk)?,
                        Err(fault) => return Err(fault.into()),
                    }
                } else if let Some(record) = parse(code, &content) {
                    take(record)?;
                }
            }
            _ => {
                let skipped = io::copy(&mut source.by_ref().take(length), &mut io::sink()).map_err(unreadable)?;
                if skipped < length {
                    return Ok(false);
                }
            }
        }
    }
}

/// Fills the buffer; false at the end of the source.
fn fill(source: &mut impl Read, buffer: &mut [u8]) -> io::Result<bool> {
    match source.read_exact(buffer) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

/// Gives the records of a chunk; the outer error is that of `take`.
fn unpack<E>(
    content: &[u8],
    take: &mut impl FnMut(Record<'_>) -> Result<(), E>,
) -> Result<Result<(), ContainerFault>, E> {
    let records = match unpacked(content) {
        Ok(records) => records,
        Err(fault) => return Ok(Err(fault)),
    };
    let mut rest = Fields(&records);
    while let Some((code, rest_length)) = (|| Some((rest.take(1)?[0], rest.u64()?)))() {
        let Some(inner) = usize::try_from(rest_length).ok().and_then(|length| rest.take(length)) else {
            return Ok(Err(ContainerFault::Chunk("a record of it is cut short".to_owned())));
        };
        if let Some(record) = parse(code, inner) {
            take(record)?;
        }
    }
    Ok(Ok(()))
}

/// Records of a chunk as bytes.
fn unpacked(content: &[u8]) -> Result<Vec<u8>, ContainerFault> {
    let damaged = |cause: &str| ContainerFault::Chunk(cause.to_owned());
    let mut fields = Fields(content);
    let head = (|| {
        let (_first, _last) = (fields.u64()?, fields.u64()?);
        Some((fields.u64()?, fields.u32()?, fields.text()?, fields.u64()?))
    })();
    let (size, crc, packing, packed) = head.ok_or_else(|| damaged("its header is cut short"))?;
    if size > LARGEST {
        return Err(ContainerFault::TooLarge(size));
    }
    let packed = usize::try_from(packed).ok().and_then(|packed| fields.take(packed));
    let packed = packed.ok_or_else(|| damaged("its content is cut short"))?;
    let mut records = Vec::new();
    // One byte more than it should have shows that it is longer.
    let unpacked = match packing {
        "" => packed.take(size + 1).read_to_end(&mut records).map_err(|e| e.to_string()),
        "lz4" => {
            let mut unpacked = lz4_flex::frame::FrameDecoder::new(packed).take(size + 1);
            unpacked.read_to_end(&mut records).map_err(|e| e.to_string())
        }
        "zstd" => match ruzstd::decoding::StreamingDecoder::new(packed) {
            Ok(unpacked) => unpacked.take(size + 1).read_to_end(&mut records).map_err(|e| e.to_string()),
            Err(error) => Err(error.to_string()),
        },
        other => return Err(ContainerFault::Packing(other.chars().take(20).collect())),
    };
    unpacked.map_err(|cause| damaged(&cause))?;
    if records.len() as u64 != size || (crc != 0 && crc32fast::hash(&records) != crc) {
        return Err(damaged("its checksum or length is wrong"));
    }
    Ok(records)
}

#[cfg(test)]
mod tests {
    use super::super::container::McapWriter;
    use super::*;
    use std::io::Write as _;

    fn sample() -> Vec<u8> {
        let mut writer = McapWriter::new(Vec::new(), "test").expect("writes");
        let schema = writer.schema("std_msgs/msg/Float64", "float64 data\n");
        let channel = writer.channel(schema, "/force", &Pairs::from([("unit".to_owned(), "N".to_owned())]));
        for n in 0..5u8 {
            writer.message(channel, 1000 + u64::from(n), &[0, 1, 0, 0, n]).expect("writes");
        }
        writer.attachment(1000, "a.txt", "text/plain", b"abc").expect("writes");
        writer.metadata("m", &Pairs::from([("k".to_owned(), "v".to_owned())])).expect("writes");
        writer.finish().expect("writes")
    }

    fn read(bytes: &[u8]) -> Result<(Vec<String>, bool), ContainerFault> {
        let mut seen = Vec::new();
        let whole = read_records(bytes, |record| {
            seen.push(format!("{record:?}"));
            Ok::<(), ContainerFault>(())
        })?;
        Ok((seen, whole))
    }

    #[test]
    fn records_come_back_in_their_order() {
        let (seen, whole) = read(&sample()).expect("reads");
        assert!(whole && seen.len() == 8, "{seen:?}");
        assert!(seen[0].contains("std_msgs/msg/Float64") && seen[1].contains("/force") && seen[1].contains("\"N\""));
        assert!(seen[6].contains("ns: 1004") && seen[7].contains("Metadata"));
    }

    #[test]
    fn every_cut_and_every_wrong_byte_ends_in_order() {
        let bytes = sample();
        for cut in 0..bytes.len() {
            if let Ok((seen, whole)) = read(&bytes[..cut]) {
                assert!(seen.len() <= 8 && (!whole || seen.len() == 8), "{cut}");
            }
        }
        for place in 0..bytes.len() {
            for flip in [1, 0x80, 0xff] {
                let mut wrong = bytes.clone();
                wrong[place] ^= flip;
                // Any outcome but a panic or a huge allocation.
                let _outcome = read(&wrong);
            }
        }
    }

    /// A file with one chunk.
    fn chunked(packing: &str, size: u64, packed: &[u8]) -> Vec<u8> {
        let mut chunk = Vec::new();
        chunk.extend([0; 16]);
        chunk.extend(size.to_le_bytes());
        chunk.extend([0; 4]);
        chunk.extend((packing.len() as u32).to_le_bytes());
        chunk.extend(packing.as_bytes());
        chunk.extend((packed.len() as u64).to_le_bytes());
        chunk.extend(packed);
        let mut file = MAGIC.to_vec();
        file.push(op::CHUNK);
        file.extend((chunk.len() as u64).to_le_bytes());
        file.extend(chunk);
        file
    }

    #[test]
    fn chunks_that_lie_about_their_size_are_refused() {
        let mut packer = lz4_flex::frame::FrameEncoder::new(Vec::new());
        packer.write_all(&vec![0; 1 << 20]).expect("packs");
        let bomb = packer.finish().expect("packs");
        assert!(bomb.len() < 10_000);
        for size in [100, 2 << 20] {
            let (seen, whole) = read(&chunked("lz4", size, &bomb)).expect("reads");
            assert!(seen == ["DamagedChunk"] && !whole, "{size}: {seen:?}");
        }
        let error = read(&chunked("lz4", u64::MAX, &bomb)).expect_err("refused").to_string();
        assert!(error.contains("longer than the limit"), "{error}");
        assert!(read(&chunked("snappy", 5, b"abcde")).expect_err("refused").to_string().contains("\"snappy\""));
        assert!(matches!(read(b"PK\x03\x04 some zip"), Err(ContainerFault::NotMcap)));
        assert!(matches!(read(b""), Err(ContainerFault::NotMcap)));
    }
}

//! CRC-32 of blobs: finds every flipped bit of a stored trial, and every other change to 31 neighbouring bits.

/// CRC-32 over some byte strings one after the other.
pub(super) fn checksum(parts: &[&[u8]]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    parts.iter().for_each(|part| hasher.update(part));
    hasher.finalize()
}

/// True where bytes match their stored checksum; rows from before there were checksums have none and pass.
pub(super) fn is_intact(stored: Option<u32>, parts: &[&[u8]]) -> bool {
    stored.is_none_or(|stored| stored == checksum(parts))
}

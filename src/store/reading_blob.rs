//! Readings of a board as bytes. Little-endian, no padding:
//!
//! ```text
//! magic "PPR1"       4 bytes
//! channels           u16
//! readings           u32
//! per reading:
//!   taken (s)        f64
//!   arrived (s)      f64
//!   present          u8      1 a sequence number, 2 a line pressure
//!   sequence number  u64     (only where present)
//!   line pressure    f64     (only where present; bar)
//!   counts           f32 x channels, NaN where the line had none
//! ```

use palpate_tactile::board::Reading;

const MAGIC: &[u8; 4] = b"PPR1";
const HAS_SEQ: u8 = 1;
const HAS_BAR: u8 = 2;

/// Encodes readings; earlier ones may have fewer channels than later ones.
pub(super) fn encode_readings(readings: &[Reading]) -> Vec<u8> {
    let channels = readings.iter().map(|reading| reading.counts.len()).max().unwrap_or(0);
    let mut out = Vec::with_capacity(10 + readings.len() * (33 + 4 * channels));
    out.extend_from_slice(MAGIC);
    out.extend_from_slice(&(channels as u16).to_le_bytes());
    out.extend_from_slice(&(readings.len() as u32).to_le_bytes());
    for reading in readings {
        out.extend_from_slice(&reading.t_s.to_le_bytes());
        out.extend_from_slice(&reading.arrived_s.to_le_bytes());
        let present = |flag: u8, there: bool| if there { flag } else { 0 };
        out.push(present(HAS_SEQ, reading.seq.is_some()) | present(HAS_BAR, reading.line_bar.is_some()));
        out.extend(reading.seq.iter().flat_map(|seq| seq.to_le_bytes()));
        out.extend(reading.line_bar.iter().flat_map(|bar| bar.to_le_bytes()));
        for channel in 0..channels {
            let count = reading.counts.get(channel).copied().flatten().unwrap_or(f32::NAN);
            out.extend_from_slice(&count.to_le_bytes());
        }
    }
    out
}

/// Decodes readings; none where the bytes are damaged.
pub(super) fn decode_readings(bytes: &[u8]) -> Option<Vec<Reading>> {
    let mut rest = bytes.strip_prefix(MAGIC)?;
    let channels = usize::from(u16::from_le_bytes(take(&mut rest)?));
    let count = u32::from_le_bytes(take(&mut rest)?);
    let mut readings = Vec::new();
    for _ in 0..count {
        let t_s = finite(f64::from_le_bytes(take(&mut rest)?))?;
        let arrived_s = finite(f64::from_le_bytes(take(&mut rest)?))?;
        let [present] = take(&mut rest)?;
        let seq = if present & HAS_SEQ != 0 { Some(u64::from_le_bytes(take(&mut rest)?)) } else { None };
        let line_bar = if present & HAS_BAR != 0 { Some(finite(f64::from_le_bytes(take(&mut rest)?))?) } else { None };
        let mut counts = Vec::with_capacity(channels);
        for _ in 0..channels {
            let count = f32::from_le_bytes(take(&mut rest)?);
            counts.push(count.is_finite().then_some(count));
        }
        readings.push(Reading { t_s, arrived_s, seq, counts, line_bar });
    }
    rest.is_empty().then_some(readings)
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (head, tail) = rest.split_first_chunk::<N>()?;
    *rest = tail;
    Some(*head)
}

fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn reading() -> impl Strategy<Value = Reading> {
        let counts = prop::collection::vec(prop::option::of(0.0f32..4096.0), 3);
        (0.0..1e6, 0.0..1e6, any::<Option<u64>>(), prop::option::of(0.0..1.5), counts)
            .prop_map(|(t_s, arrived_s, seq, line_bar, counts)| Reading { t_s, arrived_s, seq, counts, line_bar })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn readings_survive_a_round_trip_and_damage_is_noticed(
            readings in prop::collection::vec(reading(), 0..20), noise: Vec<u8>, cut in 0usize..400,
        ) {
            let bytes = encode_readings(&readings);
            prop_assert_eq!(decode_readings(&bytes), Some(readings));
            prop_assert_eq!(decode_readings(&bytes[..cut.min(bytes.len() - 1)]), None);
            prop_assert_eq!(decode_readings(&noise), None);
        }
    }
}

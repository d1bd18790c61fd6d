//! Fuzzing of the protocol decoder: random bytes for any duration.

use super::{Failure, report};
use crate::fuzz_stream::{FuzzListener, FuzzStream};
use std::time::{Duration, Instant};

/// Number of chunks per seed.
const CHUNKS: u32 = 200_000;
/// Allowed growth of memory after the first seed (kB), for the allocator.
const GROWTH_KB: u64 = 16_384;

pub(crate) fn run(seconds: f64) -> Result<(), Failure> {
    let start = Instant::now();
    let length = Duration::try_from_secs_f64(seconds)?;
    let (mut seed, mut bytes_heard, mut readings, mut bytes) = (0, 0u64, 0, Vec::new());
    let mut first_kb = None;
    while start.elapsed() < length {
        let (mut stream, mut listener) = (FuzzStream::new(seed), FuzzListener::default());
        for chunk in 0..CHUNKS {
            let arrived_s = stream.next(&mut bytes);
            listener.push(&bytes, arrived_s).map_err(|what| format!("seed {seed}, chunk {chunk}: {what}"))?;
            bytes_heard += bytes.len() as u64;
            if chunk % 1000 == 0 && start.elapsed() >= length {
                break;
            }
        }
        readings += listener.readings();
        if let Some(now_kb) = resident_kb() {
            let first = *first_kb.get_or_insert(now_kb);
            if now_kb > first + GROWTH_KB {
                return Err(format!("memory grew from {first} kB to {now_kb} kB by seed {seed}").into());
            }
        }
        seed += 1;
    }
    let memory = resident_kb().map_or_else(|| "unknown".to_owned(), |kb| format!("{kb} kB"));
    let megabytes = bytes_heard / 1_000_000;
    report(format_args!(
        "{seed} streams, {megabytes} MB, {readings} readings: no panic, all checks held; memory {memory}"
    ));
    Ok(())
}

/// Resident memory of this process (kB); Linux only.
fn resident_kb() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.split_whitespace().next()?.parse().ok()
}

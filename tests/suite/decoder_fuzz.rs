//! Random bytes through the protocol decoder, and what must hold for its events whatever the stream. The same seed gives
//! the same stream.
//!
//! A few seeds run with every test. `PALPATE_FUZZ_S=60 cargo test --release --test suite decoder_fuzz` runs for a minute.

use palpate_device::protocol::{BoardEvent, Decoder, checksum};
use std::time::{Duration, Instant};

/// Largest number of channels of a board.
const MOST_CHANNELS: usize = 64;

/// Random stream.
#[derive(Clone, Debug)]
struct FuzzStream {
    state: u64,
    now_s: f64,
    sample: u64,
    format: u64,
}

/// Decoder of a stream that checks its events.
#[derive(Clone, Debug, Default)]
struct FuzzListener {
    decoder: Decoder,
    events: Vec<BoardEvent>,
    last_s: Option<f64>,
    channels: usize,
    readings: u64,
}

impl FuzzStream {
    /// Begins a stream.
    fn new(seed: u64) -> Self {
        Self { state: seed, now_s: 0.0, sample: 0, format: 0 }
    }

    /// The next random number (SplitMix64).
    fn draw(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: u64) -> u64 {
        self.draw() % n
    }

    /// Puts the next bytes into `out` and returns their time of arrival (s).
    fn next(&mut self, out: &mut Vec<u8>) -> f64 {
        out.clear();
        self.now_s += match self.below(50) {
            0 => 3.0,
            1..=9 => 0.0,
            _ => 0.02,
        };
        if self.below(80) == 0 {
            self.format = (self.format + 1) % 9;
            // The handshake of another sketch; without a checksum its lines have none.
            out.extend_from_slice(b"# tactile-gripper fw=1\n");
        }
        for _ in 0..=self.below(3) {
            self.line(out);
        }
        // Damage on the way.
        match self.below(12) {
            0 => {
                let end = self.below(out.len() as u64 + 1) as usize;
                out.truncate(end);
            }
            1 => {
                for _ in 0..self.below(8) {
                    let at = self.below(out.len().max(1) as u64) as usize;
                    let value = self.draw() as u8;
                    if let Some(byte) = out.get_mut(at) {
                        *byte = value;
                    }
                }
            }
            2 => (0..self.below(3000)).for_each(|_| out.push(self.draw() as u8)),
            3 => out.extend(std::iter::repeat_n(b"0:,{>-"[self.below(6) as usize], 2000)),
            4 => out.retain(|byte| *byte != b'\n'),
            5 if !out.is_empty() => {
                let at = self.below(out.len() as u64) as usize;
                out.remove(at);
            }
            _ => {}
        }
        self.now_s
    }

    fn line(&mut self, out: &mut Vec<u8>) {
        self.sample += 1 + u64::from(self.below(30) == 0) * self.below(1000);
        let (n, a) = (self.sample, self.below(4096));
        let odd = ["nan", "", "inf", "1e999", "-5", "0x1f", "99999999999999999999"][self.below(7) as usize];
        let b = if self.below(20) == 0 { odd.to_owned() } else { self.below(4096).to_string() };
        let word = ["err", "open", "---", "5x2", "12.5N", "7 mV", "3m/s²", "flexL", "?"][self.below(9) as usize];
        let between = [",", ", ", " ,,\t", ";", " ", "; ;"][self.below(6) as usize];
        let us = (n * 20_000) & 0xffff_ffff;
        let line = match self.format {
            0 => format!("t_us:{us},seq:{},flexL:{a},flexR:{b},p_bar:0.5", n & 0xffff),
            1 => format!("{a},{b},{n},7"),
            2 => format!(">flexL:{}:{a}§V|g\n>x{}:{b}", n * 20, self.below(200)),
            3 => format!("{{\"flexL\":{a},\"flexR\":\"{b}\",\"seq\":{n},\"deep\":[[{{}}]]}}"),
            4 => format!("name{}:{a} other{}:{b}", self.below(1000), self.below(3)),
            5 => {
                let says = self.below(40) == 0;
                let (body, key) = match says {
                    true => (format!("# tactile-gripper fw=2 adc=12 ch=flexL,b rm={b},{a}"), " ck="),
                    false => (format!("t_us:{us},seq:{n},flexL:{a}.5,flexR:{b}"), ",ck:"),
                };
                let sum = checksum(body.as_bytes());
                format!("{body}{key}{sum}")
            }
            6 => format!("Reading: {n}{between}flexL:{a}N{between}1:{word}{between}_x: {b}{between}{word}"),
            7 => format!("{a}N{between}{word}{between}{b}{between}{n}"),
            _ => format!("# tactile-gripper adc={b} ch={a},b rm={b},2\nch{a};other{}", self.below(9)),
        };
        out.extend_from_slice(line.as_bytes());
        out.extend_from_slice(if self.below(2) == 0 { b"\n" } else { b"\r\n" });
    }
}

impl FuzzListener {
    /// Takes in bytes; a rule that the decoder breaks is an error.
    fn push(&mut self, bytes: &[u8], arrived_s: f64) -> Result<(), String> {
        self.decoder.push(bytes, arrived_s, &mut self.events);
        for event in std::mem::take(&mut self.events) {
            self.check(&event).map_err(|rule| format!("{rule}: {event:?}"))?;
        }
        let (counted, decoded) = (self.decoder.cadence().samples, self.readings);
        if counted == decoded { Ok(()) } else { Err(format!("cadence counts {counted} readings, not {decoded}")) }
    }

    fn check(&mut self, event: &BoardEvent) -> Result<(), &'static str> {
        match event {
            BoardEvent::Reading(reading) => {
                self.readings += 1;
                let before = self.last_s.replace(reading.t_s);
                if before.is_some_and(|before| reading.t_s <= before) {
                    return Err("time does not increase");
                }
                if reading.counts.len() != self.channels {
                    return Err("a reading and the board differ in channels");
                }
                if !reading.t_s.is_finite() || reading.counts.iter().flatten().any(|count| !count.is_finite()) {
                    return Err("a number is not finite");
                }
            }
            BoardEvent::Gap(gap) => {
                if self.last_s != Some(gap.from_s) || gap.to_s <= gap.from_s {
                    return Err("a gap does not follow the last reading");
                }
            }
            BoardEvent::Board(board) => {
                if board.channels.len() < self.channels || board.channels.len() > MOST_CHANNELS {
                    return Err("channels were removed, or are too many");
                }
                self.channels = board.channels.len();
            }
            BoardEvent::Reply(_) | BoardEvent::Captured(_) => {}
        }
        Ok(())
    }
}

/// Resident memory of this process (kB), on Linux.
fn resident_kb() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.split_whitespace().next()?.parse().ok()
}

#[test]
fn whatever_comes_nothing_breaks() {
    let seconds = std::env::var("PALPATE_FUZZ_S").ok().and_then(|text| text.parse::<u64>().ok());
    let (least, chunks) = if seconds.is_some() { (1, 200_000) } else { (20, 1000) };
    let start = Instant::now();
    let (mut seed, mut first_kb, mut bytes) = (0, None, Vec::new());
    while seed < least || start.elapsed() < Duration::from_secs(seconds.unwrap_or(0)) {
        let (mut stream, mut listener) = (FuzzStream::new(seed), FuzzListener::default());
        for chunk in 0..chunks {
            let arrived_s = stream.next(&mut bytes);
            let kept = listener.push(&bytes, arrived_s);
            assert!(kept.is_ok(), "seed {seed}, chunk {chunk}: {kept:?}");
        }
        assert!(listener.readings > 50, "seed {seed}: {} readings", listener.readings);
        // Alone, the decoder takes no more memory with time than the allocator does.
        if let Some(now_kb) = resident_kb().filter(|_| seconds.is_some()) {
            let first = *first_kb.get_or_insert(now_kb);
            assert!(now_kb <= first + 16_384, "memory grew from {first} kB to {now_kb} kB by seed {seed}");
        }
        seed += 1;
    }
}

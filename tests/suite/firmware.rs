//! The firmware, compiled from the header that goes onto the board, against a stand-in for its pins; and the same script
//! through the board that `palpate emulate` pretends to be: both print the same bytes.

use palpate_device::pretended::{BoardSetup, FirmwareBoard};
use palpate_device::wire::{Decoder, Heard};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::LazyLock;

/// What happens to the board.
#[derive(Clone, Debug)]
enum Happening {
    /// It is polled at a time of its clock (µs).
    Poll(u32),
    /// Only the watchdog's timer comes round, at a time of its clock (µs).
    Watch(u32),
    /// Bytes come from the host.
    Hear(Vec<u8>),
}

fn hear(line: &str) -> Happening {
    Happening::Hear(format!("{line}\n").into_bytes())
}

/// The stand-in, compiled once. Without a C compiler these tests fail and say so.
static STAND_IN: LazyLock<(tempfile::TempDir, PathBuf)> = LazyLock::new(|| {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("stand_in");
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
    let ran = Command::new(&compiler)
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", "-o"])
        .arg(&program)
        .arg(root.join("tests/suite/firmware/stand_in.c"))
        .arg("-I")
        .arg(root.join("assets/firmware/due_gripper"))
        .output();
    let ran = ran.unwrap_or_else(|e| {
        panic!("the firmware cannot be tested without a C compiler: \"{compiler}\" does not run ({e}). Install one, or name it in CC")
    });
    assert!(ran.status.success(), "{compiler} refuses the firmware: {}", String::from_utf8_lossy(&ran.stderr));
    (folder, program)
});

fn setup(period_us: u32, channels: usize, most_steps: u8) -> BoardSetup {
    let names = ["flexL", "flexR", "fsrL", "fsrR", "aux1", "aux2", "aux3", "aux4"];
    let ohm = [47_000, 47_000, 4700, 4700, 4700, 4700, 4700, 4700];
    BoardSetup {
        period_us,
        channels: names[..channels].iter().map(|name| (*name).to_owned()).collect(),
        divider_ohm: ohm[..channels].to_vec(),
        bits: 12,
        most_steps,
    }
}

/// Everything that the compiled firmware prints, and what its stand-in notes beside (`!`).
fn in_c(setup: &BoardSetup, start_us: u32, happenings: &[Happening]) -> String {
    let numbers = [setup.period_us, setup.channels.len() as u32, setup.bits, u32::from(setup.most_steps), start_us];
    let mut program = Command::new(&STAND_IN.1)
        .args(numbers.map(|number| number.to_string()))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut script = String::new();
    for happening in happenings {
        match happening {
            Happening::Poll(us) => writeln!(script, "t {us}").unwrap(),
            Happening::Watch(us) => writeln!(script, "w {us}").unwrap(),
            Happening::Hear(bytes) => {
                let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
                writeln!(script, "x {hex}").unwrap();
            }
        }
    }
    let mut input = program.stdin.take().unwrap();
    let writer = std::thread::spawn(move || input.write_all(script.as_bytes()).unwrap());
    let output = program.wait_with_output().unwrap();
    writer.join().unwrap();
    assert!(output.status.success());
    String::from_utf8(output.stdout).unwrap()
}

/// The board's own lines.
fn printed(text: &str) -> Vec<&str> {
    text.lines().filter(|line| !line.starts_with('!')).collect()
}

/// The same through the pretended board.
fn in_rust(setup: &BoardSetup, start_us: u32, happenings: &[Happening]) -> String {
    let (mut conversions, mut last, mut within) = (0_u32, usize::MAX, 0_u32);
    let mut convert = |channel: usize| {
        conversions += 1;
        within = if channel == last && within < 8 { within + 1 } else { 0 };
        last = channel;
        if within == 0 { 4095 } else { 400 * channel as u32 + 10 + within * within + conversions % 7 }
    };
    let mut out = String::new();
    let mut board = FirmwareBoard::begin(setup.clone(), start_us, &mut out);
    let mut now = start_us;
    for happening in happenings {
        match happening {
            Happening::Poll(us) => {
                now = *us;
                board.poll(now, &mut convert, &mut out);
            }
            // The pretended board is never stuck: it is watched when it is polled.
            Happening::Watch(_) => {}
            Happening::Hear(bytes) => bytes.iter().for_each(|byte| {
                board.hear(*byte, now, &mut out);
            }),
        }
    }
    out
}

fn number(line: &str, key: &str) -> f64 {
    let field = line.split(',').find_map(|field| field.strip_prefix(key)?.strip_prefix(':')).unwrap();
    field.parse().unwrap()
}

/// Polls from a time on, each so much after the one before (µs).
fn polls(start_us: u32, every_us: u32, count: u32) -> Vec<Happening> {
    (0..count).map(|k| Happening::Poll(start_us.wrapping_add(k * every_us))).collect()
}

#[test]
fn samples_are_due_every_20_ms_and_do_not_drift_across_the_wrap_of_the_clock() {
    // Polled every 330 us, which 20 ms are no multiple of, from a second before micros() wraps.
    let start = u32::MAX - 1_000_000;
    let told = in_c(&setup(20_000, 4, 0), start, &polls(start, 330, 10_000));
    let lines = printed(&told);
    assert_eq!(
        lines[0],
        "# tactile-gripper fw=2 adc=12 vref=3.3 rate=50 ch=flexL,flexR,fsrL,fsrR rm=47000,47000,4700,4700 ck=55195"
    );
    assert_eq!(lines.len(), 1 + 165, "3.3 s hold 165 periods");
    for (k, line) in lines[1..].iter().enumerate() {
        let late = (number(line, "t_us") as u32).wrapping_sub(start) - 20_000 * k as u32;
        assert!(late < 330 && number(line, "seq") == k as f64, "{line}");
    }
}

#[test]
fn each_channel_is_the_average_of_eight_conversions_after_one_that_is_thrown_away() {
    let told = in_c(&setup(20_000, 4, 0), 0, &polls(0, 20_000, 2));
    assert!(told.ends_with("!conversions 72\n"), "2 samples x 4 channels x 9: {told}");
    // Conversions 2 to 9 on channel 0 are 10 + w² + n mod 7 with w = 1..8 and n = 2..9; the first, 4095, is not among them.
    let kept: u32 = (1..=8).map(|w| 10 + w * w + (w + 1) % 7).sum();
    let line = printed(&told)[1];
    assert!((number(line, "flexL") - f64::from(kept) / 8.0).abs() <= 0.05 + 1e-9, "{line}");
}

#[test]
fn the_parser_reads_what_it_prints_and_takes_no_line_that_lost_a_digit() {
    let told = in_c(&setup(20_000, 8, 20), 7, &polls(7, 20_000, 400));
    let lines = printed(&told);
    let hear = |lost: &dyn Fn(usize) -> Option<usize>| {
        let (mut decoder, mut heard) = (Decoder::default(), Vec::new());
        for (k, line) in lines.iter().enumerate() {
            let mut bytes = format!("{line}\n").into_bytes();
            if let Some(at) = lost(k) {
                bytes.remove(at % line.len());
            }
            decoder.push(&bytes, 0.02 * k as f64, &mut heard);
        }
        let counts = heard.iter().filter_map(|heard| match heard {
            Heard::Reading(reading) => Some((reading.seq, reading.counts.clone())),
            Heard::Gap(_) | Heard::Board(_) | Heard::Said(_) => None,
        });
        (counts.collect::<Vec<_>>(), decoder.cadence())
    };
    let (whole, cadence) = hear(&|_| None);
    assert_eq!((whole.len(), cadence.bad_lines, whole[0].1.len()), (400, 0, 8));
    // Every third line loses a byte, each another one.
    let (kept, cadence) = hear(&|k| (k > 0 && k % 3 == 0).then_some(k / 3));
    assert_eq!((cadence.bad_lines, cadence.lost, kept.len()), (133, 133, 400 - 133));
    assert!(kept.iter().all(|reading| whole.contains(reading)));
}

#[test]
fn a_sample_that_is_missed_is_counted_and_the_next_is_on_time() {
    let told = in_c(&setup(20_000, 2, 0), 0, &[0, 20_000, 95_000, 100_000, 120_500].map(Happening::Poll));
    let pairs: Vec<[f64; 2]> =
        printed(&told)[1..].iter().map(|line| ["t_us", "seq"].map(|key| number(line, key))).collect();
    assert_eq!(pairs, [[0.0, 0.0], [20_000.0, 1.0], [95_000.0, 4.0], [100_000.0, 5.0], [120_500.0, 6.0]]);
}

#[test]
fn pressure_comes_in_steps_up_to_the_maximum_and_rubbish_is_refused() {
    let asked = ["P 0.55", "P 0.57", "P 1.05", "P 1.00", "K", "p 0.5", "P", "P -1", "P 0.5x", "hello", "", "V", "?"];
    let mut happenings: Vec<Happening> = asked.iter().map(|line| hear(line)).collect();
    happenings.push(Happening::Hear([vec![b'A'; 500], b"\nP 0.05\r\n".to_vec()].concat()));
    let told = in_c(&setup(20_000, 4, 20), 0, &happenings);
    let not_understood = "# refused reason=not-understood";
    let hello = printed(&told)[0];
    assert!(hello.contains(" p_max=1.00 ck="), "{hello}");
    let want = [
        hello,
        "# ok p=0.55",
        "# refused reason=not-a-step step=0.05",
        "# refused reason=above-maximum max=1.00",
        "# ok p=1.00",
        "# ok p=1.00",
        not_understood,
        not_understood,
        not_understood,
        not_understood,
        not_understood,
        "# ok p=0.00",
        hello,
        "# refused reason=too-long",
        "# ok p=0.05",
    ];
    assert_eq!(printed(&told), want);
    let pressures: Vec<&str> = told.lines().filter_map(|line| line.strip_prefix("!pressure ")).collect();
    assert_eq!(pressures, ["0", "11", "20", "0", "1"], "and the control box hears no other");
}

#[test]
fn a_board_without_a_control_box_says_so() {
    let told = in_c(&setup(20_000, 4, 0), 0, &[hear("P 0.50"), Happening::Poll(0)]);
    assert_eq!(printed(&told)[1], "# refused reason=no-control-box");
    assert!(!printed(&told)[2].contains("p_bar"));
}

#[test]
fn silence_of_the_host_vents_within_a_second_but_a_sign_of_life_does_not() {
    let start = u32::MAX - 700_000;
    let after = |us: u32| Happening::Poll(start.wrapping_add(us));
    let vents = |happenings: &[Happening]| {
        let told = in_c(&setup(20_000, 4, 30), start, happenings);
        let vented = printed(&told).contains(&"# vent reason=watchdog");
        assert_eq!(vented, told.contains("!pressure 10\n!pressure 0") || told.contains("0\n# vent"), "{told}");
        vented
    };
    let on = || hear("P 0.50");
    assert!(!vents(&[after(0), on(), after(999_000), hear("K"), after(1_900_000)]));
    assert!(vents(&[after(0), on(), after(999_000), after(1_000_001)]));
    // Rubbish is no sign of life: a host whose line is broken must not hold the pressure.
    assert!(vents(&[after(0), on(), after(900_000), hear("%&/"), after(1_100_000)]));
    assert!(!vents(&[after(0), on(), hear("V"), after(5_000_000)]), "nothing to vent");
}

#[test]
fn the_watchdog_vents_without_a_word_while_the_loop_is_stuck_and_says_so_later() {
    let stuck = [Happening::Poll(0), hear("P 0.50"), Happening::Watch(900_000), Happening::Watch(1_000_001)];
    let told = in_c(&setup(20_000, 4, 30), 0, &stuck);
    assert!(told.contains("# ok p=0.50\n!pressure 0\n!conversions"), "{told}");
    let told = in_c(&setup(20_000, 4, 30), 0, &[&stuck[..], &[Happening::Poll(1_020_000)]].concat());
    assert!(printed(&told)[3] == "# vent reason=watchdog" && told.matches("!pressure 0").count() == 2, "{told}");
}

#[test]
fn whatever_happens_the_pretended_board_prints_what_the_firmware_does() {
    let byte = prop_oneof![4 => proptest::sample::select(b"PVK?0123456789. \r\n".to_vec()), 1 => any::<u8>()];
    let lines = ["P 0.50\n", "P 1.00\n", "P 1.50\r\n", "P 0.07\n", "K\n", "V\n", "?\n"];
    let happening = prop_oneof![
        6 => prop_oneof![9 => 0..30_000_u32, 1 => 0..3_000_000_u32].prop_map(Happening::Poll),
        2 => proptest::sample::select(lines.to_vec()).prop_map(|line| Happening::Hear(line.into())),
        1 => proptest::collection::vec(byte, 1..60).prop_map(Happening::Hear),
    ];
    let board =
        (prop_oneof![Just(1000_u32), Just(20_000)], 1..=8_usize, prop_oneof![Just(0_u8), 1..=30_u8], any::<u32>());
    let scripts = (board, proptest::collection::vec(happening, 1..200));
    let mut runner = TestRunner::new_with_rng(Config::with_cases(60), TestRunner::deterministic().new_rng());
    runner
        .run(&scripts, |((period_us, channels, most_steps, start_us), mut happenings)| {
            let setup = setup(period_us, channels, most_steps);
            // Times were drawn as spans from one poll to the next.
            let mut now = start_us;
            for happening in &mut happenings {
                if let Happening::Poll(us) = happening {
                    now = now.wrapping_add(*us);
                    *us = now;
                }
            }
            let told = in_c(&setup, start_us, &happenings);
            let pretended = in_rust(&setup, start_us, &happenings);
            prop_assert_eq!(printed(&told), printed(&pretended));
            Ok(())
        })
        .unwrap();
}

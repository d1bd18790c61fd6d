//! The firmware as it goes onto the board, with a script for its pins.

use super::firmware::{BoardSetup, FirmwareBoard};
use crate::protocol::{BoardEvent, Decoder};

/// What happens to the board.
#[derive(Clone, Debug)]
enum Input {
    /// It is polled at a time of its clock (µs).
    Poll(u32),
    /// Only the watchdog's timer comes round, at a time of its clock (µs).
    Watch(u32),
    /// Bytes come from the host.
    Hear(Vec<u8>),
}

fn hear(line: &str) -> Input {
    Input::Hear(format!("{line}\n").into_bytes())
}

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

/// What a script made of the board.
struct Ran {
    printed: String,
    conversions: u32,
    /// Line pressure after each input (bar).
    line_bar: Vec<f64>,
}

/// Runs a script. The first conversion after a change of channel still shows the one before, as behind a slow multiplexer;
/// the others differ from each other, so that an average of fewer or more than eight is another number.
fn run(setup: &BoardSetup, start_us: u32, inputs: &[Input]) -> Ran {
    let (mut conversions, mut last, mut within) = (0_u32, usize::MAX, 0_u32);
    let mut convert = |channel: usize| {
        conversions += 1;
        within = if channel == last && within < 8 { within + 1 } else { 0 };
        last = channel;
        if within == 0 { 4095 } else { 400 * channel as u32 + 10 + within * within + conversions % 7 }
    };
    let (mut printed, mut line_bar, mut now) = (String::new(), Vec::new(), start_us);
    let mut board = FirmwareBoard::begin(setup, start_us, &mut printed);
    for input in inputs {
        match input {
            Input::Poll(us) => {
                now = *us;
                board.poll(now, &mut convert, &mut printed);
            }
            Input::Watch(us) => {
                now = *us;
                board.watch(now, &mut printed);
            }
            Input::Hear(bytes) => bytes.iter().for_each(|byte| {
                board.hear(*byte, now, &mut printed);
            }),
        }
        line_bar.push(board.line_bar());
    }
    Ran { printed, conversions, line_bar }
}

fn lines(ran: &Ran) -> Vec<&str> {
    ran.printed.lines().collect()
}

fn number(line: &str, key: &str) -> f64 {
    let field = line.split(',').find_map(|field| field.strip_prefix(key)?.strip_prefix(':'));
    field.and_then(|field| field.parse().ok()).unwrap_or_else(|| panic!("{key} in {line}"))
}

/// Polls from a time on, each so much after the one before (µs).
fn polls(start_us: u32, every_us: u32, count: u32) -> Vec<Input> {
    (0..count).map(|k| Input::Poll(start_us.wrapping_add(k * every_us))).collect()
}

#[test]
fn samples_are_due_every_20_ms_and_do_not_drift_across_the_wrap_of_the_clock() {
    // Polled every 330 us, which 20 ms are no multiple of, from a second before micros() wraps.
    let start = u32::MAX - 1_000_000;
    let ran = run(&setup(20_000, 4, 0), start, &polls(start, 330, 10_000));
    let lines = lines(&ran);
    assert_eq!(
        lines[0],
        "# tactile-gripper fw=2 adc=12 vref=3.3 rate=50 ch=flexL,flexR,fsrL,fsrR rm=47000,47000,4700,4700 emulated=1 ck=57262"
    );
    assert_eq!(lines.len(), 1 + 165, "3.3 s hold 165 periods");
    for (k, line) in lines[1..].iter().enumerate() {
        let late = (number(line, "t_us") as u32).wrapping_sub(start) - 20_000 * k as u32;
        assert!(late < 330 && number(line, "seq") == k as f64, "{line}");
    }
}

#[test]
fn each_channel_is_the_average_of_eight_conversions_after_one_that_is_thrown_away() {
    let ran = run(&setup(20_000, 4, 0), 0, &polls(0, 20_000, 2));
    assert_eq!(ran.conversions, 72, "2 samples x 4 channels x 9");
    // Conversions 2 to 9 on channel 0 are 10 + w² + n mod 7 with w = 1..8 and n = 2..9; the first, 4095, is not among them.
    let kept: u32 = (1..=8).map(|w| 10 + w * w + (w + 1) % 7).sum();
    let line = lines(&ran)[1];
    assert!((number(line, "flexL") - f64::from(kept) / 8.0).abs() <= 0.05 + 1e-9, "{line}");
}

#[test]
fn the_parser_reads_what_it_prints_and_takes_no_line_that_lost_a_digit() {
    let ran = run(&setup(20_000, 8, 20), 7, &polls(7, 20_000, 400));
    let lines = lines(&ran);
    let hear = |lost: &dyn Fn(usize) -> Option<usize>| {
        let (mut decoder, mut events) = (Decoder::default(), Vec::new());
        for (k, line) in lines.iter().enumerate() {
            let mut bytes = format!("{line}\n").into_bytes();
            if let Some(at) = lost(k) {
                bytes.remove(at % line.len());
            }
            decoder.push(&bytes, 0.02 * k as f64, &mut events);
        }
        let readings = events.iter().filter_map(BoardEvent::reading);
        let counts = readings.map(|reading| (reading.seq, reading.counts.clone()));
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
    let ran = run(&setup(20_000, 2, 0), 0, &[0, 20_000, 95_000, 100_000, 120_500].map(Input::Poll));
    let pairs: Vec<[f64; 2]> =
        lines(&ran)[1..].iter().map(|line| ["t_us", "seq"].map(|key| number(line, key))).collect();
    assert_eq!(pairs, [[0.0, 0.0], [20_000.0, 1.0], [95_000.0, 4.0], [100_000.0, 5.0], [120_500.0, 6.0]]);
}

#[test]
fn pressure_comes_in_steps_up_to_the_maximum_and_rubbish_is_refused() {
    let asked = ["P 0.55", "P 0.57", "P 1.05", "P 1.00", "K", "p 0.5", "P", "P -1", "P 0.5x", "hello", "", "V", "?"];
    let mut happenings: Vec<Input> = asked.iter().map(|line| hear(line)).collect();
    happenings.push(Input::Hear([vec![b'A'; 500], b"\nP 0.05\r\n".to_vec()].concat()));
    let ran = run(&setup(20_000, 4, 20), 0, &happenings);
    let not_understood = "# refused reason=not-understood";
    let hello = lines(&ran)[0];
    assert!(hello.contains(" p_max=1.00 emulated=1 ck="), "{hello}");
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
    assert_eq!(lines(&ran), want);
    let mut pressures = ran.line_bar.clone();
    pressures.dedup();
    assert_eq!(pressures, [0.55, 1.0, 0.0, 0.05], "no other reaches the control box");
}

#[test]
fn a_board_without_a_control_box_says_so() {
    let ran = run(&setup(20_000, 4, 0), 0, &[hear("P 0.50"), Input::Poll(0)]);
    assert_eq!(lines(&ran)[1], "# refused reason=no-control-box");
    assert!(!lines(&ran)[2].contains("p_bar"));
}

#[test]
fn silence_of_the_host_vents_within_a_second_but_a_sign_of_life_does_not() {
    let start = u32::MAX - 700_000;
    let after = |us: u32| Input::Poll(start.wrapping_add(us));
    let vents = |happenings: &[Input]| {
        let ran = run(&setup(20_000, 4, 30), start, happenings);
        let vented = lines(&ran).contains(&"# vent reason=watchdog");
        // Only a vent that the host asked for comes without the remark.
        assert!(!vented || ran.line_bar.last() == Some(&0.0), "{}", ran.printed);
        vented
    };
    let on = || hear("P 0.50");
    assert!(!vents(&[after(0), on(), after(999_000), hear("K"), after(1_900_000)]));
    assert!(vents(&[after(0), on(), after(999_000), after(1_000_001)]));
    // Rubbish is no sign of life: a host whose line is broken must not hold the pressure.
    assert!(vents(&[after(0), on(), after(900_000), hear("%&/"), after(1_100_000)]));
    assert!(!vents(&[after(0), on(), hear("V"), after(5_000_000)]), "nothing to vent");
    // The interrupt's clock may be a millisecond behind, also where it wraps in between.
    for heard_us in [500_000, 700_200] {
        let behind = Input::Watch(start.wrapping_add(heard_us - 1000));
        assert!(!vents(&[after(heard_us), on(), behind.clone(), after(heard_us + 900_000)]));
        assert!(vents(&[after(heard_us), on(), behind, after(heard_us + 1_000_001)]));
    }
}

#[test]
fn the_watchdog_vents_without_a_word_while_the_loop_is_stuck_and_says_so_later() {
    let stuck = [Input::Poll(0), hear("P 0.50"), Input::Watch(900_000), Input::Watch(1_000_001)];
    let ran = run(&setup(20_000, 4, 30), 0, &stuck);
    assert!(ran.printed.ends_with("# ok p=0.50\n") && ran.line_bar == [0.0, 0.5, 0.5, 0.0], "{}", ran.printed);
    let ran = run(&setup(20_000, 4, 30), 0, &[&stuck[..], &[Input::Poll(1_020_000)]].concat());
    assert_eq!(lines(&ran)[3], "# vent reason=watchdog");
}

#[test]
fn pressure_set_by_hand_is_printed_and_the_watchdog_leaves_it() {
    let mut printed = String::new();
    let mut board = FirmwareBoard::begin(&setup(20_000, 2, 30), 0, &mut printed);
    for k in 0..200_u32 {
        board.set_by_hand(16, 20_000 * k);
        board.poll(20_000 * k, &mut |_| 1, &mut printed);
    }
    assert!(printed.contains(",p_bar:0.80,") && !printed.contains("vent") && board.line_bar() == 0.8);
    // The host's own pressure is watched again.
    assert!("P 0.50\n".bytes().any(|byte| board.hear(byte, 4_000_000, &mut printed)));
    board.poll(5_000_001, &mut |_| 1, &mut printed);
    assert!(printed.contains("# vent reason=watchdog\n") && board.line_bar() == 0.0);
}

/// What the sketch does to a board of which only this is known: one letter for each thing.
#[cfg(unix)]
const SKETCH_BOARD: &str = r#"
#include <stdint.h>
#include <stdio.h>
enum { A0, A1, A2, A3, DAC0 };
static uint32_t clock_us;
static uint32_t micros(void) { return clock_us; }
static int analogRead(uint8_t pin) { return pin; }
static void analogWrite(int pin, uint32_t value) { printf("%s%u ", pin == DAC0 ? "dac" : "pin", (unsigned)value); }
static void analogReadResolution(int bits) { (void)bits; }
static void analogWriteResolution(int bits) { (void)bits; }
static void watchdogEnable(uint32_t ms) { printf("watchdog%u ", (unsigned)ms); }
static void watchdogReset(void) { printf("fed "); }
static const char *host = "P 0.50\n";
static int available(void) { return *host != 0; }
static int read_byte(void) { return *host++; }
static void begin(long baud) { (void)baud; printf("begun "); }
static size_t write_bytes(const uint8_t *text, size_t length) { (void)text; return length; }
static struct {
  void (*begin)(long); int (*available)(void); int (*read)(void); size_t (*write)(const uint8_t *, size_t);
} SerialUSB = {begin, available, read_byte, write_bytes};
#include SKETCH
int main(void) {
  watchdogSetup(); initVariant(); setup(); sysTickHook(); loop(); sysTickHook(); clock_us = 1000001; sysTickHook();
  return 0;
}
"#;

/// Compiles the sketch for that board.
#[cfg(unix)]
fn sketch(folder: &std::path::Path, most_steps: u32) -> std::process::Output {
    let (code, sketch) =
        (folder.join("board.c"), concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/firmware/due_gripper"));
    std::fs::write(&code, SKETCH_BOARD).expect("writes");
    let mut compiler = std::process::Command::new("cc");
    compiler.arg(format!("-DMOST_STEPS={most_steps}")).arg(format!("-DSKETCH=\"{sketch}/due_gripper.ino\""));
    compiler.args(["-DARDUINO_ARCH_SAM", "-I", sketch, "-o"]).arg(folder.join("board")).arg(code);
    compiler.output().expect("the compiler that built the firmware")
}

#[cfg(unix)]
#[test]
fn the_sketch_puts_out_no_pressure_first_and_starts_the_chips_watchdog() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let built = sketch(folder.path(), 30);
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let ran = std::process::Command::new(folder.path().join("board")).output().expect("just built");
    let did = String::from_utf8_lossy(&ran.stdout);
    // Under pressure only the loop feeds the watchdog, and after a second without the host there is none.
    assert_eq!(did.trim(), "watchdog2000 dac0 dac0 begun dac0 fed fed dac1365 dac0 fed");
    let beyond = sketch(folder.path(), 31);
    assert!(!beyond.status.success() && String::from_utf8_lossy(&beyond.stderr).contains("MOST_STEPS is above 30"));
}
